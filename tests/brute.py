"""The definition, by enumeration: no plans, no joins, no arithmetic on atom numbers. For tests only."""

from __future__ import annotations

import itertools
import math

import numpy as np

from mlnlite.model.formulas import All, Any, AtomRef, Const, Count, Equal, Exists, Iff, Not


def atoms(model, evidence, world=0):
    """Every ground atom (predicate, constant ids) of the constants that the database has."""
    found = []
    for p in model.predicates.values():
        ids = [np.flatnonzero(evidence.present[t][world]).tolist() for t in p.types]
        found += [(p.name, arguments) for arguments in itertools.product(*ids)]
    return found


def facts(evidence, world=0):
    known = {}
    for name, table in evidence.facts.items():
        for database, arguments, truth in zip(table.database, table.arguments, table.truth, strict=True):
            if database == world:
                known[name, tuple(int(a) for a in arguments)] = bool(truth)
    return known


def blocks(model, all_atoms):
    """Atoms of each functional block: (marker, [atoms])."""
    found = {}
    for name, arguments in all_atoms:
        p = model.predicates[name]
        if p.value is not None:
            key = (name, tuple(a for i, a in enumerate(arguments) if i != p.value))
            found.setdefault(key, (p.marker, []))[1].append((name, arguments))
    return list(found.values())


def worlds(model, evidence, world=0, closed=()):
    """All worlds (dicts atom -> truth) that agree with the facts, closed worlds and functional predicates."""
    every = atoms(model, evidence, world)
    known = facts(evidence, world)
    is_closed = {p.name for p in evidence.predicates.values() if p.closed} | set(closed)
    options = []
    in_block = set()
    for marker, members in blocks(model, every):
        choices = []
        for chosen in [*members, *([None] if marker == "?" else [])]:
            values = {m: m == chosen for m in members}
            if all(known.get(m, False if m[0] in is_closed else v) == v for m, v in values.items()):
                choices.append(values)
        options.append(choices)
        in_block.update(members)
    for atom in every:
        if atom in in_block:
            continue
        if atom in known or atom[0] in is_closed:
            options.append([{atom: known.get(atom, False)}])
        else:
            options.append([{atom: False}, {atom: True}])
    for combination in itertools.product(*options):
        yield {atom: truth for part in combination for atom, truth in part.items()}


def is_true(formula, expression, binding, world, present):
    def value(term):
        return term.id if isinstance(term, Const) else binding[term.index]

    def inside(e, b=binding):
        return is_true(formula, e, b, world, present)

    match expression:
        case AtomRef(index):
            schema = formula.atoms[index]
            return world[schema.predicate, tuple(value(t) for t in schema.arguments)]
        case Equal(left, right):
            return value(left) == value(right)
        case Not(operand):
            return not inside(operand)
        case All(operands):
            return all(inside(f) for f in operands)
        case Any(operands):
            return any(inside(f) for f in operands)
        case Iff(left, right):
            return inside(left) == inside(right)
        case Count(variables, body, low, high):
            ranges = [present[formula.variables[v].type] for v in variables]
            n = sum(
                inside(body, {**binding, **dict(zip(variables, values, strict=True))})
                for values in itertools.product(*ranges)
            )
            return low <= n and (high is None or n <= high)
        case Exists(variables, body):
            ranges = [present[formula.variables[v].type] for v in variables]
            return any(
                inside(body, {**binding, **dict(zip(variables, values, strict=True))})
                for values in itertools.product(*ranges)
            )


def counts(model, evidence, world, database=0):
    """True groundings of each weight, and all groundings. `model` has expanded templates."""
    present = {t: np.flatnonzero(p[database]).tolist() for t, p in evidence.present.items()}
    true, total = [], []
    for template in model.templates:
        formula = template.formula
        others = [v for v in formula.free if v not in template.keys]
        for row in template.rows:
            keys = dict(zip(template.keys, map(int, row), strict=True))
            n_true = n_all = 0
            for values in itertools.product(*(present[formula.variables[v].type] for v in others)):
                binding = {**keys, **dict(zip(others, values, strict=True))}
                n_true += is_true(formula, formula.body, binding, world, present)
                n_all += 1
            true.append(n_true)
            total.append(n_all)
    return np.array(true), np.array(total)


def log_weight(model, evidence, world, database=0):
    weights = np.concatenate([t.weights for t in model.templates])
    true, total = counts(model, evidence, world, database)
    hard = np.isinf(weights)
    if (true[hard] < total[hard]).any():
        return -math.inf
    return float(weights[~hard] @ true[~hard])


def distribution(model, evidence):
    """Worlds with positive probability, their probabilities, log Z."""
    every = [(w, log_weight(model, evidence, w)) for w in worlds(model, evidence)]
    logs = np.array([lw for _, lw in every])
    top = logs.max(initial=-math.inf)
    if top == -math.inf:
        return [], np.empty(0), -math.inf
    log_z = top + math.log(np.exp(logs - top).sum())
    return [w for w, _ in every], np.exp(logs - log_z), log_z


def marginals(model, evidence):
    every, probability, _ = distribution(model, evidence)
    return {a: float(sum(p for w, p in zip(every, probability, strict=True) if w[a])) for a in every[0]}


def pseudo_log_likelihood(model, evidence):
    """Besag's definition, over all databases: each atom, or block, given all others."""
    total = 0.0
    for database in range(evidence.n_databases):
        every = atoms(model, evidence, database)
        known = facts(evidence, database)
        world = {a: known.get(a, False) for a in every}
        grouped = blocks(model, every)
        in_block = {a for _, members in grouped for a in members}
        choices = [[{a: False}, {a: True}] for a in every if a not in in_block]
        for marker, members in grouped:
            chosen = [*members, *([None] if marker == "?" else [])]
            choices.append([{m: m == c for m in members} for c in chosen])
        for options in choices:
            logs = np.array([log_weight(model, evidence, {**world, **o}, database) for o in options])
            (own,) = [i for i, o in enumerate(options) if all(world[a] == t for a, t in o.items())]
            total += logs[own] - logs.max() - math.log(np.exp(logs - logs.max()).sum())
    return total
