"""Cubes whose literals are always different atoms: what counting by joins needs.

`S(x) ^ !S(y)` is two cases: `x = y`, where it is never true, and `x != y`. Cube in, cases out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

from mlnlite.errors import LimitReached
from mlnlite.model.formulas import Argument, AtomSchema, Const, Equal, Formula, Var
from mlnlite.model.propositional import Cube
from mlnlite.model.symbols import Predicate

MOST_CASES = 2000


@dataclass(frozen=True, slots=True)
class Case:
    """A conjunction whose literals are different ground atoms in every binding that satisfies its inequalities.

    Two literals of a functional predicate are in addition either of one block in every binding, or in none.

    Attributes:
        literals: atoms with signs.
        different: pairs of terms that must differ.
        same: variables that were replaced, with what by.
    """

    literals: tuple[tuple[AtomSchema, bool], ...]
    different: frozenset[Equal]
    same: tuple[tuple[Var, Argument], ...]


def cases(formula: Formula, cube: Cube, predicates: Mapping[str, Predicate]) -> list[Case]:
    """The cases of a cube; together they cover its bindings, each once.

    Raises:
        LimitReached: if there are too many.
    """
    literals = {formula.atoms[p.index]: t for p, t in cube.items() if not isinstance(p, Equal)}
    start: Case | None = Case(tuple(literals.items()), frozenset(), ())
    for equality, truth in cube.items():
        if isinstance(equality, Equal) and start is not None:
            left, right = _replaced(equality.left, start.same), _replaced(equality.right, start.same)
            start = _equated(start, left, right) if truth else _parted(start, left, right)
    found, stack = [], [start]
    while stack:
        case = stack.pop()
        if case is None:
            continue
        split = next(_open_pairs(case, predicates), None)
        if split is None:
            found.append(case)
        else:
            stack += [_parted(case, *split), _equated(case, *split)]
        if len(found) > MOST_CASES:
            hint = "a formula with many atoms of one predicate is expensive to learn; split it"
            raise LimitReached(f"a formula has more than {MOST_CASES:,} ways in which its atoms can coincide", hint)
    return found


def _open_pairs(case: Case, predicates: Mapping[str, Predicate]) -> Iterator[tuple[Argument, Argument]]:
    """Terms of which it is not known whether they are equal and on which it depends whether two literals coincide."""
    for (a, _), (b, _) in combinations(case.literals, 2):
        if a.predicate != b.predicate:
            continue
        keys = predicates[a.predicate].keys
        value = predicates[a.predicate].value
        pairs = [(a.arguments[i], b.arguments[i]) for i in keys]
        if any(_differ(x, y, case) for x, y in pairs):
            continue
        undecided = [(x, y) for x, y in pairs if x != y]
        if not undecided and value is not None:
            x, y = a.arguments[value], b.arguments[value]
            undecided = [] if x == y or _differ(x, y, case) else [(x, y)]
        yield from undecided


def _differ(x: Argument, y: Argument, case: Case) -> bool:
    if isinstance(x, Const) and isinstance(y, Const):
        return x != y
    return Equal(x, y) in case.different or Equal(y, x) in case.different


def _replaced(term: Argument, same: tuple[tuple[Var, Argument], ...]) -> Argument:
    for variable, by in same:
        if term == variable:
            term = by
    return term


def _parted(case: Case, x: Argument, y: Argument) -> Case | None:
    """The case with two terms different; None if they are the same."""
    if x == y:
        return None
    if isinstance(x, Const) and isinstance(y, Const):
        return case
    return Case(case.literals, case.different | {Equal(x, y)}, case.same)


def _equated(case: Case, x: Argument, y: Argument) -> Case | None:
    """The case with two terms equal; None if that contradicts it."""
    if x == y:
        return case
    if _differ(x, y, case):
        return None
    variable, by = (x, y) if isinstance(x, Var) else (y, x)
    assert isinstance(variable, Var)
    same = (*case.same, (variable, by))
    literals: dict[AtomSchema, bool] = {}
    for schema, sign in case.literals:
        merged = AtomSchema(schema.predicate, tuple(_replaced(t, same) for t in schema.arguments))
        if literals.setdefault(merged, sign) != sign:
            return None
    different = set()
    for pair in case.different:
        left, right = _replaced(pair.left, same), _replaced(pair.right, same)
        if left == right:
            return None
        if not (isinstance(left, Const) and isinstance(right, Const)):
            different.add(Equal(left, right))
    return Case(tuple(literals.items()), frozenset(different), same)
