"""What a database does not say: atoms marked `?`. Comes in a database, goes out one in which just these are open."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, EvidenceMistake, LimitReached
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.facts import closed
from mlnlite.model.model import Model
from mlnlite.model.symbols import Predicate

Int64 = NDArray[np.int64]
Marks = Mapping[str, Int64]
"""Numbers of the atoms marked `?`, rising, by predicate."""

MOST_ATOMS = 10_000_000
"""Atoms of a predicate up to which single ones can be left open: all others become facts."""


def has_marks(evidence: Evidence) -> bool:
    """Whether some atom is marked.

    Raises:
        EvidenceMistake: if a fact has a probability, which learning cannot use.
    """
    for name, soft in evidence.soft.items():
        if soft.weight.any():
            first = int(np.flatnonzero(soft.weight)[0])
            atom = evidence.atom_text(int(evidence.atom_number(name, soft.arguments[[first]])[0]))
            message = f"{atom} has a probability in {evidence.names[soft.database[first]]}"
            hint = "learning needs facts that are true, false, or unknown: mark it `?`"
            raise EvidenceMistake([Diagnostic("E321", message, hint=hint)])
    return bool(evidence.soft)


def is_incomplete(model: Model, evidence: Evidence, targets: Collection[str]) -> bool:
    """Whether some atom that matters is unknown: one is marked, or a condition `P(x, y!)` has no value somewhere.

    Raises:
        EvidenceMistake: if a fact has a probability.
    """
    used = {atom.predicate for t in model.templates for atom in t.formula.atoms}
    given = [p for p in evidence.predicates.values() if p.marker == "!" and p.name in used and p.name not in targets]
    return has_marks(evidence) or any(_lacks_values(p, evidence) for p in given)


def _lacks_values(predicate: Predicate, evidence: Evidence) -> bool:
    sizes = [evidence.present[predicate.types[k]].sum(axis=1) for k in predicate.keys]
    n_blocks = np.prod([np.ones(evidence.n_databases), *sizes], axis=0)
    facts = evidence.facts[predicate.name]
    return bool((np.bincount(facts.database[facts.truth], minlength=evidence.n_databases) < n_blocks).any())


def marks_of(data: Evidence) -> tuple[Evidence, Marks]:
    """One database without its marks, and the marks."""
    found = {name: np.unique(data.atom_number(name, soft.arguments)) for name, soft in data.soft.items()}
    return replace(data, soft={}), found


def closed_but(data: Evidence, names: Collection[str], marks: Marks) -> Evidence:
    """One database in which the worlds of some predicates are closed but for marked atoms.

    A block with marks has one of the marked values (or none, if it may). Predicates `P(x, y!)` stay open where no
    value is known, as some value is true.

    Raises:
        LimitReached: if single atoms of a very large predicate are marked.
    """
    facts = dict(data.facts)
    for name in marks:
        if name in names:
            facts[name] = _with_false(data, data.predicates[name], marks[name])
    whole = [n for n in names if n not in marks and data.predicates[n].marker != "!"]
    return closed(replace(data, facts=facts), whole)


def _with_false(data: Evidence, predicate: Predicate, marks: Int64) -> Facts:
    """The facts about a predicate, and that its atoms are false that are neither facts nor marked."""
    if prod(int(data.present[t].sum()) for t in predicate.types) > MOST_ATOMS:
        hint = f"leave the whole predicate open (`--open {predicate.name}`), or learn without its marks"
        raise LimitReached(f"{predicate.name} has too many atoms for single ones to be left open", hint)
    grid = every_atom(data, predicate)
    table = data.facts[predicate.name]
    atoms, known = data.atom_number(predicate.name, grid), data.atom_number(predicate.name, table.arguments)
    false = ~np.isin(atoms, known) & ~np.isin(atoms, marks)
    if predicate.marker == "!":
        block = blocks_of(data, predicate, atoms)
        false &= np.isin(block, block[np.isin(atoms, marks)])
    every = np.concatenate([table.arguments, grid[false]])
    order = np.argsort(np.concatenate([known, atoms[false]]), kind="stable")
    truth = np.concatenate([table.truth, np.zeros(int(false.sum()), np.bool_)])
    return Facts(np.zeros(len(every), np.int32), every[order], truth[order])


def every_atom(data: Evidence, predicate: Predicate) -> NDArray[np.int32]:
    """The arguments of all atoms of a predicate in one database, shape (n_atoms, arity), in order."""
    present = [np.flatnonzero(data.present[t][0]) for t in predicate.types]
    n_atoms = prod(map(len, present))
    places = np.unravel_index(np.arange(n_atoms), [len(p) for p in present]) if present else ()
    columns = [p[at] for p, at in zip(present, places, strict=True)]
    return np.array(columns, np.int32).reshape(predicate.arity, n_atoms).T


def blocks_of(data: Evidence, predicate: Predicate, atoms: Int64) -> Int64:
    """For each atom of a predicate a number that it shares with its block; atoms of no block have their own."""
    if predicate.value is None:
        return atoms
    sizes = data.sizes(predicate.name)
    stride = prod(sizes[predicate.value + 1 :])
    within = atoms - data.first_atom()[predicate.name]
    return np.asarray(atoms - within // stride % sizes[predicate.value] * stride)
