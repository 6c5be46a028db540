"""Hypothesis strategies for syntax trees: everything that can be written in a dialect and reads back the same."""

from __future__ import annotations

from hypothesis import strategies as st

from mlnlite.source import Source
from mlnlite.syntax import tree
from mlnlite.syntax.facts import EvidenceProgram
from mlnlite.syntax.rows import Rows

VARIABLES = ("x", "y", "z", "a1", "p2", "someone", "v", "éa")
PREDICATES = ("P", "Q", "Smokes", "isA", "P2", "Rain", "has_part", "vote", "ist-über")
WORDS = ("Anna", "Bob", "B2", "3-2", "-1", "42", "to_pour", "far", "glass.n.06", "O", "Ünal")
ODD = (
    "any text",
    'a "quoted" word',
    "back\\slash",
    "",
    "// no comment",
    "?x",
    "+x",
    "(",
    "a,b",
    "1e-3",
    ".",
    "v",
    "inf",
)
FUNCTIONS = ("log", "logx", "ln", "log2", "log10", "exp", "sqrt", "logit")

any_text = st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=6)
constant_names = st.one_of(st.sampled_from(WORDS), st.sampled_from(ODD), any_text).filter(lambda n: n not in VARIABLES)
constants = st.builds(tree.Constant, constant_names)
variables = st.builds(tree.Variable, st.sampled_from(VARIABLES), st.just(False))
templates = st.builds(tree.Variable, st.sampled_from(VARIABLES), st.booleans())


def formulas(terms=None):
    """Formulas of every kind over the given terms, by default variables without `+` and constants."""
    terms = variables | constants if terms is None else terms
    arguments = st.lists(terms, max_size=3).map(tuple)
    atoms = st.builds(tree.Atom, st.sampled_from(PREDICATES), arguments)
    leaves = st.one_of(atoms, atoms, st.builds(tree.Equality, terms, terms))
    bound = st.lists(st.sampled_from(VARIABLES), min_size=1, max_size=3, unique=True).map(tuple)

    def inner(parts):
        several = st.lists(parts, min_size=2, max_size=4).map(tuple)
        return st.one_of(
            st.builds(tree.Not, parts),
            st.builds(tree.And, several),
            st.builds(tree.Or, several),
            st.builds(tree.Implies, parts, parts),
            st.builds(tree.Iff, parts, parts),
            st.builds(tree.Quantified, st.sampled_from(["exist", "forall"]), bound, parts),
        )

    return st.recursive(leaves, inner, max_leaves=8)


numbers = st.builds(tree.Number, st.floats(allow_nan=False) | st.sampled_from([0.0, 1.0, -0.5, 2.0, 1e-3]))


def _expressions(parts):
    return st.one_of(
        st.builds(tree.Call, st.sampled_from(FUNCTIONS), st.lists(parts, min_size=1, max_size=2).map(tuple)),
        st.builds(tree.Arithmetic, st.sampled_from("+-*/^"), parts, parts),
        st.builds(tree.Arithmetic, st.just("-"), st.none(), parts),
    )


weights = numbers | st.recursive(numbers, _expressions, max_leaves=4)
names = st.sampled_from(["person", "Kind", "type_2", "rep"])
type_declarations = st.builds(tree.TypeDeclaration, names, st.lists(constants, max_size=4).map(tuple))
arguments = st.builds(tree.Argument, names, st.sampled_from(["", "", "!", "?"]))
predicate_declarations = st.builds(
    tree.PredicateDeclaration, st.sampled_from(PREDICATES), st.lists(arguments, max_size=3).map(tuple), st.booleans()
)


@st.composite
def formula_statements(draw):
    """Soft, hard, fixed and unweighted formulas; soft ones mostly without `+`, so that they can be gathered."""
    kind = draw(st.sampled_from(["soft", "soft", "fixed", "hard", "unweighted"]))
    formula = draw(formulas(st.one_of(templates, constants)) if draw(st.booleans()) else formulas())
    weight = draw(weights) if kind in ("soft", "fixed") else None
    unique = draw(st.lists(st.lists(st.sampled_from(VARIABLES), min_size=1, max_size=3).map(tuple), max_size=2))
    fixed = kind == "fixed" or (kind == "hard" and draw(st.booleans()))
    return tree.FormulaStatement(formula, weight, kind == "hard", fixed, tuple(unique) if draw(st.booleans()) else ())


