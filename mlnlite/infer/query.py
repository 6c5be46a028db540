"""What a user asks for: texts in, atoms and ground formulas out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import prod
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, QueryMistake, did_you_mean
from mlnlite.ground.network import Network
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import (
    All,
    Any,
    AtomRef,
    AtomSchema,
    Const,
    Count,
    Equal,
    Exists,
    Expression,
    Formula,
    Iff,
    Not,
    Var,
    parts_of,
)
from mlnlite.model.model import Model
from mlnlite.model.propositional import FALSE, TRUE, Binding, without_quantifiers
from mlnlite.model.symbols import Predicate
from mlnlite.model.typing import Constants, FormulaTyper, atoms_of
from mlnlite.syntax import tree
from mlnlite.syntax.queries import parse_atom_query, split_queries
from mlnlite.syntax.walk import map_terms
from mlnlite.syntax.write import write_formula

Int64 = NDArray[np.int64]

MOST_ROWS, MOST_CASES = 2_000_000, 10_000_000
"""Answers that one question may have, and how many cases of quantifiers."""


@dataclass(frozen=True, slots=True)
class GroundFormula:
    """One grounding of a formula that was asked for: its text, and an expression whose `AtomRef` are atom numbers."""

    text: str
    expression: Expression


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked.

    Attributes:
        atoms: shape (n,), numbers of single atoms, in the order asked.
        formulas: anything else.
        predicates: names of all predicates that it mentions.
    """

    atoms: Int64
    formulas: tuple[GroundFormula, ...]
    predicates: frozenset[str]

    @property
    def all_atoms(self) -> Int64:
        """Numbers of the atoms asked for, and of those of the formulas."""
        inside = [n for f in self.formulas for n in atom_numbers(f.expression)]
        every = np.sort(np.concatenate([self.atoms, np.array(inside, np.int64)]))  # `np.unique`, which hashes, is slow
        return every[np.diff(every, prepend=-1) > 0]


def question_of(query: str | Sequence[str], model: Model, evidence: Evidence, *, lasting: bool = True) -> Question:
    """The question that texts mean.

    Args:
        query: predicate names, ground atoms, atoms with variables (all their groundings), formulas; separated by
            commas or in a sequence.
        model: the vocabulary.
        evidence: the constants.
        lasting: the question will be asked of other facts, too; otherwise the given ones are put into quantifiers.

    Raises:
        SyntaxMistake: if a text is no formula.
        QueryMistake: if it mentions an unknown predicate or constant.
    """
    texts = [query] if isinstance(query, str) else query
    atoms: list[Int64] = []
    formulas: list[GroundFormula] = []
    names: set[str] = set()
    mistakes: list[Diagnostic] = []
    decide = _undecided if lasting else _fact_reader(evidence)
    for text in (item for part in texts for item in split_queries(part)):
        formula = parse_atom_query(text, model.dialect)
        names |= {a.predicate for a in atoms_of(formula)}
        predicate = model.predicates.get(formula.predicate) if isinstance(formula, tree.Atom) else None
        if predicate is not None and predicate.arity and isinstance(formula, tree.Atom) and not formula.arguments:
            atoms.append(_atoms_of_predicate(predicate, evidence))
            continue
        typed = _typed(formula, model, evidence, mistakes)
        if typed is None:
            continue
        for binding, ground in _groundings(typed, evidence, decide):
            if isinstance(typed.body, AtomRef) and isinstance(ground, AtomRef):
                atoms.append(np.array([ground.index], np.int64))
            else:
                formulas.append(GroundFormula(_text(formula, binding, model), ground))
    if mistakes:
        raise QueryMistake(mistakes)
    return Question(np.concatenate([np.empty(0, np.int64), *atoms]), tuple(formulas), frozenset(names))


def _atoms_of_predicate(predicate: Predicate, evidence: Evidence) -> Int64:
    ids = [np.flatnonzero(evidence.present[t][0]) for t in predicate.types]
    n = prod([len(i) for i in ids])
    if n > MOST_ROWS:
        hint = f"ask for fewer: {predicate.name}(Constant, ...)"
        raise QueryMistake(f"{predicate.name} has {n:,} atoms; at most {MOST_ROWS:,} can be asked for at once", hint)
    grid = np.stack(np.meshgrid(*ids, indexing="ij"), -1).reshape(-1, predicate.arity)
    return evidence.atom_number(predicate.name, grid.astype(np.int32))


