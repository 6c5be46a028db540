"""Syntax trees to text. What is written reads the same again, and the same in both precedences of `^` and `v`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, assert_never

from mlnlite.syntax import tree
from mlnlite.syntax.build import is_variable
from mlnlite.syntax.dialects import LOOKS_VARIABLE
from mlnlite.syntax.statements import declares
from mlnlite.syntax.walk import variables_of

if TYPE_CHECKING:
    from mlnlite.syntax.facts import EvidenceProgram, FactTable

_WORD = re.compile(r"-?\w+(?:[-.]\w+)*")
# Names that stand alone on the left of `=`, where a number would be taken for a weight.
_NAME = re.compile(r"(?!inf$)[^\W\d]\w*")


def write_model(program: tree.Program) -> str:
    """The text of a program; of an included file only its `#include`."""
    plain = _plain_words(program)
    declared: dict[str, tree.PredicateDeclaration] = {}
    lines: list[str] = []
    for statement in program.statements:
        if isinstance(statement, tree.PredicateDeclaration):
            declared.setdefault(statement.name, statement)
        lines += _statement(statement, plain, declared)
    return "".join(f"{line}\n" for line in lines)


def write_formula(formula: tree.Formula, dialect: tree.Dialect) -> str:
    """The text of a formula. `Hole(0)` of a formula table is written `<1>`, which does not read back."""
    return _formula(formula, _word_writer(dialect, {variable.name for variable in variables_of(formula)}))


def write_weight(weight: tree.WeightExpression) -> str:
    """The text of a weight, without blanks.

    >>> write_weight(tree.Arithmetic("*", tree.Number(2), tree.Call("log", (tree.Number(0.5),))))
    '2*log(0.5)'
    """
    match weight:
        case tree.Number(value):
            return _number(value)
        case tree.Call(function, arguments):
            return f"{function}({','.join(map(write_weight, arguments))})"
        case tree.Size(type_name):
            return f"domSize({type_name})"
        case tree.NumberOf(variable):
            return f"{variable}:"
        case tree.Arithmetic(operator, left, right):
            if left is None:
                return f"{operator}({write_weight(right)})"
            return _operand(left) + operator + _operand(right)
    assert_never(weight)


def write_evidence(evidence: EvidenceProgram) -> str:
    """The text of an evidence file, the same in all dialects: types, then the databases, `---` between them."""
    lines = [_type(declaration) for declaration in evidence.types]
    facts: list[list[str]] = [[] for _ in range(evidence.n_databases)]
    for table in evidence.facts:
        columns = [list(map(_constant, column.texts())) for column in table.columns]
        rows = zip(*columns, strict=True) if columns else iter([()] * len(table.truth))
        for arguments, sign, database in zip(rows, _signs(table), table.database.tolist(), strict=True):
            facts[database].append(sign + table.predicate + (f"({', '.join(arguments)})" if arguments else ""))
    for number, database_lines in enumerate(facts):
        lines += ["---"] * (number > 0) + database_lines
    # A separator that nothing follows counts only if another one follows.
    lines += ["---"] * (len(facts) > 1 and not facts[-1])
    return "".join(f"{line}\n" for line in lines)


def _signs(table: FactTable) -> list[str]:
    """What stands in front of each fact."""
    if table.weight is None:
        return ["" if truth else "!" for truth in table.truth.tolist()]
    return [f"{1 / (1 + math.exp(-w))!r} " if w else "?" for w in table.weight.tolist()]


# --- words

# A term, and whether it stands on the left of `=`.
_WriteWord = Callable[[tree.Term, bool], str]


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _constant(name: str) -> str:
    return name if _WORD.fullmatch(name) else _quoted(name)


def _word_writer(dialect: tree.Dialect, variables: set[str]) -> _WriteWord:
    """How to write terms; a constant that could be taken for a variable is quoted."""
    sign = "?" if dialect == "prac" else ""

    def write(term: tree.Term, left: bool) -> str:
        match term:
            case tree.Variable(name, plus):
                return f"{'+' if plus else ''}{sign}{name}"
            case tree.Constant(name):
                doubtful = (
                    name in variables or LOOKS_VARIABLE.fullmatch(name) if sign and variables else is_variable(name)
                )
                return name if (_NAME if left else _WORD).fullmatch(name) and not doubtful else _quoted(name)
            case tree.Hole(index):
                return f"<{index + 1}>"
        assert_never(term)

    return write


def _plain_words(program: tree.Program) -> _WriteWord:
    """The writer of terms for a whole program."""
    variables = {v.name for formula in _formulas(program) for v in variables_of(formula)}
    return _word_writer(program.dialect, variables)


def _formulas(program: tree.Program) -> Iterator[tree.Formula]:
    for statement in program.statements:
        if isinstance(statement, tree.FormulaStatement | tree.FormulaTable):
            yield statement.formula


# --- formulas


def _formula(formula: tree.Formula, word: _WriteWord) -> str:
    match formula:
        case tree.Atom(predicate, arguments):
            return (
                f"{predicate}({', '.join(word(argument, False) for argument in arguments)})" if arguments else predicate
            )
        case tree.Equality():
            text = f"{word(formula.left, True)} = {word(formula.right, False)}"
            return f"({text})" if text.startswith("+") else text
        case tree.Comparison(operator, left, right):
            text = f"{_sum(left, word, True)} {operator} {_sum(right, word, False)}"
            return f"({text})" if text.startswith("+") else text
        case tree.Count(variables, body, operator, number):
            names = ", ".join(word(tree.Variable(name), False) for name in variables)
            return f"count({_formula(body, word)} | {names}) {operator} {number}"
        case tree.Not(tree.Atom() as atom):
            return "!" + _formula(atom, word)
        case tree.Not(operand):
            return f"!({_formula(operand, word)})"
        case tree.And(operands):
            return " ^ ".join(_part(operand, word) for operand in operands)
        case tree.Or(operands):
            return " v ".join(_part(operand, word) for operand in operands)
        case tree.Implies(body, head):
            return f"{_side(body, word)} => {_side(head, word)}"
        case tree.Iff(left, right):
            return f"{_side(left, word)} <=> {_side(right, word)}"
        case tree.Quantified(quantifier, variables, body):
            names = ",".join(word(tree.Variable(name), False) for name in variables)
            return f"{quantifier.upper()} {names} ({_formula(body, word)})"
    assert_never(formula)


def _sum(term: tree.TermExpression, word: _WriteWord, left: bool) -> str:
    """A side of a comparison; `left`: it starts a formula."""
    if not isinstance(term, tree.Operation):
        return word(term, left)
    inner = [_sum(side, word, left and i == 0) for i, side in enumerate((term.left, term.right))]
    texts = [
        f"({t})" if _needs_parentheses(side, term, i) else t
        for i, (t, side) in enumerate(zip(inner, (term.left, term.right), strict=True))
    ]
    return f"{texts[0]} {term.operator} {texts[1]}"


def _needs_parentheses(side: tree.TermExpression, outer: tree.Operation, place: int) -> bool:
    if not isinstance(side, tree.Operation):
        return False
    if place == 1:
        return True
    return side.operator in "+-" and outer.operator in "*/%"


def _part(operand: tree.Formula, word: _WriteWord) -> str:
    """An operand of `^` or `v`: anything with a connective of its own is put into parentheses."""
    text = _formula(operand, word)
    return f"({text})" if isinstance(operand, tree.And | tree.Or | tree.Implies | tree.Iff) else text


def _side(operand: tree.Formula, word: _WriteWord) -> str:
    """A side of `=>` or `<=>`."""
    text = _formula(operand, word)
    return f"({text})" if isinstance(operand, tree.Implies | tree.Iff) else text


# --- weights


def _number(value: float) -> str:
    return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(value)


def _operand(weight: tree.WeightExpression) -> str:
    text = write_weight(weight)
    bare = not isinstance(weight, tree.Arithmetic) and not text.startswith("-") and text != "inf"
    return text if bare else f"({text})"


# --- statements


def _statement(
    statement: tree.Statement, word: _WriteWord, declared: Mapping[str, tree.PredicateDeclaration]
) -> Iterator[str]:
    match statement:
        case tree.TypeDeclaration():
            yield _type(statement)
        case tree.PredicateDeclaration(name, arguments, closed):
            words = ", ".join(argument.type + argument.marker for argument in arguments)
            yield f"{'*' if closed else ''}{name}" + (f"({words})" if arguments else "")
        case tree.FormulaStatement():
            yield from _weighted(statement, word, declared)
        case tree.FormulaTable():
            yield from _rows(statement, word)
        case tree.Test(query, probability, tolerance, given):
            condition = f"given {given} " if given else ""
            yield f"@test {condition}query {query} = {probability!r} +- {tolerance!r}"
        case tree.Include(path):
            yield f"#include <{path}>" if '"' in path else f'#include "{path}"'
        case _:
            assert_never(statement)


def _type(declaration: tree.TypeDeclaration) -> str:
    return f"{declaration.name} = {{{', '.join(_constant(c.name) for c in declaration.constants)}}}"


def _weighted(
    statement: tree.FormulaStatement, word: _WriteWord, declared: Mapping[str, tree.PredicateDeclaration]
) -> Iterator[str]:
    for group in statement.unique:
        yield f"#unique{{{','.join(word(tree.Variable(name, plus=True), False) for name in group)}}}"
    if statement.fixed and statement.weight is None:
        yield "#fixweight"
    text = _formula(statement.formula, word)
    if isinstance(statement.weight, tree.NumberOf):
        yield f"{word(tree.Variable(statement.weight.variable), False)}: {text}"
    elif statement.weight is not None:
        yield f"{'@' if statement.fixed else ''}{write_weight(statement.weight)} {text}"
    elif statement.hard:
        yield f"{text}."
    else:
        yield f"({text})" if declares(text, declared) else text


def _rows(table: tree.FormulaTable, word: _WriteWord) -> Iterator[str]:
    """One line for each row: the text of the shape, cut at its holes, with the words of the row between."""
    sides: list[tuple[int, bool]] = []

    def cut(term: tree.Term, left: bool) -> str:
        if not isinstance(term, tree.Hole):
            return word(term, left)
        sides.append((term.index, left))
        return "\0"

    first, *texts = _formula(table.formula, cut).split("\0")
    columns = [_column(table.columns[index], left, word) for index, left in sides]
    words = zip(*columns, strict=True) if columns else iter([()] * len(table.weights))
    for weight, row in zip(table.weights, words, strict=True):
        yield f"{write_weight(weight)} {first}" + "".join(a + b for a, b in zip(row, texts, strict=True))


def _column(names: tuple[str, ...], left: bool, word: _WriteWord) -> list[str]:
    written = {name: word(tree.Constant(name), left) for name in set(names)}
    return [written[name] for name in names]
