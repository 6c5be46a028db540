"""Maximum flow, compiled (Boykov and Kolmogorov, An experimental comparison of min-cut/max-flow algorithms, 2004).

Two trees of nodes grow, from the source and from the sink, until they touch; flow is pushed along the path, and nodes
that it cuts off look for a new parent. The trees stay from one path to the next.
"""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled

_FREE, _SOURCE, _SINK = 0, 1, 2
_TOP, _ORPHAN, _NONE = -1, -2, -3
_FAR = 2147483647


@compiled
def _grown(begin, head, sister, room, tree, parent, stamp, depth, queue, queued, v, first, n_queued):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202, PLR0913
    """Grows the tree of a node by its free neighbours; returns an arc to the other tree, or -1, and `n_queued`."""
    n = len(tree)
    for a in range(begin[v], begin[v + 1]):
        w = head[a]
        if (room[a] if tree[v] == _SOURCE else room[sister[a]]) <= 0:
            continue
        if tree[w] == _FREE:
            tree[w], parent[w], stamp[w], depth[w] = tree[v], sister[a], stamp[v], depth[v] + 1
            if not queued[w]:
                queue[(first + n_queued) % n], queued[w] = w, True
                n_queued += 1
        elif tree[w] != tree[v]:
            return (a if tree[v] == _SOURCE else sister[a]), n_queued
        elif stamp[w] <= stamp[v] and depth[w] > depth[v]:
            parent[w], stamp[w], depth[w] = sister[a], stamp[v], depth[v] + 1
    return -1, n_queued


@compiled
def _bottleneck(head, sister, room, terminal, parent, bridge):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """The most that the path over a bridge can take."""
    amount = room[bridge]
    w = head[sister[bridge]]
    while parent[w] != _TOP:
        amount = min(amount, room[sister[parent[w]]])
        w = head[parent[w]]
    amount = min(amount, terminal[w])
    w = head[bridge]
    while parent[w] != _TOP:
        amount = min(amount, room[parent[w]])
        w = head[parent[w]]
    return min(amount, -terminal[w])


@compiled
def _sent(head, sister, room, terminal, parent, orphans, n_orphans, w, amount, is_source):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202, PLR0913
    """Sends flow between a node and the root of its tree; returns how many orphans there are then."""
    while parent[w] != _TOP:
        a = parent[w]
        along, against = (sister[a], a) if is_source else (a, sister[a])
        room[along] -= amount
        room[against] += amount
        if room[along] == 0:
            parent[w] = _ORPHAN
            orphans[n_orphans] = w
            n_orphans += 1
        w = head[a]
    terminal[w] += -amount if is_source else amount
    if terminal[w] == 0:
        parent[w] = _ORPHAN
        orphans[n_orphans] = w
        n_orphans += 1
    return n_orphans


@compiled
def _distance(head, parent, stamp, depth, time, w):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """How many nodes there are from a node to its root, both included; `_FAR` if it has none."""
    length, x = np.int32(0), w
    while stamp[x] != time:
        length += 1
        if parent[x] == _TOP:
            stamp[x], depth[x] = time, 1
            return length
        if parent[x] == _ORPHAN or parent[x] == _NONE:
            return np.int32(_FAR)
        x = head[parent[x]]
    return length + depth[x]


@compiled
def _new_parent(begin, head, sister, room, tree, parent, stamp, depth, time, u):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202, PLR0913
    """The arc to the nearest node that can be parent of an orphan, or `_NONE`, and how far from the root it is."""
    best, best_depth = _NONE, np.int32(_FAR)
    for a in range(begin[u], begin[u + 1]):
        w = head[a]
        if tree[w] != tree[u] or parent[w] == _NONE or parent[w] == _ORPHAN:
            continue
        if (room[sister[a]] if tree[u] == _SOURCE else room[a]) <= 0:
            continue
        length = _distance(head, parent, stamp, depth, time, w)
        if length == _FAR:
            continue
        if length < best_depth:
            best, best_depth = a, length
        while stamp[w] != time:
            stamp[w], depth[w] = time, length
            length -= 1
            w = head[parent[w]]
    return best, best_depth


@compiled
def _freed(begin, head, sister, room, tree, parent, queue, queued, orphans, u, first, n_queued, n_orphans):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202, PLR0913
    """Lets an orphan go: its children are orphans, its neighbours grow again; returns `n_queued` and `n_orphans`."""
    n = len(tree)
    for a in range(begin[u], begin[u + 1]):
        w = head[a]
        if tree[w] != tree[u]:
            continue
        if (room[sister[a]] if tree[u] == _SOURCE else room[a]) > 0 and not queued[w]:
            queue[(first + n_queued) % n], queued[w] = w, True
            n_queued += 1
        if parent[w] >= 0 and head[parent[w]] == u:
            parent[w] = _ORPHAN
            orphans[n_orphans] = w
            n_orphans += 1
    tree[u], parent[u] = _FREE, _NONE
    return n_queued, n_orphans


@compiled
def push(begin, head, sister, room, terminal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Value of a maximum flow, and which nodes the source reaches in the end.

    Args:
        begin: shape (n + 1,), where the arcs of each node start.
        head: shape (m,), where each arc leads.
        sister: shape (m,), the arc the other way.
        room: shape (m,), capacity of each arc; what is left of it in the end.
        terminal: shape (n,), capacity from the source if positive, to the sink if negative; likewise.
    """
    n = len(terminal)
    tree, queued = np.zeros(n, np.int8), np.zeros(n, np.bool_)
    parent = np.full(n, _NONE, np.int32)  # the arc from a node to its parent
    stamp, depth = np.zeros(n, np.int64), np.zeros(n, np.int32)
    queue, orphans = np.empty(n, np.int32), np.empty(n, np.int32)
    first, n_queued = 0, 0
    time, flow = np.int64(1), np.int64(0)
    for v in range(n):
        if terminal[v] != 0:
            tree[v] = _SOURCE if terminal[v] > 0 else _SINK
            parent[v], stamp[v], depth[v] = _TOP, time, 1
            queue[n_queued], queued[v] = v, True
            n_queued += 1
    while n_queued > 0:
        v, bridge = queue[first], -1
        if tree[v] != _FREE:
            bridge, n_queued = _grown(
                begin, head, sister, room, tree, parent, stamp, depth, queue, queued, v, first, n_queued
            )
        if bridge < 0:
            queued[v], first, n_queued = False, (first + 1) % n, n_queued - 1
            continue
        time += 1
        amount = _bottleneck(head, sister, room, terminal, parent, bridge)
        flow += amount
        room[bridge] -= amount
        room[sister[bridge]] += amount
        start, end = head[sister[bridge]], head[bridge]
        n_orphans = _sent(head, sister, room, terminal, parent, orphans, 0, start, amount, True)
        n_orphans = _sent(head, sister, room, terminal, parent, orphans, n_orphans, end, amount, False)
        while n_orphans > 0:
            n_orphans -= 1
            u = orphans[n_orphans]
            arc, far = _new_parent(begin, head, sister, room, tree, parent, stamp, depth, time, u)
            if arc != _NONE:
                parent[u], stamp[u], depth[u] = arc, time, far + 1
                continue
            n_queued, n_orphans = _freed(
                begin, head, sister, room, tree, parent, queue, queued, orphans, u, first, n_queued, n_orphans
            )
    return flow, tree == _SOURCE
