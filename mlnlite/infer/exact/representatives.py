"""One tuple of constants for each class: comes in a group with its classes, go out formulas about these tuples only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mlnlite.ground.network import Int64
from mlnlite.infer.exact.alike import Alike
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.formulas import Const, Var
from mlnlite.model.symbols import Type
from mlnlite.model.templates import Template


def restricted(alike: Alike, types: Mapping[str, Type]) -> tuple[tuple[Template, ...], Int64]:
    """The formulas of a group, about the first tuples of its classes only, and the class of each of their rows.

    Args:
        alike: the group and its classes.
        types: by name.
    """
    templates, owners = [], []
    for i, template in enumerate(alike.group.templates):
        terms = [s.terms[i] for s in alike.separators]
        fits = np.ones(len(alike.size), np.bool_)
        for j, term in enumerate(terms):
            fits &= (alike.first[:, j] == term.id) if isinstance(term, Const) else True
        variables = {t.index: j for j, t in enumerate(terms) if isinstance(t, Var)}
        tuples = alike.first[fits][:, list(variables.values())]
        rows, which = _with_rows(template.expanded(types), tuple(variables), tuples)
        templates.append(rows)
        owners.append(np.flatnonzero(fits)[which])
    return tuple(templates), np.concatenate(owners)


def facts_about(alike: Alike, evidence: Evidence) -> Evidence:
    """Evidence with the facts that matter to the first tuples of the classes, and few others.

    Args:
        alike: the group and its classes.
        evidence: about one database.
    """
    used = {a.predicate for t in alike.group.templates for a in t.formula.atoms}
    facts = {}
    for name, table in evidence.facts.items():
        fits = np.full(len(table.truth), name in used)
        for i, separator in enumerate(alike.separators if name in alike.group.open else ()):
            wanted = np.zeros(len(alike.place[i]), np.bool_)
            wanted[alike.first[:, i]] = True
            fits &= wanted[table.arguments[:, separator.at[name]]]
        facts[name] = Facts(table.database[fits], table.arguments[fits], table.truth[fits])
    return replace(evidence, facts=facts)


def _with_rows(template: Template, variables: tuple[int, ...], tuples: Int64) -> tuple[Template, Int64]:
    """A template in which variables stand for given constants only, as keys, and the tuple of these of each row."""
    assert template.rows is not None
    shared = [v for v in variables if v in template.keys]
    new = [v for v in variables if v not in template.keys]
    left = template.rows[:, [template.keys.index(v) for v in shared]]
    right = tuples[:, [variables.index(v) for v in shared]]
    _, code = np.unique(np.concatenate([left, right]), axis=0, return_inverse=True)
    code = code.ravel() if shared else np.zeros(len(left) + len(right), np.int64)
    mine, other = _matches(code[: len(left)], code[len(left) :])
    added = tuples[other][:, [variables.index(v) for v in new]]
    rows = np.concatenate([template.rows[mine], added], axis=1).astype(np.int32)
    keys = (*template.keys, *new)
    return replace(template, keys=keys, rows=rows, weights=template.weights[mine], unique=(), row_spans=()), other


def _matches(left: Int64, right: Int64) -> tuple[Int64, Int64]:
    """All pairs of places at which two arrays are equal."""
    order = np.argsort(left, kind="stable")
    low, high = np.searchsorted(left[order], right), np.searchsorted(left[order], right, side="right")
    n = high - low
    step = np.arange(int(n.sum())) - np.repeat(np.cumsum(n) - n, n)
    return order[np.repeat(low, n) + step], np.repeat(np.arange(len(right)), n)
