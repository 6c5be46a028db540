"""TOML tables of the domain: a path in, checked entries out. Every mistake has its file and line."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from mlnlite import Diagnostic, MlnError, did_you_mean

DATA: Traversable = files("mlnlite.domains.handover") / "data"


def read_table(path: str | Path | Traversable) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        MlnError: the file is missing, unreadable, or not TOML; with line and column.
    """
    place = Path(path) if isinstance(path, str) else path
    try:
        return tomllib.loads(place.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as reason:
        raise MlnError(f"cannot read {path}: {reason}", hint="give the path of a TOML text file") from None
    except tomllib.TOMLDecodeError as reason:
        raise MlnError(
            [Diagnostic("E801", f"{path}: not TOML: {reason}", hint="repair the line named above")]
        ) from None


def take(entry: Mapping[str, Any], key: str, kind: type | tuple[type, ...], where: str) -> Any:  # noqa: ANN401 - what is in a file
    """The value of a key that must be there and of a kind.

    Raises:
        MlnError: missing, or of another kind; with the place `where`.
    """
    if key not in entry:
        raise MlnError(f"{where}: {key!r} is missing", hint=did_you_mean(key, list(entry)) or f"add {key} = ...")
    if not isinstance(entry[key], kind):
        kinds = kind if isinstance(kind, tuple) else (kind,)
        names = " or ".join(k.__name__ for k in kinds)
        raise MlnError(f"{where}: {key!r} is {entry[key]!r}, expected {names}", hint=f"write {key} as {names}")
    return entry[key]


def choose(word: str, known: Iterable[str], what: str) -> str:
    """The word, if it is one of the known ones.

    Raises:
        MlnError: unknown word; with the nearest and all known ones.
    """
    words = list(known)
    if word in words:
        return word
    near = did_you_mean(word, words)
    raise MlnError(f"unknown {what} {word!r}; known: {', '.join(words)}", hint=near or "choose one of these")
