"""Columns of constants: every constant once, and for each row the number of its constant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class Coded:
    """A column: distinct constants, of which it need not have all, and for each row which one (-1 for NULL)."""

    names: Sequence[str]
    codes: Codes

    def __eq__(self, other: object) -> bool:
        """Whether the rows are the same."""
        return isinstance(other, Coded) and self.texts() == other.texts()

    __hash__ = None  # type: ignore[assignment]

    def texts(self) -> list[str]:
        """The constant of each row."""
        return [self.names[code] for code in self.codes.tolist()]