def _typed(formula: tree.Formula, model: Model, evidence: Evidence, mistakes: list[Diagnostic]) -> Formula | None:
    before = len(mistakes)
    constants = Constants({name: dict(t.index) for name, t in evidence.types.items()})
    typer = FormulaTyper(model.predicates, constants, mistakes)
    typed = typer.typed(formula)
    for i, mistake in enumerate(mistakes[before:], before):
        if mistake.code == "E202" and mistake.hint.startswith("declare"):
            mistakes[i] = replace(mistake, hint=_some(list(model.predicates), "predicates"))
    if typer.comparisons.keys() - model.predicates.keys():
        hint = "ask for atoms, or put the comparison into a formula of the model"
        mistakes.append(
            Diagnostic("E512", "a question cannot compare numbers that no formula compares", formula.span, hint)
        )
    for atom in atoms_of(formula):
        predicate = model.predicates.get(atom.predicate)
        if predicate is None or predicate.arity != len(atom.arguments):
            continue
        for term, type_name in zip(atom.arguments, predicate.types, strict=True):
            known = evidence.types[type_name].index
            if isinstance(term, tree.Constant) and term.name not in known:
                hint = did_you_mean(term.name, list(known)) or _some(list(known))
                message = f"{term.name} is not a constant of the type {type_name}"
                mistakes.append(Diagnostic("E502", message, term.span, hint))
    return typed if len(mistakes) == before else None


def _some(names: list[str], what: str = "constants") -> str:
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    return f"there are {shown}" if names else f"there are no {what}: give evidence"


def _undecided(schema: AtomSchema) -> bool | None:
    return None


def _fact_reader(evidence: Evidence) -> Callable[[AtomSchema], bool | None]:
    """What facts and closed worlds say of ground atoms."""

    @cache
    def facts(name: str) -> dict[tuple[int, ...], bool]:
        found = evidence.facts[name]
        return dict(zip(map(tuple, found.arguments.tolist()), found.truth.tolist(), strict=True))

    def decide(schema: AtomSchema) -> bool | None:
        if any(isinstance(term, Var) for term in schema.arguments):
            return None
        key = tuple(term.id for term in schema.arguments if isinstance(term, Const))
        return facts(schema.predicate).get(key, False if evidence.predicates[schema.predicate].closed else None)

    return decide


def _groundings(
    formula: Formula, evidence: Evidence, decide: Callable[[AtomSchema], bool | None]
) -> Iterator[tuple[dict[str, str], Expression]]:
    """Each binding of the free variables (as text) with the expression over atom numbers."""
    present = {name: np.flatnonzero(p[0]).tolist() for name, p in evidence.present.items()}
    free, ranges = formula.free, [present[v.type] for v in formula.variables]
    n, n_cases = prod([len(ranges[v]) for v in free]), prod(map(len, ranges))
    if n > MOST_ROWS:
        raise QueryMistake(f"the formula has {n:,} groundings; at most {MOST_ROWS:,} can be asked for at once")
    if n_cases > MOST_CASES:
        message = (
            f"the quantifiers of the formula range over {n_cases:,} cases; at most {MOST_CASES:,} can be asked for"
        )
        raise QueryMistake(message, hint="put constants in place of variables, or make the formula a part of the model")
    for values in product(*(ranges[v] for v in free)):
        binding = dict(zip(free, values, strict=True))
        texts = {
            formula.variables[v].name: evidence.types[formula.variables[v].type].constants[c]
            for v, c in binding.items()
        }
        plain = without_quantifiers(formula, present, decide, Binding({v: Const(c) for v, c in binding.items()}))
        yield texts, _ground(plain, plain.body, binding, evidence)


def _ground(formula: Formula, expression: Expression, binding: dict[int, int], evidence: Evidence) -> Expression:
    def inside(e: Expression) -> Expression:
        return _ground(formula, e, binding, evidence)

    def value(term: Var | Const) -> int:
        return binding[term.index] if isinstance(term, Var) else term.id

    match expression:
        case AtomRef(index):
            schema = formula.atoms[index]
            arguments = np.array([[value(t) for t in schema.arguments]], np.int32).reshape(1, -1)
            return AtomRef(int(evidence.atom_number(schema.predicate, arguments)[0]))
        case Equal(left, right):
            return TRUE if value(left) == value(right) else FALSE
        case Not(operand):
            return Not(inside(operand))
        case All(operands):
            return All(tuple(map(inside, operands)))
        case Any(operands):
            return Any(tuple(map(inside, operands)))
        case Iff(left_side, right_side):
            return Iff(inside(left_side), inside(right_side))
        case Exists() | Count():
            raise AssertionError("quantifiers are written out before")
        case _:
            assert_never(expression)


def _text(formula: tree.Formula, binding: dict[str, str], model: Model) -> str:
    def change(term: tree.Term) -> tree.Term:
        if isinstance(term, tree.Variable) and term.name in binding:
            return tree.Constant(binding[term.name])
        return term

    return write_formula(map_terms(formula, change) if binding else formula, model.dialect)


def atom_numbers(expression: Expression) -> list[int]:
    """Numbers of the atoms of a ground expression."""
    return [part.index for part in parts_of(expression) if isinstance(part, AtomRef)]


def locate(network: Network, numbers: Int64) -> tuple[Int64, NDArray[np.bool_]]:
    """Index of each of some atoms in the network, -1 for known ones; and their truth."""
    index = np.searchsorted(network.atoms, numbers)
    inside = np.minimum(index, max(network.n_atoms - 1, 0))
    unknown = network.atoms[inside] == numbers if network.n_atoms else np.zeros(len(numbers), bool)
    truth = np.zeros(len(numbers), bool)
    truth[~unknown] = network.evidence.is_true(numbers[~unknown])
    return np.where(unknown, index, -1), truth
