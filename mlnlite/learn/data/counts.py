"""Counting joins: for each atom, how many groundings of each template row become true or false when it does.

No grounding is listed. For each conjunction of a formula, and each of its literals, a join of the *other* literals with
the data gives the bindings in which that literal decides, and a count gathers them by atom and row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.memory import machine_memory
from mlnlite.engines.plan import Count, Plan, Run
from mlnlite.errors import Contradiction, Diagnostic, LimitReached
from mlnlite.ground.compile import Source, bindings, with_number
from mlnlite.ground.ground import source_of
from mlnlite.learn.data.separate import Case, cases
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import AtomRef, AtomSchema, Equal, Formula
from mlnlite.model.propositional import Proposition, cubes
from mlnlite.model.read import some_databases
from mlnlite.model.symbols import Predicate
from mlnlite.model.templates import Template

Int64 = NDArray[np.int64]

ENTRY = 200
"""Bytes that an entry takes while entries are gathered (measured)."""

DENSE = 4
"""Sums are kept in a table if it has at most this many times as many places as there are entries."""


@dataclass(frozen=True, slots=True)
class Entries:
    """`change` groundings of weight `weight` become true when atom `atom` of `database` does (fewer if negative).

    For an atom of a functional predicate, the change is against its block having no value. Entries that agree in
    database, atom and weight add up. All arrays have shape (n,).
    """

    database: Int64
    atom: Int64
    weight: Int64
    change: Int64


Load = Callable[[Evidence], Run]
"""Makes the tables of evidence and of the templates' rows ready for plans."""


def entries(
    templates: Mapping[int, Template], first: Int64, evidence: Evidence, load: Load, targets: frozenset[str]
) -> dict[str, list[Entries]]:
    """The entries of templates for the atoms of each target predicate, in parts.

    Args:
        templates: expanded, by number.
        first: index of the first weight of every template.
        evidence: complete: every atom that is not a fact is false.
        load: as said there.
        targets: predicates whose atoms are counted for.

    Raises:
        Contradiction: if the data violate a hard formula.
    """
    found: dict[str, list[Entries]] = {name: [] for name in targets}
    n = 0
    loaded: dict[bytes, tuple[Evidence, Run]] = {}
    for i, template in templates.items():
        for databases in _alike(template, evidence):
            if databases.tobytes() not in loaded:
                part = evidence if len(databases) == evidence.n_databases else some_databases(evidence, databases)
                loaded[databases.tobytes()] = part, load(part)
            part, run = loaded[databases.tobytes()]
            source = source_of(i, template, part, "database" if part.n_databases > 1 else None)
            if template.hard:
                _verify_holds(template, source, run)
            for sign, case in _cases(source):
                for target, (schema, _) in enumerate(case.literals):
                    if schema.predicate in targets:
                        with _named(template, schema.predicate):
                            counted = _counted(source, case, target, sign, int(first[i]), run)
                            n += sum(len(e.atom) for e in counted)
                            _verify_memory(n)
                        found[schema.predicate] += [replace(e, database=databases[e.database]) for e in counted]
    return found


@contextmanager
def _named(template: Template, target: str) -> Iterator[None]:
    """Says of which formula it was that a limit was reached, and what would help."""
    try:
        yield
    except LimitReached as error:
        message = f"{template.name} touches too many atoms of {target}: {error.diagnostics[0].message}"
        hint = f"if {target} is evidence only, say what is to be predicted (`predict`, `--predict`)"
        raise LimitReached([Diagnostic("E410", message, template.span, hint)]) from error


def _verify_memory(n_entries: int) -> None:
    memory = machine_memory()
    if memory is not None and n_entries * ENTRY > memory:
        raise LimitReached(f"{n_entries:,} counts take more memory than there is")


def _verify_holds(template: Template, source: Source, run: Run) -> None:
    for cube in cubes(source.formula.body, False):
        if run(Count(bindings(source, cube, source.formula.free), ()))["count"].any():
            raise violated(template)


def violated(template: Template) -> Contradiction:
    """What to say if the data violate a hard formula."""
    message = f"the data violate {template.name}, which is hard: {template.text}"
    return Contradiction([Diagnostic("E404", message, template.span, "give it a weight, or mend the data")])


def _alike(template: Template, evidence: Evidence) -> list[Int64]:
    """Databases in groups that have the same constants where the formula has quantifiers."""
    types = sorted({v.type for v in template.formula.variables if v.bound})
    present = np.concatenate([np.zeros((evidence.n_databases, 0)), *(evidence.present[t] for t in types)], axis=1)
    _, group = np.unique(present, axis=0, return_inverse=True)
    group = group.ravel()
    return [np.flatnonzero(group == g) for g in range(group.max(initial=-1) + 1)]


