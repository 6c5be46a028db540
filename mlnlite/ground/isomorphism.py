"""Isomorphic components: comes in a network with its components, goes out which of them are copies of which.

Colour refinement (Weisfeiler and Leman 1968) on all components at once: the colour of an atom is a hash of what stands
around it. Where colours leave a choice, one atom is given a colour of its own, as often as needed. Hashes only suggest
which atoms correspond; that the factors then are the same is checked factor by factor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.network import Clauses, Counts, Network, Tables

Bool = NDArray[np.bool_]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
UInt64 = NDArray[np.uint64]

MOST_CHOICES = 32
"""Atoms of one component that are told apart by choice; beyond that equal colours are taken as they come."""


@dataclass(frozen=True, slots=True)
class Copies:
    """Which components are the same but for the names of their atoms.

    Attributes:
        original: shape (n_components,), the first component that each is a copy of; its own number for an original.
        twin: shape (n_atoms,), the atom of the original that each atom corresponds to.
    """

    original: Int64
    twin: Int64

    @property
    def count(self) -> Int64:
        """Shape (n_components,): how many components have this one as their original, itself included."""
        return np.bincount(self.original, minlength=len(self.original))


@dataclass(frozen=True, slots=True)
class _Factors:
    """Factors that differ in their atoms, weights and multiplicities only.

    Attributes:
        atoms: shape (n, k).
        mark: shape (n, k), what tells the places of a factor apart; the order of places does not.
        weight: shape (n,), the log weight.
        count: shape (n,).
        hash: shape (n,), of all but the atoms.
    """

    atoms: Int64
    mark: Int64
    weight: NDArray[np.float64]
    count: Int64
    hash: UInt64


@dataclass(frozen=True, slots=True)
class _Parts:
    """Components that may be copies: their atoms, numbered anew, and their factors.

    Attributes:
        owner: shape (n,), component of each atom.
        variable: shape (n,).
        colour: shape (n,), a first one.
        factors: kind by kind.
    """

    owner: Int64
    variable: Int64
    colour: UInt64
    factors: tuple[_Factors, ...]

    def pick(self, atoms: Bool) -> _Parts:
        """Some of the components, given by their atoms."""
        place = np.cumsum(atoms) - 1
        kept = []
        for f in self.factors:
            rows = atoms[f.atoms[:, 0]]
            if not rows.any():
                continue
            kept.append(_Factors(place[f.atoms[rows]], f.mark[rows], f.weight[rows], f.count[rows], f.hash[rows]))
        return _Parts(self.owner[atoms], self.variable[atoms], self.colour[atoms], tuple(kept))


def copies(network: Network, component: Int32) -> Copies:
    """Finds components that are isomorphic, weights, hardness and multiplicities included.

    Components that differ are never taken for copies. Copies may be missed where atoms have equal colours but do not
    correspond, as in regular graphs.

    Args:
        network: any.
        component: shape (n_variables,), component of each variable, from 0 on.
    """
    n = int(component.max(initial=-1)) + 1
    original, twin = np.arange(n), np.arange(network.n_atoms)
    parts = _parts(network, component)
    chosen = np.flatnonzero(_repeated(_sums(parts.owner, parts.colour, n) + _factor_sums(parts, n))[parts.owner])
    if not len(chosen):
        return Copies(original, twin)
    mask = np.zeros(network.n_atoms, np.bool_)
    mask[chosen] = True
    parts = parts.pick(mask)
    colour = _told_apart(parts)
    order = np.lexsort((colour, parts.owner))
    first = np.searchsorted(parts.owner[order], np.arange(n))
    suggested = _first_equal(_sums(parts.owner, colour, n))
    place = first[suggested[parts.owner[order]]] + np.arange(len(order)) - first[parts.owner[order]]
    image = np.empty(len(order), np.int64)
    image[order] = order[np.minimum(place, len(order) - 1)]
    same = _confirmed(network, parts, suggested, image, chosen)
    original = np.where(same, suggested, original)
    moved = same[parts.owner]
    twin[chosen[moved]] = chosen[image[moved]]
    return Copies(original, twin)


def _parts(network: Network, component: Int32) -> _Parts:
    """All components, with what each atom is by itself as its colour."""
    variable = network.variable.astype(np.int64)
    colour = _hash(network.cardinality[variable].astype(np.uint64), network.block[variable].astype(np.uint64))
    gathered: dict[tuple[object, ...], list[_Factors]] = {}
    for key, factors in _kinds(network):
        gathered.setdefault(key, []).append(factors)
    merged = tuple(
        _Factors(*(np.concatenate([getattr(f, name) for f in same]) for name in _Factors.__slots__))
        for same in gathered.values()
    )
    return _Parts(component[variable].astype(np.int64), variable, colour, merged)


def _kinds(network: Network) -> Iterator[tuple[tuple[object, ...], _Factors]]:
    """The factors with atoms, each block with what must be equal for its factors to be equal."""
    blocks: list[tuple[tuple[object, ...], Int32, Int32, Clauses | Tables | Counts]] = []
    for c in network.clauses:
        blocks.append((("clause", c.literals.shape[1], c.negated), np.abs(c.literals) - 1, np.sign(c.literals), c))
    for t in network.tables:
        marks = np.broadcast_to(np.arange(t.atoms.shape[1], dtype=np.int32), t.atoms.shape)
        blocks.append((("table", t.truth.shape, t.truth.tobytes()), t.atoms, marks, t))
    for n in network.counts:
        blocks.append(
            (("count", n.true.tobytes(), n.steps.tobytes()), np.abs(n.literals) - 1, np.sign(n.literals) * n.steps, n)
        )
    for key, atoms, marks, block in blocks:
        if atoms.shape[1] and len(atoms):
            weight = network.weights[block.weight] + 0.0
            hashed = _hash(_hash(weight.view(np.uint64), block.count.astype(np.uint64)), _number(hash(key)))
            yield key, _Factors(atoms.astype(np.int64), marks.astype(np.int64), weight, block.count, hashed)


# --- colours


def _number(number: int) -> UInt64:
    return np.array(number & (2**64 - 1), np.uint64)


def _hash(a: UInt64, b: UInt64) -> UInt64:
    """A number that looks random for each pair (SplitMix64: Steele, Lea and Flood 2014)."""
    z = np.asarray(a * np.uint64(0x9E3779B97F4A7C15) + b)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB), (31, 1)):
        z ^= z >> np.uint64(shift)
        z *= np.uint64(factor)
    return z


def _sums(owner: Int64, values: UInt64, n: int) -> UInt64:
    """Sums over the owners of hashes of values, shape (n,)."""
    sums = np.zeros(n, np.uint64)
    np.add.at(sums, owner, _hash(values, _number(1)))
    return sums


def _factor_sums(parts: _Parts, n: int) -> UInt64:
    sums = np.zeros(n, np.uint64)
    for f in parts.factors:
        np.add.at(sums, parts.owner[f.atoms[:, 0]], f.hash)
    return sums


def _repeated(values: UInt64) -> Bool:
    """Which of some values are there more than once."""
    _, index, times = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray(times[index] > 1)


def _first_equal(values: UInt64) -> Int64:
    """For each of some values the index of the first that is equal."""
    _, first, index = np.unique(values, return_index=True, return_inverse=True)
    return np.asarray(first[index])


def _told_apart(parts: _Parts) -> UInt64:
    """Colours of which no component has two equal ones, if that can be had with few choices."""
    colour = _refined(parts)
    left, index = parts, np.arange(len(colour))
    for _ in range(MOST_CHOICES):
        now = colour[index]
        order = np.lexsort((now, left.owner))
        tied = (now[order][1:] == now[order][:-1]) & (left.owner[order][1:] == left.owner[order][:-1])
        owners, first = np.unique(left.owner[order][:-1][tied], return_index=True)
        if not len(owners):
            break
        picked = order[:-1][tied][first]
        now[picked] = _hash(now[picked], _number(2))
        stay = np.isin(left.owner, owners)
        left, index = _Parts(left.owner, left.variable, now, left.factors).pick(stay), index[stay]
        colour[index] = _refined(left)
    return colour


def _refined(parts: _Parts) -> UInt64:
    """Colours that tell apart what different surroundings have, as far as repetition goes."""
    colour, n_colours = parts.colour, 0
    _, variable = np.unique(parts.variable, return_inverse=True)
    while (n := len(np.unique(colour))) > n_colours:
        n_colours = n
        around = _sums(variable, colour, len(variable))[variable]
        for f in parts.factors:
            place = _hash(colour[f.atoms], f.mark.astype(np.uint64))
            whole = _hash(place.sum(axis=1, dtype=np.uint64), f.hash)
            np.add.at(around, f.atoms, _hash(place, whole[:, None]))
        colour = _hash(colour, around)
    return colour


# --- proof


def _confirmed(network: Network, parts: _Parts, suggested: Int64, image: Int64, chosen: Int64) -> Bool:
    """Shape (n_components,): for which the images of its atoms make it the suggested one.

    Args:
        network: of the components.
        parts: those that may be copies.
        suggested: shape (n_components,), of which each may be a copy.
        image: shape (n,), for each atom of `parts` one of `parts`.
        chosen: shape (n,), index in the network of each atom of `parts`.
    """
    n = len(suggested)
    size = np.bincount(parts.owner, minlength=n)
    same: Bool = (size > 0) & (size == size[suggested])
    same[parts.owner[parts.owner[image] != suggested[parts.owner]]] = False
    variable = network.variable[chosen]
    n_atoms = np.bincount(network.variable, minlength=network.n_variables)
    _, first, index = np.unique(variable, return_index=True, return_inverse=True)
    other = variable[image]
    fits = other == other[first[index]]
    for feature in (network.cardinality, network.block, n_atoms):
        fits &= feature[variable] == feature[other]
    same[parts.owner[~fits]] = False
    for f in parts.factors:
        same &= _equal_factors(f, parts.owner, suggested, image)
    return same


def _equal_factors(f: _Factors, owner: Int64, suggested: Int64, image: Int64) -> Bool:
    """For which components the factors of one kind are those of the suggested one."""
    component = owner[f.atoms[:, 0]]
    low = int(f.mark.min())
    span = int(f.mark.max()) - low + 1
    places = np.sort(image[f.atoms] * span + f.mark - low, axis=1)
    order = np.lexsort((f.count, f.weight, *places.T, component))
    n_rows = np.bincount(component, minlength=len(suggested))
    first = np.concatenate([[0], np.cumsum(n_rows)])
    same: Bool = n_rows == n_rows[suggested]
    mine = np.flatnonzero(same[component[order]])
    who = component[order[mine]]
    other = order[first[suggested[who]] + mine - first[who]]
    rows = order[mine]
    equal = (f.weight[rows] == f.weight[other]) & (f.count[rows] == f.count[other])
    equal &= (places[rows] == places[other]).all(axis=1)
    same[who[~equal]] = False
    return same
