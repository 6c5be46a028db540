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
    """Content of an input file, also of one that is named `Predicate=file` or `file::table`: its SHA-256."""
    name, equals, source = str(path).partition("=")
    source = source if equals and name.isidentifier() else str(path)
    digest = hashlib.sha256()
    with open(source.partition("::")[0], "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
