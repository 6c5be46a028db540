"""Reads the facts of evidence files into integer columns and checks them against a model."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, EvidenceMistake, did_you_mean, in_order
from mlnlite.model.coded import Coded, CodedTable
from mlnlite.model.derived import compared, verify_constants
from mlnlite.model.evidence import Evidence, Facts, SoftFacts
from mlnlite.model.model import Model
from mlnlite.model.soft import SoftColumns, soft_facts
from mlnlite.model.symbols import Predicate, Type
from mlnlite.source import Source, Span
from mlnlite.syntax.tree import EvidenceProgram, FactTable, SoftFact

MOST_MISTAKES = 50
"""Mistakes reported for one predicate of one file; more are counted."""


@dataclass(slots=True)
class _Columns:
    """Facts of one predicate, before they are sorted; `file` and `offset` say where each stands."""

    database: list[NDArray[np.int32]] = field(default_factory=list)
    arguments: list[NDArray[np.int32]] = field(default_factory=list)
    truth: list[NDArray[np.bool_]] = field(default_factory=list)
    file: list[NDArray[np.int32]] = field(default_factory=list)
    offset: list[NDArray[np.int64]] = field(default_factory=list)


@dataclass(slots=True)
class _Reading:
    predicates: Mapping[str, Predicate]
    types: dict[str, dict[str, int]]
    sources: list[Source]
    declared: list[tuple[int, int, str, list[int]]] = field(default_factory=list)
    columns: dict[str, _Columns] = field(default_factory=dict)
    soft: dict[str, SoftColumns] = field(default_factory=dict)
    cuts: dict[tuple[str, int], tuple[float, ...]] = field(default_factory=dict)
    mistakes: list[Diagnostic] = field(default_factory=list)

    def ids(self, type_name: str, column: Iterable[str]) -> NDArray[np.int32]:
        """Ids of constants, new ones for those not seen before."""
        index = self.types[type_name]
        try:
            return np.fromiter(map(index.__getitem__, column), np.int32)
        except KeyError:
            for name in column:
                index.setdefault(name, len(index))
            return np.fromiter(map(index.__getitem__, column), np.int32)


@dataclass(frozen=True, slots=True)
class TableFacts:
    """A table as a program of evidence: one database."""

    facts: tuple[CodedTable, ...]
    types: tuple[()] = ()
    n_databases: int = 1
    soft: tuple[()] = ()


def check_evidence(
    programs: Sequence[EvidenceProgram | TableFacts],
    sources: Sequence[Source],
    model: Model,
    *,
    together: bool = False,
) -> Evidence:
    """The evidence that files and tables mean.

    Args:
        programs: one for each file; all tables are about one world, the last of them.
        sources: their texts, for messages.
        model: what the facts are about.
        together: the files describe one world and have one database each; otherwise each database is a world.

    Raises:
        EvidenceMistake: with every mistake in all files.
    """
    types = {name: dict(t.index) for name, t in model.types.items()}
    reading = _Reading(model.predicates, types, list(sources))
    first = 0
    for file, program in enumerate(programs):
        if together and program.n_databases > 1:
            hint = "name the one you mean, or learn from them"
            message = f"{sources[file].name} has {program.n_databases} databases; together with others, each has one"
            reading.mistakes.append(Diagnostic("E310", message, hint=hint))
        _read_file(program, file, first, reading)
        first += 0 if together or isinstance(program, TableFacts) else program.n_databases
    tabled = any(isinstance(p, TableFacts) for p in programs)
    n_databases = 1 if together else first + tabled
    facts = {name: _sorted(name, reading) for name in model.predicates}
    result_types = {name: Type(name, tuple(index)) for name, index in reading.types.items()}
    reading.mistakes += verify_constants(model, result_types)
    if reading.mistakes:
        raise EvidenceMistake(in_order(reading.mistakes))
    present = _present(model, result_types, facts, n_databases, reading)
    facts |= compared(model, result_types, present)
    names = [
        f"{s.name}#{i + 1}"
        for s, p in zip(sources, programs, strict=True)
        if not isinstance(p, TableFacts)
        for i in range(p.n_databases)
    ]
    return Evidence(
        result_types,
        dict(model.predicates),
        facts,
        present,
        n_databases,
        ("evidence",) if together else (*names, *["tables"] * tabled),
        soft=_softened(reading, facts, model),
        cuts=reading.cuts,
    )


def _softened(reading: _Reading, facts: Mapping[str, Facts], model: Model) -> dict[str, SoftFacts]:
    """The soft facts.

    Raises:
        EvidenceMistake: about atoms that are certain, or predicates whose world is closed.
    """
    mistakes: list[Diagnostic] = []
    soft = {}
    for name, columns in reading.soft.items():
        place = [_fact_span(reading.sources[f], o) for f, o in columns.places]
        soft[name] = soft_facts(columns, model.predicates[name], facts[name], place, mistakes)
    if mistakes:
        raise EvidenceMistake(in_order(mistakes))
    return soft


def no_evidence(model: Model) -> Evidence:
    """Evidence in which nothing is known."""
    return check_evidence([EvidenceProgram((), (), 1)], [Source("<no evidence>", "")], model)


def closed(evidence: Evidence, predicates: Iterable[str]) -> Evidence:
    """The same evidence with closed worlds: an atom of these predicates that is not a fact is false."""
    names = set(predicates)
    for name in sorted(names - set(evidence.predicates)):
        hint = did_you_mean(name, list(evidence.predicates))
        raise EvidenceMistake([Diagnostic("E311", f"there is no predicate {name} to close the world of", hint=hint)])
    uncertain = sorted(names & set(evidence.soft))
    if uncertain:
        message = f"{uncertain[0]} has soft evidence or unknown facts, so its world cannot be closed"
        hint = "leave it open (`--open-world`); for learning, decide whether its facts are true"
        raise EvidenceMistake([Diagnostic("E315", message, hint=hint)])
    changed = {n: replace(p, closed=True) if n in names else p for n, p in evidence.predicates.items()}
    return replace(evidence, predicates=changed)


# --- one file


def _read_file(program: EvidenceProgram | TableFacts, file: int, first: int, reading: _Reading) -> None:
    for declaration in program.types:
        if declaration.name not in reading.types:
            hint = did_you_mean(declaration.name, list(reading.types))
            message = f"no predicate uses the type {declaration.name}"
            reading.mistakes.append(Diagnostic("E301", message, declaration.span, hint))
            continue
        ids = reading.ids(declaration.name, [c.name for c in declaration.constants])
        reading.declared.append((first, first + program.n_databases, declaration.name, ids.tolist()))
    for table in program.facts:
        _read_table(table, file, first, reading)
    for fact in program.soft:
        _read_soft(fact, file, first, reading)


def _predicate(name: str, arity: int, reading: _Reading) -> Predicate | tuple[str, str, str]:
    """The predicate of facts, or code, message and hint of what is wrong."""
    predicate = reading.predicates.get(name)
    if predicate is None or predicate.comparison:
        hint = did_you_mean(name, list(reading.predicates)) or "the model does not declare it"
        return "E302", f"the predicate {name} is not declared", hint
    if arity != predicate.arity:
        return "E303", f"{predicate.name} takes {predicate.arity}, found {arity}", f"it is declared as {predicate}"
    return predicate


def _read_soft(fact: SoftFact, file: int, first: int, reading: _Reading) -> None:
    predicate = _predicate(fact.predicate, len(fact.arguments), reading)
    if isinstance(predicate, tuple):
        code, message, hint = predicate
        reading.mistakes.append(Diagnostic(code, message, fact.span, hint))
        return
    ids = [int(reading.ids(t, [a])[0]) for t, a in zip(predicate.types, fact.arguments, strict=True)]
    weight = math.log(fact.probability / (1 - fact.probability))
    columns = reading.soft.setdefault(predicate.name, SoftColumns())
    columns.add([fact.database + first], [ids], [weight], [(file, fact.span.start if fact.span else 0)])


def _ids(type_name: str, column: list[str] | Coded, reading: _Reading) -> NDArray[np.int32]:
    if isinstance(column, Coded):
        return np.asarray(reading.ids(type_name, column.names)[column.codes], np.int32)
    return reading.ids(type_name, column)


def _read_table(table: FactTable | CodedTable, file: int, first: int, reading: _Reading) -> None:
    predicate = _predicate(table.predicate, len(table.columns), reading)
    if isinstance(predicate, tuple):
        if isinstance(table, FactTable):
            _each(table, file, *predicate, reading)
        return
    arguments = np.empty((len(table.truth), predicate.arity), np.int32)
    columns: Sequence[list[str] | Coded] = table.columns
    for i, (type_name, column) in enumerate(zip(predicate.types, columns, strict=True)):
        arguments[:, i] = _ids(type_name, column, reading)
    if isinstance(table, CodedTable):
        _mention(table, predicate, first, reading)
        if table.soft is not None:
            places = [(file, int(o)) for o in table.offset]
            soft = reading.soft.setdefault(predicate.name, SoftColumns())
            soft.add(table.database + first, arguments, table.soft, places)
            return
    known = reading.columns.setdefault(predicate.name, _Columns())
    known.database.append(np.asarray(table.database, np.int32) + np.int32(first))
    known.arguments.append(arguments)
    known.truth.append(np.asarray(table.truth, np.bool_))
    known.file.append(np.full(len(arguments), file, np.int32))
    known.offset.append(np.asarray(table.offset, np.int64))


def _mention(table: CodedTable, predicate: Predicate, first: int, reading: _Reading) -> None:
    """Notes the constants of all rows, those that say nothing included, and cut points."""
    for i, (type_name, column) in enumerate(zip(predicate.types, table.columns, strict=True)):
        ids = reading.ids(type_name, column.names)
        reading.declared.append((first, first + 1, type_name, ids.tolist()))
        if i in table.cuts:
            reading.cuts[predicate.name, i] = table.cuts[i]


def _each(table: FactTable, file: int, code: str, message: str, hint: str, reading: _Reading) -> None:
    """The same mistake for every fact of a table."""
    for offset in table.offset[:MOST_MISTAKES]:
        reading.mistakes.append(Diagnostic(code, message, _fact_span(reading.sources[file], offset), hint))
    more = len(table.offset) - MOST_MISTAKES
    if more > 0:
        reading.mistakes.append(Diagnostic(code, f"{message} ({more} more facts)"))


def _fact_span(source: Source, offset: int) -> Span:
    line, column = source.position(offset)
    text = source.line(line)
    return Span(source, offset, offset + max(1, len(text.rstrip()) - column + 1))


# --- one predicate


def _sorted(name: str, reading: _Reading) -> Facts:
    """All facts of a predicate in order, each once; contradictions become mistakes."""
    predicate = reading.predicates[name]
    columns = reading.columns.get(name)
    if columns is None:
        return Facts(np.empty(0, np.int32), np.empty((0, predicate.arity), np.int32), np.empty(0, np.bool_))
    database, arguments = np.concatenate(columns.database), np.concatenate(columns.arguments)
    order = np.lexsort((*reversed(arguments.T), database))
    database, arguments, truth = database[order], arguments[order], np.concatenate(columns.truth)[order]
    file, offset = np.concatenate(columns.file)[order], np.concatenate(columns.offset)[order]
    again = np.zeros(len(order), bool)
    again[1:] = (database[1:] == database[:-1]) & (arguments[1:] == arguments[:-1]).all(axis=1)
    for i in np.flatnonzero(again & (truth != np.roll(truth, 1)))[:MOST_MISTAKES]:
        _contradiction(predicate, reading.sources, file[i - 1 : i + 1], offset[i - 1 : i + 1], reading.mistakes)
    keep = ~again
    facts = Facts(database[keep], arguments[keep], truth[keep])
    if predicate.value is not None:
        _check_blocks(predicate, facts, (file[keep], offset[keep]), reading)
    return facts


def _contradiction(
    predicate: Predicate,
    sources: list[Source],
    file: NDArray[np.int32],
    offset: NDArray[np.int64],
    mistakes: list[Diagnostic],
) -> None:
    spans = [_fact_span(sources[f], int(o)) for f, o in zip(file, offset, strict=True)]
    first, second = sorted(spans, key=lambda s: (s.source.name, s.start))
    message = f"this fact about {predicate.name} contradicts the one at {first.place}"
    mistakes.append(Diagnostic("E304", message, second, "an atom is true or false; remove one of the two"))


def _check_blocks(
    predicate: Predicate, facts: Facts, where: tuple[NDArray[np.int32], NDArray[np.int64]], reading: _Reading
) -> None:
    """Two true values in one block of a functional predicate are a mistake."""
    true = np.flatnonzero(facts.truth)
    keys = np.column_stack([facts.database, facts.arguments[:, list(predicate.keys)]])[true]
    order = np.lexsort(tuple(reversed(keys.T)))
    keys, true = keys[order], true[order]
    twice = np.flatnonzero((keys[1:] == keys[:-1]).all(axis=1))
    for i in twice[:MOST_MISTAKES]:
        file, offset = (a[true[i : i + 2]] for a in where)
        spans = [_fact_span(reading.sources[f], int(o)) for f, o in zip(file, offset, strict=True)]
        first, second = sorted(spans, key=lambda s: (s.source.name, s.start))
        some = "exactly one value is" if predicate.marker == "!" else "at most one value can be"
        message = f"this is a second value; the first is at {first.place}"
        reading.mistakes.append(Diagnostic("E305", message, second, f"of {predicate}, {some} true"))


# --- constants


def _present(
    model: Model, types: Mapping[str, Type], facts: Mapping[str, Facts], n_databases: int, reading: _Reading
) -> dict[str, NDArray[np.bool_]]:
    present = {}
    with_weights = {t.formula.variables[k].type for t in model.templates for k in t.keys}
    for name, t in types.items():
        shared = len(t.constants) if name in with_weights else len(model.types[name].constants)
        present[name] = np.zeros((n_databases, len(t.constants)), np.bool_)
        present[name][:, :shared] = True
    for start, stop, name, ids in reading.declared:
        present[name][start:stop, ids] = True
    for predicate in model.predicates.values():
        table = facts[predicate.name]
        for i, name in enumerate(predicate.types):
            present[name][table.database, table.arguments[:, i]] = True
        if predicate.name in reading.soft:
            soft = reading.soft[predicate.name].facts()
            for i, name in enumerate(predicate.types):
                present[name][soft.database, soft.arguments[:, i]] = True
    return present
