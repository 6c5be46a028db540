"""What was aimed at: results in, a table of goals with what was found out. A missed goal is listed as missed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mlnlite.domains.handover.evaluation.metrics import (
    accuracy,
    balanced_accuracy,
    balanced_interval,
    cluster_interval,
    credit,
    log_loss,
    losses,
)
from mlnlite.domains.handover.evaluation.protocol import Split
from mlnlite.domains.handover.evaluation.protocol_tables import over, shares
from mlnlite.domains.handover.evaluation.real import OURS, HeldOut

_Goal = tuple[str, str, bool]
"""What is wanted, what was found, whether that is enough."""


def goals_section(protocol: Mapping[str, Sequence[Split]], real: Sequence[HeldOut]) -> str:
    """All goals, as Markdown."""
    lines = ["## Goals", "", "Differences are paired, with 95 % intervals; if one includes 0, chance could do it.",
             "", "| goal | found | holds |", "|---|---|---|"]  # fmt: skip
    goals = [*(_unseen(protocol) if protocol else []), *(goal for one in real for goal in _held_out(one))]
    lines += [f"| {wanted} | {found} | {'yes' if holds else '**no**'} |" for wanted, found, holds in goals]
    return "\n".join([*lines, ""])


def _unseen(protocol: Mapping[str, Sequence[Split]]) -> list[_Goal]:
    sampled, preferred = protocol["sampled"], protocol["preferred"]
    mine, best = (shares(sampled, (model, "method", "synthetic", "all")) for model in ("ours", "ceiling"))
    low, high = np.percentile(mine - best, [2.5, 97.5])
    gap = float((mine - best).mean())
    whole = ("ours", "pose and grasp", "synthetic", "all")
    return [
        ("unseen objects, labels sampled: method within 1 point of the Bayes ceiling",
         f"{mine.mean():.1f} % of {best.mean():.1f} %: {gap:+.2f} [{low:+.2f}, {high:+.2f}] points", gap >= -1),
        ("unseen objects, labels preferred: pose and grasp at least 98 %", over(preferred, whole),
         bool(shares(preferred, whole).mean() >= 98)),
    ]  # fmt: skip


def _held_out(one: HeldOut) -> list[_Goal]:
    """Accuracy against a figure, log-loss against every baseline."""
    p, y, place = one.found[OURS], one.truth, f"the authors' rows, {one.question.predicate}, {one.scheme}"
    rivals = {name: q for name, q in one.found.items() if name != OURS}
    name = max(rivals, key=lambda name: accuracy(y, rivals[name]))
    mine, best = 100 * accuracy(y, p), 100 * accuracy(y, rivals[name])
    out: list[_Goal] = []
    if one.question.predicate == "handover" and one.scheme == "key":
        fair = 100 * balanced_accuracy(y, p)
        (low, high), (a, b) = cluster_interval(credit(y, p), one.groups), balanced_interval(y, p, one.groups)
        out += [(f"{place}: accuracy at least 70 %", f"{mine:.1f} % [{100 * low:.0f}, {100 * high:.0f}]", mine >= 70),
                (f"{place}: balanced accuracy at least 57 %", f"{fair:.1f} % [{100 * a:.0f}, {100 * b:.0f}]",
                 fair >= 57)]  # fmt: skip
    elif one.scheme == "key":
        out.append((f"{place}: accuracy at least that of the best baseline", _against(one, name), mine >= best))
    else:
        most = 100 * accuracy(y, rivals["majority"])
        out.append((f"{place}: accuracy at least that of the majority", _against(one, "majority"), mine >= most))
    name = min(rivals, key=lambda name: log_loss(y, rivals[name]))
    saved = losses(y, rivals[name]) - losses(y, p)
    low, high = cluster_interval(saved, one.groups)
    out.append((f"{place}: log-loss below every baseline's",
                f"{log_loss(y, p):.3f}, {saved.mean():+.3f} [{low:+.3f}, {high:+.3f}] saved on {name}",
                bool(saved.mean() > 0)))  # fmt: skip
    return out


def _against(one: HeldOut, rival: str) -> str:
    """Accuracy beside that of a rival, with the paired difference."""
    y, p, q = one.truth, one.found[OURS], one.found[rival]
    gained = credit(y, p) - credit(y, q)
    low, high = cluster_interval(gained, one.groups)
    return (f"{100 * accuracy(y, p):.1f} % against {100 * accuracy(y, q):.1f} % of {rival}: {100 * gained.mean():+.1f} "
            f"[{100 * low:+.1f}, {100 * high:+.1f}]")  # fmt: skip
