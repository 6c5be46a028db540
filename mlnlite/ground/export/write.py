"""Which format a file name asks for; the text or file that it gets."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import NamedTemporaryFile

from mlnlite.errors import QueryMistake
from mlnlite.ground.export.cfn import cfn
from mlnlite.ground.export.graph import dot, graphml
from mlnlite.ground.export.parquet import write_parquet
from mlnlite.ground.export.text import text
from mlnlite.ground.export.uai import uai
from mlnlite.ground.export.wcnf import wcnf
from mlnlite.ground.network import Network
from mlnlite.ground.patterns import without_counts

FORMATS: Mapping[str, Callable[[Network], str]] = {
    ".txt": text,
    ".wcnf": wcnf,
    ".uai": uai,
    ".cfn": cfn,
    ".dot": dot,
    ".graphml": graphml,
}


def export(network: Network, path: str | os.PathLike[str]) -> None:
    """Writes a network to a file, whole or not at all.

    Args:
        network: what was ground; counting factors become tables.
        path: its ending says the format: `.txt` (ground formulas), `.wcnf` (MaxSAT), `.uai` (Markov network), `.cfn`
            (toulbar2), `.dot` (Graphviz), `.graphml`, `.parquet` (a table of literals).

    Raises:
        QueryMistake: if the ending is none of these, or the folder is not there.
        LimitReached: if the format cannot hold a factor.
    """
    target = Path(path)
    if target.suffix not in (*FORMATS, ".parquet"):
        raise QueryMistake(f"{target.name} ends in none of {', '.join([*FORMATS, '.parquet'])}")
    if not target.absolute().parent.is_dir():
        raise QueryMistake(f"there is no folder {target.absolute().parent}")
    network = without_counts(network)
    with NamedTemporaryFile(dir=target.absolute().parent, suffix=target.suffix, delete=False) as file:
        temporary = Path(file.name)
    try:
        if target.suffix == ".parquet":
            write_parquet(network, temporary)
        else:
            temporary.write_text(FORMATS[target.suffix](network), encoding="utf-8")
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
