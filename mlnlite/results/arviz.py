"""Samples for ArviZ, an optional part: come in series of draws, goes out what its first or second generation reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import MissingPart, QueryMistake

Rows = tuple[NDArray[np.int64], NDArray[np.float32]]


def inference_data(names: Sequence[str], draws: Sequence[Rows], traces: Mapping[str, NDArray[np.float64]]) -> Any:  # noqa: ANN401
    """Converts what was sampled; see `Marginals.to_inference_data`.

    Args:
        names: of all rows.
        draws: of each sampling, its rows and series of shape (n_chains, n_batches, n_rows).
        traces: by name, shape (n_chains, n_batches).

    Raises:
        QueryMistake: nothing was sampled.
        MissingPart: ArviZ is not installed.
    """
    if not draws:
        raise QueryMistake("nothing was sampled", hint="every probability is exact; `to_frame` has them")
    try:
        arviz: Any = import_module("arviz")
    except ImportError as error:
        raise MissingPart("ArviZ is not installed", hint="pip install 'mlnlite[arviz]'") from error
    n = min(series.shape[1] for _, series in draws)
    posterior = np.concatenate([series[:, -n:] for _, series in draws], axis=2)
    sampled = [names[i] for rows, _ in draws for i in rows.tolist()]
    groups = {"posterior": {"probability": posterior}, "sample_stats": {k: v[:, -n:] for k, v in traces.items()}}
    labels = {"coords": {"atom": sampled}, "dims": {"probability": ["atom"]}}
    if int(arviz.__version__.split(".")[0]) >= 1:
        return arviz.from_dict(groups, **labels)
    return arviz.from_dict(**groups, **labels)
