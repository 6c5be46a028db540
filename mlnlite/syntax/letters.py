"""Texts as bytes, which is how compiled code reads them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mlnlite.source import Source
from mlnlite.syntax.files import MAX_BYTES, read_source

Letters = NDArray[np.uint8]

PADDING = 512
"""Bytes behind a text, so that reading may look ahead."""
CHUNK = 1 << 20
"""Bytes that are read from a file at once; reusing memory takes a tenth of the time of getting more."""


def letters_of(text: str) -> Letters:
    """The bytes of a text, a newline, and `PADDING` more."""
    return np.frombuffer(text.encode() + b"\n" + bytes(PADDING), np.uint8)


class LargeFile(Source):
    """A file that is read as a text only when its text is asked for; mistakes are raised then, as by `read_source`."""

    __eq__, __hash__ = object.__eq__, object.__hash__

    def __init__(self, name: str) -> None:
        """The file of this name."""
        object.__setattr__(self, "name", name)

    @cached_property
    def text(self) -> str:
        """The text."""
        return read_source(self.name).text

    def chunks(self) -> Iterator[Letters]:
        """Its lines, some at a time, each as in `letters_of`; the next ones take their place."""
        buffer, end = bytearray(CHUNK + PADDING), 0
        with Path(self.name).open("rb", buffering=0) as file:
            while n := file.readinto(memoryview(buffer)[end:-PADDING]):
                stop = buffer.rfind(b"\n", end, end + n) + 1
                end += n
                if stop:
                    yield np.frombuffer(buffer, np.uint8, stop + PADDING)
                    buffer[: end - stop] = buffer[stop:end]
                    end -= stop
                elif end == len(buffer) - PADDING:
                    buffer = buffer + bytes(len(buffer))
        if end:
            buffer[end] = ord("\n")
            yield np.frombuffer(buffer, np.uint8, end + 1 + PADDING)


def open_source(path: str | os.PathLike[str], large: int) -> Source:
    """As `read_source`, but a file of `large` bytes or more is not read yet."""
    name = os.fspath(path)
    try:
        size = os.path.getsize(name)
        with open(name, "rb") as file:
            begin = file.read(CHUNK)
    except OSError:
        return read_source(path)
    plain = large <= size <= MAX_BYTES and begin.isascii() and not begin.isspace()
    return LargeFile(name) if plain else read_source(path)
