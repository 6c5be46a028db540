"""Plan to SQL text: integers, joins, NOT EXISTS, GROUP BY; `rowid` for parts of a table."""

from __future__ import annotations

from typing import assert_never

from mlnlite.engines.plan import (
    AntiJoin,
    Compute,
    Count,
    Join,
    Lookup,
    One,
    Plan,
    Project,
    Scan,
    Union,
    Where,
    columns_of,
)


def query(plan: Plan) -> str:
    """A query that gives the rows of a plan; a plan without columns gives one column named `_`.

    >>> query(Scan("friends", ("x", 3)))
    'SELECT c0 AS "x" FROM "friends" WHERE c1 = 3'
    """
    match plan:
        case Scan():
            return _scan(plan)
        case One():
            return 'SELECT 1 AS "_"'
        case Join():
            return _join(plan)
        case AntiJoin(left, right):
            shared = [c for c in columns_of(right) if c in columns_of(left)]
            return f"SELECT * FROM {_sub(left, 'l')} WHERE NOT EXISTS (SELECT 1 FROM {_sub(right, 'r')}{_on(shared)})"
        case Where(source, left_side, operator, right_side):
            sign = "=" if operator == "=" else "<>"
            return f"SELECT * FROM {_sub(source, 'l')} WHERE {_side(left_side)} {sign} {_side(right_side)}"
        case Compute(source, name, terms, constant):
            sum_ = " + ".join([str(constant), *(f"CAST({quoted(c)} AS BIGINT) * {f}" for c, f in terms)])
            return f"SELECT {_listed(columns_of(source), f'{sum_} AS {quoted(name)}')} FROM {_sub(source, 'l')}"
        case Lookup():
            return _lookup(plan)
        case Project(source, kept):
            return f"SELECT {_listed(kept)} FROM {_sub(source, 'l')}"
        case Union(sources):
            columns = _listed(columns_of(plan))
            return " UNION ".join(f"SELECT {columns} FROM {_sub(s, 'l')}" for s in sources)
        case Count(source, by):
            group = f" GROUP BY {', '.join(map(quoted, by))}" if by else ""
            return f'SELECT {"".join(quoted(c) + ", " for c in by)}COUNT(*) AS "count" FROM {_sub(source, "l")}{group}'
        case _:
            assert_never(plan)


def quoted(name: str) -> str:
    """A name as SQL writes it."""
    return '"' + name.replace('"', '""') + '"'


def _sub(plan: Plan, alias: str) -> str:
    return f"({query(plan)}) AS {alias}"


def _side(side: str | int) -> str:
    return quoted(side) if isinstance(side, str) else str(side)


def _listed(columns: tuple[str, ...], *more: str) -> str:
    return ", ".join([*map(quoted, columns), *more]) or '1 AS "_"'


def _on(shared: list[str]) -> str:
    return " WHERE " + " AND ".join(f"l.{quoted(c)} = r.{quoted(c)}" for c in shared) if shared else ""


def _scan(plan: Scan) -> str:
    first: dict[str, int] = {}
    conditions = []
    for i, column in enumerate(plan.columns):
        if isinstance(column, int):
            conditions.append(f"c{i} = {column}")
        elif isinstance(column, str) and column in first:
            conditions.append(f"c{i} = c{first[column]}")
        elif isinstance(column, str):
            first[column] = i
    columns = ", ".join(f"c{i} AS {quoted(c)}" for c, i in first.items()) or '1 AS "_"'
    if plan.part is not None:
        conditions.append(f"rowid >= {plan.part[0]} AND rowid < {plan.part[1]}")
    where = f" WHERE {' AND '.join(conditions)}" if conditions else ""
    return f"SELECT {columns} FROM {quoted(plan.table)}{where}"


def _join(plan: Join) -> str:
    left, right = columns_of(plan.left), columns_of(plan.right)
    columns = [f"l.{quoted(c)}" for c in left] + [f"r.{quoted(c)}" for c in right if c not in left]
    chosen = ", ".join(columns) or '1 AS "_"'
    return f"SELECT {chosen} FROM {_sub(plan.left, 'l')}, {_sub(plan.right, 'r')}{_on([c for c in right if c in left])}"


def _lookup(plan: Lookup) -> str:
    on = " AND ".join(f"t.c{i} = {'l.' + quoted(k) if isinstance(k, str) else k}" for i, k in enumerate(plan.key))
    value = f"COALESCE(t.c{len(plan.key)}, {_side(plan.default)}) AS {quoted(plan.name)}"
    columns = ", ".join([*(f"l.{quoted(c)}" for c in columns_of(plan.source)), value])
    kept = "" if plan.dropped is None else f" WHERE t.c{len(plan.key)} IS DISTINCT FROM {plan.dropped}"
    return f"SELECT {columns} FROM {_sub(plan.source, 'l')} LEFT JOIN {quoted(plan.table)} AS t ON {on or 'TRUE'}{kept}"
