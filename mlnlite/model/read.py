"""Files and texts to models and evidence: the way in for users."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path as FilePath
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, EvidenceMistake, ModelMistake, SyntaxMistake, did_you_mean, in_order
from mlnlite.model.check import check
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.facts import TableFacts, check_evidence
from mlnlite.model.model import Model
from mlnlite.model.soft import of_databases
from mlnlite.model.table import Table, read_mapping
from mlnlite.source import Source
from mlnlite.syntax.evidence import BULK, parse_evidence
from mlnlite.syntax.facts import EvidenceProgram
from mlnlite.syntax.files import read_source
from mlnlite.syntax.letters import open_source
from mlnlite.syntax.parse import parse_what_can_be_read
from mlnlite.syntax.tree import AnyDialect, Program

Path: TypeAlias = str | PathLike[str]


def read_model(*paths: Path, dialect: AnyDialect | None = None) -> Model:
    """Reads a model from a file, or from several that continue each other.

    Args:
        paths: `.mln` files.
        dialect: `standard`, `prac`, `alchemy`, `tuffy`, `rockit` or `lomrf`; by default found out.

    Raises:
        SyntaxMistake: if the text is not in the language; with every mistake.
        ModelMistake: if it is, but makes no model; with every mistake.
    """
    return _model([read_source(path) for path in paths], dialect)


def model_from_text(text: str, *, dialect: AnyDialect | None = None) -> Model:
    """The model that a text means. Raises as `read_model`."""
    return _model([Source("<text>", text)], dialect)


def _model(sources: Sequence[Source], dialect: AnyDialect | None) -> Model:
    program, mistakes = parse_what_can_be_read(sources, dialect)
    if mistakes:
        raise SyntaxMistake(in_order([*mistakes, *_also_wrong(program, mistakes)]))
    return check(program)


def _also_wrong(program: Program, mistakes: Sequence[Diagnostic]) -> list[Diagnostic]:
    """What is wrong with the statements that could be read; not what one that could not may declare."""
    unread = {word for d in mistakes if d.span for word in _words(d.span.source.line(d.span.line))}
    try:
        check(program)
    except ModelMistake as error:
        undeclared = {"E200", "E202"}
        return [
            d
            for d in error.diagnostics
            if d.code not in undeclared or (d.span and unread.isdisjoint(_words(d.span.text)))
        ]
    return []


def _words(text: str) -> set[str]:
    return set(re.findall(r"[^\W\d]\w*", text))


def read_evidence(*paths: Path, model: Model, together: bool = False) -> Evidence:
    """Reads evidence from files.

    Args:
        paths: `.db` files; `Friends=friends.csv` for a table of facts about Friends (also Parquet, JSON lines, and
            `FILE::TABLE` of SQLite or DuckDB), and `.toml` files that name tables (see `Table`). All tables are about
            one world.
        model: what the facts are about.
        together: all files describe one world; otherwise each database, in files or between `---`, is one of its own.

    Raises:
        SyntaxMistake: if a text is not in the language.
        EvidenceMistake: if facts do not fit the model or each other.
    """
    texts: list[Source] = []
    tables: list[tuple[str, Table]] = []
    for path in (fspath(p) for p in paths):
        name, equals, source = path.partition("=")
        if equals and name.isidentifier():
            tables.append((name, Table(source)))
        elif path.endswith(".toml"):
            tables += read_mapping(FilePath(path))
        else:
            texts.append(open_source(path, BULK))
    return evidence_of(texts, model, together=together, tables=tables)


def evidence_from_text(text: str, *, model: Model) -> Evidence:
    """The evidence that a text means. Raises as `read_evidence`."""
    return evidence_of([Source("<text>", text)], model, together=False)


def evidence_of(
    texts: Sequence[Source], model: Model, *, together: bool, tables: Sequence[tuple[str, Table]] = ()
) -> Evidence:
    """Evidence from texts and tables; see `read_evidence`."""
    programs: list[EvidenceProgram | TableFacts] = [parse_evidence(source) for source in texts]
    warnings: list[Diagnostic] = []
    for name, table in tables:
        predicate = model.predicates.get(name)
        if predicate is None:
            hint = did_you_mean(name, list(model.predicates))
            raise EvidenceMistake([Diagnostic("E302", f"the predicate {name} is not declared", hint=hint)])
        from mlnlite.model.tabular import read_table

        facts, found = read_table(predicate, table)
        programs.append(facts)
        warnings += found
    evidence = check_evidence(programs, model, together=together)
    return replace(evidence, warnings=evidence.warnings + tuple(warnings)) if warnings else evidence


def one_database(evidence: Evidence, index: int) -> Evidence:
    """One of several databases, as evidence of its own.

    Raises:
        EvidenceMistake: if there is no such database.
    """
    if not 0 <= index < evidence.n_databases:
        raise EvidenceMistake(f"there is no database {index}; there are 0 to {evidence.n_databases - 1}")
    return some_databases(evidence, np.array([index]))


def some_databases(evidence: Evidence, chosen: NDArray[np.int64]) -> Evidence:
    """Some of the databases, in rising order of their numbers `chosen`."""
    number = np.full(evidence.n_databases, -1, np.int32)
    number[chosen] = np.arange(len(chosen), dtype=np.int32)
    facts = {}
    for name, table in evidence.facts.items():
        keep = number[table.database] >= 0
        facts[name] = Facts(number[table.database[keep]], table.arguments[keep], table.truth[keep])
    return replace(
        evidence,
        facts=facts,
        soft=of_databases(evidence.soft, number),
        present={name: p[chosen] for name, p in evidence.present.items()},
        n_databases=len(chosen),
        names=tuple(evidence.names[i] for i in chosen.tolist()),
    )
