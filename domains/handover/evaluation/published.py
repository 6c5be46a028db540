"""The published data: the authors' files in, cleaned rows out.

Where the files have gaps: a missing level opens a copied group whose next row has the same method, so it takes the
level of the next row that has one; the regions `3-2` and `23` name two, the first of the descending and of the
ascending pair (3 and 2). Material, texture and environment are those of the aligned row of the 2019 file, where that is
given and the row has a counterpart.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path

import mlnlite as ml
from mlnlite.domains.handover.knowledge.facts import THING, Fact

_REGIONS = {"3-2": "3", "23": "2"}
_METHODS = ("far", "midway", "ours")
LOOKS = ("hasMaterial", "hasTexture", "canBeFound")
"""What only the 2019 file tells of a row."""


@dataclass(frozen=True, slots=True)
class PublishedRow:
    """One row.

    Attributes:
        known: what is known: predicate and value, level left out.
        level: `level_1` (high) to `level_4` (low), gaps filled.
        gap: whether the level was missing.
        region: label.
        method: label.
    """

    known: tuple[tuple[str, str], ...]
    level: str
    gap: bool
    region: str
    method: str

    def value(self, predicate: str) -> str:
        """The value of a predicate, or empty."""
        return dict(self.known).get(predicate, "")


def read_published(folder: str | Path) -> tuple[PublishedRow, ...]:
    """Rows of `handover/dataset.db`, with what `grasp_affordance/data.txt` adds if it is there.

    Args:
        folder: that holds the two folders of the authors' files.

    Raises:
        MlnError: the data set is missing, or a row lacks a label.
    """
    path = Path(folder) / "handover" / "dataset.db"
    raw = _databases(path)
    levels = _filled([row.get("armMobility", "") for row in raw])
    looks = _aligned(raw, Path(folder) / "grasp_affordance" / "data.txt")
    out = []
    for i, (row, level, look) in enumerate(zip(raw, levels, looks, strict=True)):
        missing = {"hasShape", "isA", "hasAffordance", "graspRegion", "handover"} - set(row)
        if missing:
            raise ml.MlnError(f"{path}: row {i + 1} lacks {', '.join(sorted(missing))}")
        known = tuple((name, row[name]) for name in ("hasShape", "isA", "hasAffordance")) + look
        region = _REGIONS.get(row["graspRegion"], row["graspRegion"])
        method = row["handover"].split("_")[0]
        out.append(PublishedRow(known, level, "armMobility" not in row, region, method))
    return tuple(out)


def _databases(path: Path) -> list[dict[str, str]]:
    """Of each database the last argument of each fact."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as reason:
        hint = "give the folder that holds handover/dataset.db of the authors"
        raise ml.MlnError(f"cannot read {path}: {reason}", hint=hint) from None
    blocks = re.split(r"^---\s*$", text, flags=re.MULTILINE)
    found = [re.findall(r"(\w+)\(([^)]*)\)", block) for block in blocks]
    return [{name: args.split(",")[-1].strip() for name, args in facts} for facts in found if facts]


def _filled(levels: Sequence[str]) -> list[str]:
    out, after = list(levels), ""
    for i in reversed(range(len(out))):
        out[i] = out[i] or after
        after = out[i]
    return out


def _aligned(rows: Sequence[dict[str, str]], path: Path) -> list[tuple[tuple[str, str], ...]]:
    """What the 2019 file says of each row's looks, by the longest matching sequences."""
    looks: list[tuple[tuple[str, str], ...]] = [()] * len(rows)
    if not path.exists():
        return looks
    others = _databases(path)
    first, second = [_key(row) for row in rows], [_key(row) for row in others]
    for block in SequenceMatcher(None, first, second, autojunk=False).get_matching_blocks():
        for k in range(block.size):
            found = others[block.b + k]
            looks[block.a + k] = tuple((name, found[name]) for name in LOOKS if name in found)
    return looks


def _key(row: dict[str, str]) -> tuple[str, ...]:
    return tuple(row.get(name, "") for name in ("hasShape", "isA", "hasAffordance", "graspRegion"))


def known_facts(row: PublishedRow, *, without: Collection[str] = (), level: bool = True) -> tuple[Fact, ...]:
    """What is known of a row as facts, without some predicates, with or without the level."""
    facts: list[Fact] = [(name, THING, value) for name, value in row.known if name not in without]
    return (*facts, ("armMobility", row.level)) if level and row.level else tuple(facts)


def labels(row: PublishedRow) -> tuple[Fact, ...]:
    """The labels of a row as facts."""
    return ("graspRegion", THING, row.region), ("handover", THING, row.method)


def keys(rows: Sequence[PublishedRow]) -> list[str]:
    """What must not be in both halves of a held-out-key split: shape, category and affordance."""
    return [" ".join(row.value(name) for name in ("hasShape", "isA", "hasAffordance")) for row in rows]


def blocks(rows: Sequence[PublishedRow]) -> list[str]:
    """Runs: neighbours with equal level and method, or of one object, stay together."""
    out, number = [], 0
    for i, row in enumerate(rows):
        if i and not _neighbours(rows[i - 1], row):
            number += 1
        out.append(str(number))
    return out


def _neighbours(first: PublishedRow, second: PublishedRow) -> bool:
    same_label = (first.level, first.method) == (second.level, second.method)
    return same_label or _thing(first) == _thing(second)


def _thing(row: PublishedRow) -> tuple[str, ...]:
    """What tells objects apart: the files have no names."""
    return tuple(row.value(name) for name in ("hasShape", "isA", "hasMaterial", "hasTexture"))