@st.composite
def siblings(draw):
    """Weighted formulas that differ in constants and weights only."""
    formula = draw(formulas())
    rows = []
    for _ in range(draw(st.integers(1, 4))):
        shape = refilled(formula, lambda: draw(constants))
        rows.append(tree.FormulaStatement(shape, draw(weights)))
    return rows


def refilled(formula, constant):
    """The formula with every constant, from left to right, replaced by what `constant()` gives."""

    def term(t):
        return constant() if isinstance(t, tree.Constant) else t

    match formula:
        case tree.Atom(predicate, terms):
            return tree.Atom(predicate, tuple(term(t) for t in terms))
        case tree.Equality(left, right):
            return tree.Equality(term(left), term(right))
        case tree.Not(operand):
            return tree.Not(refilled(operand, constant))
        case tree.And(operands) | tree.Or(operands):
            return type(formula)(tuple(refilled(operand, constant) for operand in operands))
        case tree.Implies(first, second) | tree.Iff(first, second):
            return type(formula)(refilled(first, constant), refilled(second, constant))
        case tree.Quantified(quantifier, bound, body):
            return tree.Quantified(quantifier, bound, refilled(body, constant))
    raise AssertionError(formula)


def gathered(statements):
    """What reading makes of statements: soft formulas of one shape become one table where the first of them stood."""
    groups: dict[tree.Formula, list[tree.FormulaStatement]] = {}
    order = []
    for statement in statements:
        key = _shape(statement)
        if key is None:
            order.append(statement)
        elif key in groups:
            groups[key].append(statement)
        else:
            groups[key] = [statement]
            order.append(key)
    return tuple(_table(key, groups[key]) if key in groups else key for key in order)


def _shape(statement):
    if not isinstance(statement, tree.FormulaStatement) or statement.weight is None:
        return None
    if statement.fixed or statement.unique or "plus=True" in repr(statement.formula):
        return None
    holes = iter(range(1000))
    return refilled(statement.formula, lambda: tree.Hole(next(holes)))


def _table(shape, statements):
    if len(statements) == 1:
        return statements[0]
    rows = []
    for statement in statements:
        row = []
        _collect(statement.formula, row)
        rows.append(row)
    columns = tuple(zip(*rows, strict=True))
    return tree.FormulaTable(shape, columns, tuple(statement.weight for statement in statements))


def _collect(formula, row):
    """Appends the constants of a formula to `row`, from left to right."""
    for name in formula.__dataclass_fields__:
        part = getattr(formula, name)
        for item in part if isinstance(part, tuple) else (part,):
            if isinstance(item, tree.Constant):
                row.append(item.name)
            elif hasattr(item, "__dataclass_fields__") and name != "span":
                _collect(item, row)


@st.composite
def programs(draw, dialect):
    """Programs as reading makes them. A predicate is declared at most once, since later `P(t)` would be a formula."""
    declared = draw(st.lists(predicate_declarations, unique_by=lambda d: d.name, max_size=4))
    types = draw(st.lists(type_declarations, max_size=2))
    single = draw(st.lists(formula_statements(), max_size=4))
    several = draw(st.lists(siblings(), max_size=2))
    statements = draw(st.permutations([*declared, *types, *single, *(row for rows in several for row in rows)]))
    return tree.Program(gathered(statements), dialect)


@st.composite
def evidence_programs(draw):
    """Evidence of one or several databases, as reading makes it."""
    truths = st.one_of(st.booleans(), st.sampled_from([0.0, 1.5, -0.25]))
    atoms = st.tuples(st.sampled_from(PREDICATES), st.lists(constant_names, max_size=3).map(tuple), truths)
    databases = draw(st.lists(st.lists(atoms, max_size=5), min_size=1, max_size=3))
    rows = Rows()
    for number, facts in enumerate(databases):
        for predicate, terms, truth in facts:
            rows.add(Source("e.db", ""), (predicate, terms), truth, (number, 0))
    types = tuple(draw(st.lists(type_declarations, max_size=2)))
    return EvidenceProgram(tuple(rows.tables()), types, len(databases))