def _cases(source: Source) -> Iterator[tuple[int, Case]]:
    """The conjunctions whose sum, with these signs, is the formula's number of true groundings, but for a constant."""
    false, true = cubes(source.formula.body, False), cubes(source.formula.body, True)
    sign, chosen = (1, true) if len(true) < len(false) else (-1, false)
    for cube in chosen:
        for case in cases(source.formula, cube, source.evidence.predicates):
            yield sign, case


def _counted(source: Source, case: Case, target: int, sign: int, first: int, run: Run) -> list[Entries]:
    schema, truth = case.literals[target]
    predicate = source.evidence.predicates[schema.predicate]
    others = _others(case, target, predicate)
    if others is None:
        return []
    plan = _plan(source, case, others, schema)
    rows = {name: column.astype(np.int64, copy=False) for name, column in run(plan).items()}
    weight = rows["row"] + first if source.tabled else np.full(len(rows["count"]), first, np.int64)
    change = rows["count"] * (sign if truth else -sign)
    database = rows["database"] if source.world else np.zeros(len(change), np.int64)
    return [Entries(database, rows["atom"], weight, change)]


def _others(case: Case, target: int, predicate: Predicate) -> list[tuple[AtomSchema, bool]] | None:
    """The literals that must hold for the target to decide; None if they cannot.

    While the target's block has no value, its other atoms are false: negative literals hold, positive ones do not.
    """
    schema, _ = case.literals[target]
    others = []
    for i, (other, sign) in enumerate(case.literals):
        if i == target:
            continue
        in_block = (
            predicate.value is not None
            and other.predicate == predicate.name
            and all(other.arguments[k] == schema.arguments[k] for k in predicate.keys)
        )
        if in_block and sign:
            return None
        if not in_block:
            others.append((other, sign))
    return others


def _plan(source: Source, case: Case, others: list[tuple[AtomSchema, bool]], target: AtomSchema) -> Plan:
    schemas = tuple(schema for schema, _ in others)
    formula: Formula = replace(source.formula, atoms=schemas)
    cube: dict[Proposition, bool] = {AtomRef(i): sign for i, (_, sign) in enumerate(others)}
    cube |= dict.fromkeys(case.different, False)
    cube |= {Equal(variable, by): True for variable, by in case.same}
    plan = bindings(replace(source, formula=formula), cube, source.formula.free)
    plan = with_number(plan, source.evidence, target, "atom", source.evidence.first_atom())
    by = (*((source.world,) if source.world else ()), *(("row",) if source.tabled else ()), "atom")
    return Count(plan, by)


def joined(parts: list[Entries], n_weights: int) -> Entries:
    """All entries of a predicate in order, those of one atom and weight added up."""
    if not parts:
        empty = np.empty(0, np.int64)
        return Entries(empty, empty, empty, empty)
    low = min((int(p.atom.min()) for p in parts if len(p.atom)), default=0)
    width = max(int(p.atom.max(initial=low)) for p in parts) - low + 1
    size = (max(int(p.database.max(initial=0)) for p in parts) + 1) * width * n_weights
    if size >= 2**62:
        return _sorted(parts)
    keys = [(p.database * width + (p.atom - low)) * n_weights + p.weight for p in parts]
    key, total = _added(keys, [p.change for p in parts], size)
    unit, weight = np.divmod(key, n_weights)
    database, atom = np.divmod(unit, width)
    return Entries(database, atom + low, weight, total)


def _added(keys: list[Int64], changes: list[Int64], size: int) -> tuple[Int64, Int64]:
    """Sums by key that are not zero, in order of keys. By a table where that is not much larger than the list."""
    if size <= DENSE * sum(map(len, keys)) + 1000:
        sums = np.zeros(size, np.int64)
        for key, change in zip(keys, changes, strict=True):
            np.add.at(sums, key, change)
        found = np.flatnonzero(sums)
        return found, sums[found]
    key, change = np.concatenate(keys), np.concatenate(changes)
    order = np.argsort(key)
    key, change = key[order], change[order]
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    total = np.add.reduceat(change, starts)
    keep = total != 0
    return key[starts][keep], total[keep]


def _sorted(parts: list[Entries]) -> Entries:
    """The same for keys that do not fit into 64 bits."""
    database, atom, weight, change = (
        np.concatenate([getattr(p, name) for p in parts]) for name in ("database", "atom", "weight", "change")
    )
    order = np.lexsort((weight, atom, database))
    database, atom, weight, change = (a[order] for a in (database, atom, weight, change))
    new = np.ones(len(order), bool)
    new[1:] = (database[1:] != database[:-1]) | (atom[1:] != atom[:-1]) | (weight[1:] != weight[:-1])
    starts = np.flatnonzero(new)
    total = np.add.reduceat(change, starts)
    keep = total != 0
    return Entries(database[starts][keep], atom[starts][keep], weight[starts][keep], total[keep])
