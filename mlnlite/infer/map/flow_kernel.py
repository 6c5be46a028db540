"""Maximum flow, compiled (Boykov and Kolmogorov, An experimental comparison of min-cut/max-flow algorithms, 2004).

Two trees of nodes grow, from the source and from the sink, until they touch; flow is pushed along the path, and nodes
that it cuts off look for a new parent. The trees stay from one path to the next.
"""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled

_TREE, _PARENT, _STAMP, _DEPTH = 0, 1, 2, 3  # what is kept of a node, side by side in memory
_FREE, _SOURCE, _SINK = 0, 1, 2
_TOP, _ORPHAN, _NONE = -1, -2, -3
_FAR = 2147483647


@compiled
def _grown(begin, head, sister, room, node, queue, queued, v, first, n_queued):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202, PLR0913
    """Grows the tree of a node by its free neighbours; returns an arc to the other tree, or -1, and `n_queued`."""
    n = len(node)
    for a in range(begin[v], begin[v + 1]):
        w = head[a]
        if (room[a] if node[v, _TREE] == _SOURCE else room[sister[a]]) <= 0:
            continue
        if node[w, _TREE] == _FREE:
            node[w, _TREE], node[w, _PARENT] = node[v, _TREE], sister[a]
            node[w, _STAMP], node[w, _DEPTH] = node[v, _STAMP], node[v, _DEPTH] + 1
            if not queued[w]:
                queue[(first + n_queued) % n], queued[w] = w, True
                n_queued += 1
        elif node[w, _TREE] != node[v, _TREE]:
            return (a if node[v, _TREE] == _SOURCE else sister[a]), n_queued
        elif node[w, _STAMP] <= node[v, _STAMP] and node[w, _DEPTH] > node[v, _DEPTH]:
            node[w, _PARENT], node[w, _STAMP], node[w, _DEPTH] = sister[a], node[v, _STAMP], node[v, _DEPTH] + 1
    return -1, n_queued


@compiled
def _bottleneck(head, sister, room, terminal, node, bridge):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """The most that the path over a bridge can take."""
    amount = room[bridge]
    w = head[sister[bridge]]
    while node[w, _PARENT] != _TOP:
        amount = min(amount, room[sister[node[w, _PARENT]]])
        w = head[node[w, _PARENT]]
    amount = min(amount, terminal[w])
    w = head[bridge]
    while node[w, _PARENT] != _TOP:
        amount = min(amount, room[node[w, _PARENT]])
        w = head[node[w, _PARENT]]
    return min(amount, -terminal[w])


@compiled
def _sent(head, sister, room, terminal, node, orphans, n_orphans, w, amount, is_source):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202, PLR0913
    """Sends flow between a node and the root of its tree; returns how many orphans there are then."""
    while node[w, _PARENT] != _TOP:
        a = node[w, _PARENT]
        along, against = (sister[a], a) if is_source else (a, sister[a])
        room[along] -= amount
        room[against] += amount
        if room[along] == 0:
            node[w, _PARENT] = _ORPHAN
            orphans[n_orphans] = w
            n_orphans += 1
        w = head[a]
    terminal[w] += -amount if is_source else amount
    if terminal[w] == 0:
        node[w, _PARENT] = _ORPHAN
        orphans[n_orphans] = w
        n_orphans += 1
    return n_orphans


@compiled
def _distance(head, node, time, w):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """How many nodes there are from a node to its root, both included; `_FAR` if it has none."""
    length, x = 0, w
    while node[x, _STAMP] != time:
        length += 1
        if node[x, _PARENT] == _TOP:
            node[x, _STAMP], node[x, _DEPTH] = time, 1
            return length
        if node[x, _PARENT] == _ORPHAN or node[x, _PARENT] == _NONE:
            return _FAR
        x = head[node[x, _PARENT]]
    return length + node[x, _DEPTH]


@compiled
def _new_parent(begin, head, sister, room, node, time, u):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """The arc to the nearest node that can be parent of an orphan, or `_NONE`, and how far from the root it is."""
    best, best_depth = _NONE, _FAR
    for a in range(begin[u], begin[u + 1]):
        w = head[a]
        if node[w, _TREE] != node[u, _TREE] or node[w, _PARENT] == _NONE or node[w, _PARENT] == _ORPHAN:
            continue
        if (room[sister[a]] if node[u, _TREE] == _SOURCE else room[a]) <= 0:
            continue
        length = _distance(head, node, time, w)
        if length == _FAR:
            continue
        if length < best_depth:
            best, best_depth = a, length
        while node[w, _STAMP] != time:
            node[w, _STAMP], node[w, _DEPTH] = time, length
            length -= 1
            w = head[node[w, _PARENT]]
    return best, best_depth


@compiled
def _freed(begin, head, sister, room, node, queue, queued, orphans, u, first, n_queued, n_orphans):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202, PLR0913
    """Lets an orphan go: its children are orphans, its neighbours grow again; returns `n_queued` and `n_orphans`."""
    n = len(node)
    for a in range(begin[u], begin[u + 1]):
        w = head[a]
        if node[w, _TREE] != node[u, _TREE]:
            continue
        if (room[sister[a]] if node[u, _TREE] == _SOURCE else room[a]) > 0 and not queued[w]:
            queue[(first + n_queued) % n], queued[w] = w, True
            n_queued += 1
        if node[w, _PARENT] >= 0 and head[node[w, _PARENT]] == u:
            node[w, _PARENT] = _ORPHAN
            orphans[n_orphans] = w
            n_orphans += 1
    node[u, _TREE], node[u, _PARENT] = _FREE, _NONE
    return n_queued, n_orphans


