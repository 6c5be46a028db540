"""Constants of which evidence, weights and formulas say the same: come in a group with separators, go out classes.

What formulas say of one constant becomes what they say of another by putting this one where the separator stands, all
else staying as it is. So two are alike if the facts, and the rows of weights, that have them there are the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from mlnlite.ground.network import Int64
from mlnlite.infer.exact.separators import Group, Separator, compared_with, places_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import Const, Var
from mlnlite.model.templates import Template

_DENSE = 1 << 23
"""Codes up to which a table of all of them is quicker than sorting."""

Axes = tuple[int, ...]
Kinds = tuple[Axes, Int64]
"""Some separators, and for all constants of these a number for what is known of them."""


@dataclass(frozen=True, slots=True)
class Alike:
    """Tuples of constants, one for each separator, in classes.

    Attributes:
        group: of formulas.
        separators: of the group.
        place: for each separator, shape (n_constants,), place of each constant of its type among those of the
            database, -1 for others.
        of: shape (n_tuples,), the class of each tuple; tuples are in mixed-radix order, the last constant fastest.
        first: shape (n_classes, n_separators), constants of the first tuple of each class.
        size: shape (n_classes,), how many tuples each has.
    """

    group: Group
    separators: tuple[Separator, ...]
    place: tuple[Int64, ...]
    of: Int64
    first: Int64
    size: Int64

    def moved(self, name: str, arguments: Int64) -> tuple[Int64, Int64]:
        """Atoms of an open predicate, of constants of the database, to what they are in the first tuple of their class.

        Args:
            name: of the predicate.
            arguments: shape (n, arity), constant ids.

        Returns:
            Shape (n,) the class, and shape (n, arity) the constant ids there.
        """
        columns = [arguments[:, s.at[name]] for s in self.separators]
        which = self.of[_raveled(columns, self.place)] if columns else np.zeros(len(arguments), np.int64)
        there = arguments.copy()
        for i, separator in enumerate(self.separators):
            there[:, separator.at[name]] = self.first[which, i]
        return which, there


def alike(group: Group, separators: Sequence[Separator], evidence: Evidence) -> Alike:
    """Classes of tuples of constants; without separators one of the empty tuple.

    Args:
        group: of formulas.
        separators: of the group.
        evidence: about one database.
    """
    present = [evidence.present[s.type][0] for s in separators]
    place = tuple(np.where(p, np.cumsum(p) - 1, -1) for p in present)
    shape = tuple(int(p.sum()) for p in present)
    code, n_codes = np.zeros(prod(shape), np.int64), 1
    for axes, kind in _kinds(group, separators, evidence, place):
        n_kinds = int(kind.max(initial=0)) + 1
        grid = kind.reshape([n if i in axes else 1 for i, n in enumerate(shape)])
        if n_kinds > 1:
            code = code * n_kinds + np.broadcast_to(grid, shape).ravel()
            code, n_codes = _packed(code, n_codes * n_kinds)
    _, first, of, size = np.unique(code, return_index=True, return_inverse=True, return_counts=True)
    constants = np.unravel_index(first, shape) if shape else ()
    ids = [np.flatnonzero(p)[c] for p, c in zip(present, constants, strict=True)]
    firsts = np.stack(ids, axis=1) if ids else np.zeros((1, 0), np.int64)
    return Alike(group, tuple(separators), place, of.ravel(), firsts, size)


def _packed(code: Int64, n_codes: int) -> tuple[Int64, int]:
    """Numbers below some bound as small numbers in the same order, and the bound of these."""
    if n_codes <= len(code):
        return code, n_codes
    if n_codes > _DENSE:
        found, small = np.unique(code, return_inverse=True)
        return small.ravel(), len(found)
    seen = np.zeros(n_codes, np.int64)
    seen[code] = 1
    return (np.cumsum(seen) - 1)[code], int(seen.sum())


def _raveled(columns: Iterable[Int64], place: Iterable[Int64]) -> Int64:
    """Tuples of constants as their numbers."""
    places = list(place)
    shape = tuple(int(p.max(initial=-1)) + 1 for p in places)
    return np.asarray(
        np.ravel_multi_index([p[c] for p, c in zip(places, columns, strict=True)], shape).astype(np.int64)
    )


def _kinds(
    group: Group, separators: Sequence[Separator], evidence: Evidence, place: Sequence[Int64]
) -> Iterator[Kinds]:
    """All that may tell constants apart."""
    for i, separator in enumerate(separators):
        kind = np.zeros(int(place[i].max(initial=-1)) + 1, np.int64)
        for number, constant in enumerate(sorted(_named(group, separator))):
            kind[place[i][constant]] = number + 1
        yield (i,), kind
    uses: dict[tuple[str, tuple[tuple[int, ...], ...]], None] = {}
    for number, template in enumerate(group.templates):
        for atom in template.formula.atoms:
            terms = [s.terms[number] for s in separators]
            uses[
                atom.predicate,
                tuple(
                    (s.at[atom.predicate],)
                    if atom.predicate in s.at
                    else places_of(atom, t, s.type, evidence.predicates)
                    if isinstance(t, Var)
                    else ()
                    for s, t in zip(separators, terms, strict=True)
                ),
            ] = None
        yield from _of_weights(template, terms, evidence, place)
    for name, places in uses:
        yield from _of_facts(name, places, evidence, place)


def _named(group: Group, separator: Separator) -> set[int]:
    """Constants that formulas name where the separator stands, or compare it with."""
    named: set[int] = set()
    for template, term in zip(group.templates, separator.terms, strict=True):
        named |= {term.id} if isinstance(term, Const) else compared_with(template, term) or set()
    return named


def _of_facts(
    name: str, places: Sequence[tuple[int, ...]], evidence: Evidence, place: Sequence[Int64]
) -> Iterator[Kinds]:
    """What facts of a predicate tell apart, if it has separators at some arguments."""
    axes = tuple(i for i, p in enumerate(places) if p)
    if not axes:
        return
    facts = evidence.facts[name]
    rows, truth = facts.arguments.astype(np.int64), facts.truth
    keep = truth if evidence.predicates[name].closed else np.ones(len(truth), np.bool_)
    for i in axes:
        keep = keep & (rows[:, places[i]] == rows[:, places[i][:1]]).all(axis=1)
    rest = np.delete(rows[keep], [p for i in axes for p in places[i]], axis=1)
    key = _raveled([rows[keep, places[i][0]] for i in axes], [place[i] for i in axes])
    yield axes, _set_numbers(key, [*rest.T, truth[keep].astype(np.int64)], [place[i] for i in axes])


def _of_weights(
    template: Template, terms: Sequence[Var | Const], evidence: Evidence, place: Sequence[Int64]
) -> Iterator[Kinds]:
    """What the weights of a formula tell apart, if it has one for each constant of separators."""
    column = {k: i for i, k in enumerate(template.keys)}
    axes = tuple(i for i, t in enumerate(terms) if isinstance(t, Var) and t.index in column)
    same = template.rows is None and len(template.weights) == 1 and not template.unique and template.number is None
    if not axes or same:
        return
    template = template.expanded(evidence.types)
    assert template.rows is not None
    mine = [column[t.index] for t in (terms[i] for i in axes) if isinstance(t, Var)]
    rows = template.rows.astype(np.int64)
    keep = np.all([place[i][rows[:, c]] >= 0 for i, c in zip(axes, mine, strict=True)], axis=0)
    _, weight = np.unique(template.weights[keep], return_inverse=True)
    key = _raveled(rows[keep][:, mine].T, [place[i] for i in axes])
    rest = np.delete(rows[keep], mine, axis=1)
    yield axes, _set_numbers(key, [*rest.T, weight.ravel()], [place[i] for i in axes])


def _set_numbers(key: Int64, columns: Sequence[Int64], place: Sequence[Int64]) -> Int64:
    """For each tuple a number of the set of rows that have it as key: 0 for none, equal ones for equal sets."""
    kind, n_kinds = np.zeros(len(key), np.int64), 1
    for column in columns:
        n = int(column.max(initial=0)) + 1
        kind, n_kinds = _packed(kind * n + column, n_kinds * n)
    order = np.lexsort((kind, key))
    key, kind = key[order], kind[order]
    start = np.flatnonzero(np.diff(key, prepend=-1))
    length = np.diff(start, append=len(key))
    found, last = np.zeros(prod(int(p.max(initial=-1)) + 1 for p in place), np.int64), 0
    for size in np.unique(length).tolist():
        mine = start[length == size]
        number = kind[mine]
        if size > 1:
            _, number = np.unique(kind[mine[:, None] + np.arange(size)], axis=0, return_inverse=True)
        found[key[mine]] = last + 1 + number.ravel()
        last = int(found.max())
    return found
