"""What a learnt file says of itself: comments for people, then one line of JSON."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from mlnlite import __version__

if TYPE_CHECKING:
    from mlnlite.learn.learned import LearnedModel


def header(learned: LearnedModel, models: tuple[Path, ...], databases: tuple[Path, ...], seed: int) -> str:
    """How the weights came about, as comments."""
    from mlnlite.learn.prior import prior_data, prior_text

    hashes: Mapping[str, Mapping[str, str]] = {
        "models": {path.name: _hash(path) for path in models},
        "databases": {path.name: _hash(path) for path in databases},
    }
    how = learned.how
    data = {
        "mlnlite": __version__,
        "objective": learned.objective,
        "value": learned.to_dict()["value"],
        "prior": prior_data(learned.prior),
        "predict": how.predict,
        "open": how.open_predicates,
        "tied": how.tied,
        "database_weights": how.database_weights,
        "status": learned.status,
        "iterations": learned.iterations,
        "monte_carlo_error": float(learned.monte_carlo.max(initial=0.0)),
        "seed": seed,
        **hashes,
    }
    lines = [
        f"learnt by mlnlite {__version__}",
        f"{learned.objective} {learned.value:.6f}",
        f"prior: {prior_text(learned.prior)}",
        f"stopped: {learned.status} after {learned.iterations} steps",
        *(f"model: {name} sha256:{digest}" for name, digest in hashes["models"].items()),
        *(f"data: {name} sha256:{digest}" for name, digest in hashes["databases"].items()),
        f"json: {json.dumps(data, allow_nan=False)}",
    ]
    return "".join(f"// {line}\n" for line in lines) + "\n"


def _hash(path: Path) -> str:
    """What an input says: the SHA-256 of its content; of a mapping (TOML) also that of the tables that it names."""
    from mlnlite.model.table import read_mapping

    name, equals, source = str(path).partition("=")
    files = [source if equals and name.isidentifier() else str(path)]
    if path.suffix == ".toml":
        files += [str(table.source) for _, table in read_mapping(path)]
    digest = hashlib.sha256()
    for file in files:
        with open(file.partition("::")[0], "rb") as content:
            hashlib.file_digest(content, lambda: digest)
    return digest.hexdigest()