@compiled
def arcs(n, first, second, capacity):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Arcs both ways between pairs of nodes, node by node.

    Args:
        n: number of nodes.
        first: shape (n_pairs,).
        second: shape (n_pairs,).
        capacity: shape (n_pairs,), of each way.

    Returns:
        Shape (n + 1,), where the arcs of each node start; shapes (2 n_pairs,): where each arc leads, the arc the
        other way, and capacity.
    """
    begin = np.zeros(n + 1, np.int32)
    for i in range(len(first)):
        begin[first[i] + 1] += 1
        begin[second[i] + 1] += 1
    for v in range(n):
        begin[v + 1] += begin[v]
    place, m = begin[:-1].copy(), 2 * len(first)
    head, sister, room = np.empty(m, np.int32), np.empty(m, np.int32), np.empty(m, np.int64)
    for i in range(len(first)):
        v, w = first[i], second[i]
        a, b = place[v], place[w]
        place[v], place[w] = a + 1, b + 1
        head[a], head[b], sister[a], sister[b] = w, v, b, a
        room[a], room[b] = capacity[i], capacity[i]
    return begin, head, sister, room


@compiled
def greedy(begin, head, sister, room, terminal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Pushes flow from each node that the source feeds straight to neighbours that feed the sink; returns how much."""
    flow = np.int64(0)
    for v in range(len(terminal)):
        for a in range(begin[v], begin[v + 1]):
            if terminal[v] <= 0:
                break
            amount = min(terminal[v], room[a], -terminal[head[a]])
            if amount > 0:
                terminal[v] -= amount
                terminal[head[a]] += amount
                room[a] -= amount
                room[sister[a]] += amount
                flow += amount
    return flow


@compiled
def seeds(terminal, flow):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Trees of which no branch has grown yet, and the nodes to grow.

    Args:
        terminal: shape (n,), capacity from the source if positive, to the sink if negative.
        flow: how much flows already.

    Returns:
        Shape (n, 4), the tree of each node, the arc to its parent, when its depth was worked out, and that depth; shape
        (n,), which nodes are in the queue; shape (n,), the queue, a ring; shape (4,), its first place, its length, the
        time, and the flow so far.
    """
    n = len(terminal)
    queued = np.zeros(n, np.bool_)
    node = np.zeros((n, 4), np.int64)
    node[:, _PARENT] = _NONE
    queue, at = np.empty(n, np.int32), np.zeros(4, np.int64)
    n_queued = 0
    for v in range(n):
        if terminal[v] != 0:
            node[v, _TREE] = _SOURCE if terminal[v] > 0 else _SINK
            node[v, _PARENT], node[v, _STAMP], node[v, _DEPTH] = _TOP, 1, 1
            queue[n_queued], queued[v] = v, True
            n_queued += 1
    at[1], at[2], at[3] = n_queued, 1, flow
    return node, queued, queue, at


@compiled
def push(begin, head, sister, room, terminal, node, queued, queue, at, steps):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201, PLR0913
    """Pushes flow along so many paths, or until there is none; everything changes in place.

    Args:
        begin: shape (n + 1,), where the arcs of each node start.
        head: shape (m,), where each arc leads.
        sister: shape (m,), the arc the other way.
        room: shape (m,), what is left of the capacity of each arc.
        terminal: shape (n,), what is left from the source if positive, to the sink if negative.
        node: this and the following: see `seeds`. The flow is maximal once the queue is empty; then the tree of the
            source has all nodes that the source reaches.
        queued: likewise.
        queue: likewise.
        at: likewise.
        steps: how many paths at most.
    """
    n = len(node)
    orphans = np.empty(n, np.int32)
    first, n_queued, time, flow = at[0], at[1], at[2], at[3]
    while n_queued > 0 and steps > 0:
        v, bridge = queue[first], -1
        if node[v, _TREE] != _FREE:
            bridge, n_queued = _grown(begin, head, sister, room, node, queue, queued, v, first, n_queued)
        if bridge < 0:
            queued[v], first, n_queued = False, (first + 1) % n, n_queued - 1
            continue
        time, steps = time + 1, steps - 1
        amount = _bottleneck(head, sister, room, terminal, node, bridge)
        flow += amount
        room[bridge] -= amount
        room[sister[bridge]] += amount
        start, end = head[sister[bridge]], head[bridge]
        n_orphans = _sent(head, sister, room, terminal, node, orphans, 0, start, amount, True)
        n_orphans = _sent(head, sister, room, terminal, node, orphans, n_orphans, end, amount, False)
        while n_orphans > 0:
            n_orphans -= 1
            u = orphans[n_orphans]
            arc, far = _new_parent(begin, head, sister, room, node, time, u)
            if arc != _NONE:
                node[u, _PARENT], node[u, _STAMP], node[u, _DEPTH] = arc, time, far + 1
                continue
            n_queued, n_orphans = _freed(
                begin, head, sister, room, node, queue, queued, orphans, u, first, n_queued, n_orphans
            )
    at[0], at[1], at[2], at[3] = first, n_queued, time, flow
