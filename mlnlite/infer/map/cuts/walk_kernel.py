"""Short closed walks along which pairs cannot differ as they seem to; compiled.

A graph has two copies of each node, `2 v` and `2 v + 1`; an odd step leads to the other copy. A step costs `x` of its
column, an odd one `1 - x`.
"""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np

from mlnlite.compiled import compiled


@compiled
def explore(begin, other, column, x, source, hub, distance, before, by):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201, PLR0913
    """Dijkstra from a source to all that is nearer than 1/2; passes no hub unless that is the source.

    Args:
        begin: as in `odd_walks`; likewise `other`, `column`, `x`, `hub`.
        other: see there.
        column: see there.
        x: see there.
        source: where to start.
        hub: see there.
        distance: shape (2 n,), infinity; filled in here, as are the node before each and the column of the step.
        before: shape (2 n,), -1.
        by: shape (2 n,), -1.

    Returns:
        What was reached.
    """
    reached, heap = [2 * source], [(0.0, 2 * source)]
    distance[2 * source] = 0.0
    while heap:
        so_far, a = heappop(heap)
        if so_far > distance[a]:
            continue
        for i in range(begin[a // 2], begin[a // 2 + 1]):
            for odd in range(2):
                b = 2 * other[i] + ((a & 1) ^ odd)
                length = so_far + (1 - x[column[i]] if odd else x[column[i]])
                if length < min(0.5, distance[b]) and (other[i] != hub or source == hub):
                    if np.isinf(distance[b]):
                        reached.append(b)
                    distance[b], before[b], by[b] = length, a, column[i]
                    heappush(heap, (length, b))
    return reached


@compiled
def close(begin, other, column, x, reached, every, distance, total, ends):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201, PLR0913
    """The best step between two shortest paths that makes an odd closed walk: one in all, or one for every column.

    Args:
        begin: as in `odd_walks`; likewise `other`, `column`, `x`.
        other: see there.
        column: see there.
        x: see there.
        reached: where the paths end.
        every: whether one for every column.
        distance: as `explore` leaves it.
        total: shape (m,), longest walk of interest; filled in here, as are both ends and twice the column (1 more if
            odd).
        ends: shape (m, 3), -1.

    Returns:
        Where something was found.
    """
    found = reached[:0]
    for a in reached:
        for i in range(begin[a // 2], begin[a // 2 + 1]):
            slot = column[i] if every else 0
            for odd in range(2):
                b = 2 * other[i] + (1 - ((a & 1) ^ odd))
                length = distance[a] + distance[b] + (1 - x[column[i]] if odd else x[column[i]])
                if length < total[slot]:
                    if ends[slot, 0] < 0:
                        found.append(slot)
                    total[slot], ends[slot, 0], ends[slot, 1], ends[slot, 2] = length, a, b, 2 * column[i] + odd
    return found


@compiled
def odd_walks(begin, other, column, x, sources, hub, least):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Shortest closed walks of less than 1 with an odd number of odd steps.

    The best one through each source that does not pass the hub; if the hub is a source, the best one for each column.
    Both ends of a step are reached from the source; what their paths have in common is left out.

    Args:
        begin: shape (n + 1,), where the neighbours of each node start.
        other: shape (2 m,), the neighbour.
        column: shape (2 m,), of the pair.
        x: shape (m,), between 0 and 1.
        sources: shape (n_sources,), nodes to go through.
        hub: a node with very many neighbours.
        least: by how much a walk must be shorter than 1.

    Returns:
        Shape (n_walks,), by how much each is shorter; where each starts; for each step twice its column, 1 more if odd.
    """
    n = len(begin) - 1
    distance, before, by = np.full(2 * n, np.inf), np.full(2 * n, -1), np.full(2 * n, -1)
    total, ends = np.full(len(x), 1 - least), np.full((len(x), 3), -1)
    above, start, steps = [0.0 for _ in range(0)], [0], [0 for _ in range(0)]
    for source in sources:
        reached = explore(begin, other, column, x, source, hub, distance, before, by)
        for slot in close(begin, other, column, x, reached, source == hub, distance, total, ends):
            left, right = [ends[slot, 0]], [ends[slot, 1]]
            for path in (left, right):
                while before[path[-1]] >= 0:
                    path.append(before[path[-1]])
            while len(left) > 1 and len(right) > 1 and left[-2] == right[-2]:
                left.pop()
                right.pop()
            steps.append(ends[slot, 2])
            for path in (left, right):
                for i in range(len(path) - 1):
                    steps.append(2 * by[path[i]] + ((path[i] ^ path[i + 1]) & 1))
            above.append(1 - total[slot])
            start.append(len(steps))
            total[slot], ends[slot, 0] = 1 - least, -1
        for a in reached:
            distance[a], before[a], by[a] = np.inf, -1, -1
    return np.array(above), np.array(start), np.array(steps)
