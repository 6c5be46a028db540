"""Reads the facts of evidence files into integer columns and checks them against a model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, EvidenceMistake, did_you_mean, in_order
from mlnlite.model.constants import Numbering, blocks
from mlnlite.model.coverage import same_number
from mlnlite.model.derived import compared, verify_constants
from mlnlite.model.evidence import Evidence, Facts, SoftFacts
from mlnlite.model.model import Model
from mlnlite.model.order import Part, ordered
from mlnlite.model.soft import SoftColumns, place, soft_mistakes
from mlnlite.model.symbols import Predicate, Type
from mlnlite.source import Source, Span
from mlnlite.syntax.facts import EvidenceProgram, FactTable

MOST_MISTAKES = 50
"""Mistakes reported for one predicate of one file; more are counted."""


@dataclass(slots=True)
class _Columns:
    """Facts of one predicate, before they are sorted; `file` and `offset` say where each stands."""

    parts: list[Part] = field(default_factory=list)
    file: list[int] = field(default_factory=list)
    offset: list[NDArray[np.integer]] = field(default_factory=list)


@dataclass(slots=True)
class _Reading:
    """What is known so far."""

    predicates: Mapping[str, Predicate]
    types: dict[str, Numbering]
    sources: list[Source] = field(default_factory=list)
    declared: list[tuple[int, int, str, Sequence[int]]] = field(default_factory=list)
    columns: dict[str, _Columns] = field(default_factory=dict)
    soft: dict[str, SoftColumns] = field(default_factory=dict)
    cuts: dict[tuple[str, int], tuple[float, ...]] = field(default_factory=dict)
    mistakes: list[Diagnostic] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class TableFacts:
    """A table as a program of evidence: one database.

    Attributes:
        facts: what its rows say about a predicate; what is certain and what is not stand apart.
        constants: for each argument those of the rows that say nothing.
        cuts: for each argument its cut points, if it was divided into bins.
    """

    facts: tuple[FactTable, ...]
    constants: tuple[Sequence[str], ...]
    cuts: Mapping[int, tuple[float, ...]] = field(default_factory=dict)

    types: ClassVar[tuple[()]] = ()
    n_databases: ClassVar[int] = 1


def check_evidence(
    programs: Sequence[EvidenceProgram | TableFacts], model: Model, *, together: bool = False
) -> Evidence:
    """The evidence that files and tables mean.

    Args:
        programs: one for each file; all tables are about one world, the last of them.
        model: what the facts are about.
        together: the files describe one world and have one database each; otherwise each database is a world.

    Raises:
        EvidenceMistake: with every mistake in all files.
    """
    reading = _Reading(model.predicates, {name: Numbering(list(t.constants)) for name, t in model.types.items()})
    first = 0
    for program in programs:
        if together and program.n_databases > 1:
            hint = "name the one you mean, or learn from them"
            message = f"{_name(program)} has {program.n_databases} databases; together with others, each has one"
            reading.mistakes.append(Diagnostic("E310", message, hint=hint))
        _read_file(program, first, reading)
        first += 0 if together or isinstance(program, TableFacts) else program.n_databases
    tabled = any(isinstance(p, TableFacts) for p in programs)
    n_databases = 1 if together else first + tabled
    facts = {name: _sorted(name, reading) for name in model.predicates}
    result_types = {name: Type(name, tuple(numbering.names)) for name, numbering in reading.types.items()}
    reading.mistakes += verify_constants(model, result_types)
    if reading.mistakes:
        raise EvidenceMistake(in_order(reading.mistakes))
    present = _present(model, result_types, facts, n_databases, reading)
    facts |= compared(model, result_types, present)
    names = [f"{_name(p)}#{i + 1}" for p in programs if not isinstance(p, TableFacts) for i in range(p.n_databases)]
    return Evidence(
        result_types,
        dict(model.predicates),
        facts,
        present,
        n_databases,
        ("evidence",) if together else (*names, *["tables"] * tabled),
        warnings=tuple(_two_names(reading, result_types)),
        soft=_softened(reading, facts, model),
        cuts=reading.cuts,
    )


def _two_names(reading: _Reading, types: Mapping[str, Type]) -> Iterator[Diagnostic]:
    """A warning for each type of which two constants name the same number."""
    for name, t in types.items():
        pair = same_number(t.constants)
        if pair is None:
            continue
        first, second = (t.constants[i] for i in pair)
        message = f"{first} and {second} are different constants of the type {name}, though the same number"
        hint = "constants are names; write a number the same way everywhere"
        yield Diagnostic("W313", message, _mention_of(pair[1], name, reading), hint, severity="warning")


def _mention_of(constant: int, type_name: str, reading: _Reading) -> Span | None:
    """The first fact in which a constant stands, if it stands in one that is certain."""
    for name, columns in reading.columns.items():
        arguments = np.concatenate([part.arguments() for part in columns.parts])
        for i, t in enumerate(reading.predicates[name].types):
            rows = np.flatnonzero(arguments[:, i] == constant)
            if t == type_name and len(rows):
                file, offset = place(columns, int(rows[0]))
                return _fact_span(reading.sources[file], offset)
    return None


def _name(program: EvidenceProgram | TableFacts) -> str:
    """The file of a program."""
    if isinstance(program, TableFacts):
        return program.facts[0].source.name
    return program.span.source.name if program.span else "<no evidence>"


def _softened(reading: _Reading, facts: Mapping[str, Facts], model: Model) -> dict[str, SoftFacts]:
    """The soft facts.

    Raises:
        EvidenceMistake: about atoms that are certain, or predicates whose world is closed.
    """
    mistakes: list[Diagnostic] = []
    soft = {}
    for name, columns in reading.soft.items():
        soft[name] = columns.facts()
        for i, code, message, hint in soft_mistakes(soft[name], model.predicates[name], facts[name]):
            file, offset = place(columns, i)
            mistakes.append(Diagnostic(code, message, _fact_span(reading.sources[file], offset), hint))
    if mistakes:
        raise EvidenceMistake(in_order(mistakes))
    return soft


def no_evidence(model: Model) -> Evidence:
    """Evidence in which nothing is known."""
    return check_evidence([EvidenceProgram((), (), 1)], model)


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


def _read_file(program: EvidenceProgram | TableFacts, first: int, reading: _Reading) -> None:
    for declaration in program.types:
        if declaration.name not in reading.types:
            hint = did_you_mean(declaration.name, list(reading.types))
            message = f"no predicate uses the type {declaration.name}"
            reading.mistakes.append(Diagnostic("E301", message, declaration.span, hint, expected="a type of the model"))
            continue
        ids = reading.types[declaration.name].ids([c.name for c in declaration.constants])
        reading.declared.append((first, first + program.n_databases, declaration.name, ids))
    for table in program.facts:
        _read_table(table, first, reading)
    if isinstance(program, TableFacts):
        _mention(program, first, reading)


def _predicate(name: str, arity: int, reading: _Reading) -> Predicate | tuple[str, str, str]:
    """The predicate of facts, or code, message and hint of what is wrong."""
    predicate = reading.predicates.get(name)
    if predicate is None or predicate.comparison:
        hint = did_you_mean(name, list(reading.predicates)) or "the model does not declare it"
        return "E302", f"the predicate {name} is not declared", hint
    if arity != predicate.arity:
        return "E303", f"{predicate.name} takes {predicate.arity}, found {arity}", f"it is declared as {predicate}"
    return predicate


def _read_table(table: FactTable, first: int, reading: _Reading) -> None:
    predicate = _predicate(table.predicate, len(table.columns), reading)
    if isinstance(predicate, tuple):
        _each(table, *predicate, reading)
        return
    ids = tuple(reading.types[t].ids_of(column) for t, column in zip(predicate.types, table.columns, strict=True))
    file, database = len(reading.sources), table.database + np.int32(first) if first else table.database
    reading.sources.append(table.source)
    part = Part(database, tuple(column.codes for column in table.columns), ids, table.truth)
    if table.weight is not None:
        soft = reading.soft.setdefault(predicate.name, SoftColumns())
        soft.add(database, part.arguments(), table.weight, file, table.offset)
        return
    known = reading.columns.setdefault(predicate.name, _Columns())
    known.parts.append(part)
    known.file.append(file)
    known.offset.append(table.offset)


def _mention(program: TableFacts, first: int, reading: _Reading) -> None:
    """Notes the constants of the rows of a table that say nothing, and cut points."""
    predicate = reading.predicates[program.facts[0].predicate]
    for type_name, names in zip(predicate.types, program.constants, strict=True):
        reading.declared.append((first, first + 1, type_name, reading.types[type_name].ids(names)))
    reading.cuts.update({(predicate.name, i): points for i, points in program.cuts.items()})


def _each(table: FactTable, code: str, message: str, hint: str, reading: _Reading) -> None:
    """The same mistake for every fact of a table."""
    declared = reading.predicates.get(table.predicate)
    expected = str(declared) if declared and not declared.comparison else "a predicate of the model"
    for offset in table.offset[:MOST_MISTAKES].tolist():
        span = _fact_span(table.source, offset)
        reading.mistakes.append(Diagnostic(code, message, span, hint, expected=expected))
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
    facts, again, order = ordered(columns.parts, [len(reading.types[t].names) for t in predicate.types])
    where = _Places(columns, order)
    for i in np.flatnonzero(again & (facts.truth != np.roll(facts.truth, 1)))[:MOST_MISTAKES].tolist():
        first, second = where.spans([i - 1, i], reading.sources)
        message = f"this fact about {predicate.name} contradicts the one at {first.place}"
        hint = "an atom is true or false; remove one of the two"
        reading.mistakes.append(Diagnostic("E304", message, second, hint))
    kept = np.flatnonzero(~again) if again.any() else None
    if kept is not None:
        facts = Facts(facts.database[kept], facts.arguments[kept], facts.truth[kept])
    if predicate.value is not None:
        for pair in _second_values(predicate, facts):
            first, second = where.spans(pair if kept is None else kept[pair], reading.sources)
            some = "exactly one value is" if predicate.marker == "!" else "at most one value can be"
            message = f"this is a second value; the first is at {first.place}"
            reading.mistakes.append(Diagnostic("E305", message, second, f"of {predicate}, {some} true"))
    return facts


@dataclass(frozen=True, slots=True)
class _Places:
    """Where facts stand, in their order."""

    columns: _Columns
    order: Callable[[], NDArray[np.int64]]

    def spans(self, rows: Sequence[int] | NDArray[np.int64], sources: Sequence[Source]) -> list[Span]:
        """The places of some of them, the first one first."""
        found = []
        for row in self.order()[rows].tolist():
            file, offset = place(self.columns, row)
            found.append(_fact_span(sources[file], offset))
        return sorted(found, key=lambda s: (s.source.name, s.start))


def _second_values(predicate: Predicate, facts: Facts) -> NDArray[np.int64]:
    """Pairs of true facts about one block of a functional predicate: shape (n, 2), `MOST_MISTAKES` at most."""
    true = np.flatnonzero(facts.truth)
    keys = np.column_stack([facts.database, facts.arguments[:, list(predicate.keys)]])[true]
    order = np.lexsort(tuple(reversed(keys.T)))
    keys, true = keys[order], true[order]
    twice = np.flatnonzero((keys[1:] == keys[:-1]).all(axis=1))[:MOST_MISTAKES]
    return np.column_stack([true[twice], true[twice + 1]])


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
        for block in blocks(len(table.truth)):
            database = table.database[block]
            for name, column in zip(predicate.types, table.arguments[block].T, strict=True):
                if database[0] == database[-1]:
                    present[name][database[0]][column] = True
                else:
                    present[name][database, column] = True
        if predicate.name in reading.soft:
            soft = reading.soft[predicate.name].facts()
            for i, name in enumerate(predicate.types):
                present[name][soft.database, soft.arguments[:, i]] = True
    return present
