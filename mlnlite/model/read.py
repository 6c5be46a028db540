"""Files and texts to models and evidence: the way in for users."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TypeAlias

import numpy as np

from mlnlite.errors import EvidenceMistake
from mlnlite.model.check import check
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.facts import check_evidence
from mlnlite.model.model import Model
from mlnlite.source import Source
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.files import read_source
from mlnlite.syntax.parse import parse_model
from mlnlite.syntax.tree import Dialect

Path: TypeAlias = str | PathLike[str]


def read_model(*paths: Path, dialect: Dialect | None = None) -> Model:
    """Reads a model from a file, or from several that continue each other.

    Args:
        paths: `.mln` files.
        dialect: `standard` (variables are lower case) or `prac` (variables are `?x`); by default found out.

    Raises:
        SyntaxMistake: if the text is not in the language; with every mistake.
        ModelMistake: if it is, but makes no model; with every mistake.
    """
    return check(parse_model([read_source(path) for path in paths], dialect))


def model_from_text(text: str, *, dialect: Dialect | None = None) -> Model:
    """The model that a text means. Raises as `read_model`."""
    return check(parse_model([Source("<text>", text)], dialect))


def read_evidence(*paths: Path, model: Model, together: bool = False) -> Evidence:
    """Reads evidence from `.db` files.

    Args:
        paths: the files.
        model: what the facts are about.
        together: all files describe one world; otherwise each database, in files or between `---`, is one of its own.

    Raises:
        SyntaxMistake: if a text is not in the language.
        EvidenceMistake: if facts do not fit the model or each other.
    """
    return _evidence([read_source(path) for path in paths], model, together=together)


def evidence_from_text(text: str, *, model: Model) -> Evidence:
    """The evidence that a text means. Raises as `read_evidence`."""
    return _evidence([Source("<text>", text)], model, together=False)


def _evidence(sources: Sequence[Source], model: Model, *, together: bool) -> Evidence:
    programs = [parse_evidence(source, model.dialect) for source in sources]
    return check_evidence(programs, sources, model, together=together)


def one_database(evidence: Evidence, index: int) -> Evidence:
    """One of several databases, as evidence of its own.

    Raises:
        EvidenceMistake: if there is no such database.
    """
    if not 0 <= index < evidence.n_databases:
        raise EvidenceMistake(f"there is no database {index}; there are 0 to {evidence.n_databases - 1}")
    facts = {}
    for name, table in evidence.facts.items():
        mine = table.database == index
        facts[name] = Facts(np.zeros(int(mine.sum()), np.int32), table.arguments[mine], table.truth[mine])
    present = {name: p[index : index + 1] for name, p in evidence.present.items()}
    return Evidence(evidence.types, evidence.predicates, facts, present, 1, (evidence.names[index],), evidence.warnings)
