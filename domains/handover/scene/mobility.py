"""Arm mobility levels: a TOML table in, `MobilityLevel` out. How they act on a receiver is in `receiver.py`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mlnlite import MlnError
from mlnlite.domains.handover.tables import DATA, choose, read_table, take


@dataclass(frozen=True, slots=True)
class MobilityLevel:
    """Scalings of a healthy arm, each in (0, 1].

    Attributes:
        name: short name, `H`, `H-M`, `L-M`, `L`.
        title: in words.
        range: of each arm joint's range of motion about the comfortable posture.
        strength: of each joint's strength.
        trunk: of the trunk's lean.
    """

    name: str
    title: str = ""
    range: float = 1.0
    strength: float = 1.0
    trunk: float = 1.0


def read_levels(path: str | Path | None = None) -> tuple[MobilityLevel, ...]:
    """Levels from a TOML file, highest mobility first; by default those of the domain.

    Raises:
        MlnError: broken file, missing key, or a scaling outside (0, 1].
    """
    source = DATA / "levels.toml" if path is None else Path(path)
    found = read_table(source)
    for name, entry in found.items():
        if not isinstance(entry, dict):
            raise MlnError(
                f"{source.name}: {name} = {entry!r}, expected a table", hint=f"write [{name}], its keys below"
            )
    return tuple(_level(name, entry, f"{source.name}: [{name}]") for name, entry in found.items())


def _level(name: str, entry: dict[str, object], where: str) -> MobilityLevel:
    scales = {key: float(take(entry, key, (int, float), where)) for key in ("range", "strength", "trunk")}
    for key, value in scales.items():
        if not 0 < value <= 1:
            raise MlnError(f"{where}: {key} is {value}, expected more than 0 and at most 1", hint="1 is a healthy arm")
    return MobilityLevel(name, str(take(entry, "title", str, where)), **scales)


def read_level(name: str, path: str | Path | None = None) -> MobilityLevel:
    """A level by name, of a TOML file or of the domain.

    Raises:
        MlnError: unknown level.
    """
    levels = {level.name: level for level in read_levels(path)}
    return levels[choose(name, levels, "mobility level")]
