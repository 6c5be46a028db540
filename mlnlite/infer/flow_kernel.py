"""Maximum flow, compiled (Boykov and Kolmogorov, An experimental comparison of min-cut/max-flow algorithms, 2004).

Two trees of nodes grow, from the source and from the sink, until they touch; flow is pushed along the path, and nodes
that it cuts off look for a new parent. The trees stay from one path to the next.
"""

from __future__ import annotations

import numpy as np

from mlnlite.infer.compiled import compiled


@compiled
def push(begin, head, sister, room, terminal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201, C901, PLR0915
    """Value of a maximum flow, and which nodes the source reaches in the end.

    Args:
        begin: shape (n + 1,), where the arcs of each node start.
        head: shape (m,), where each arc leads.
        sister: shape (m,), the arc the other way.
        room: shape (m,), capacity of each arc; what is left of it in the end.
        terminal: shape (n,), capacity from the source if positive, to the sink if negative; likewise.
    """
    n = len(terminal)
    free, source, sink = 0, 1, 2
    top, orphan, none = -1, -2, -3
    tree = np.zeros(n, np.int8)
    parent = np.full(n, none, np.int32)  # the arc from a node to its parent
    stamp = np.zeros(n, np.int64)
    depth = np.zeros(n, np.int32)
    queued = np.zeros(n, np.bool_)
    queue = np.empty(n, np.int32)
    first, n_queued = 0, 0
    orphans = np.empty(n, np.int32)
    time, flow = np.int64(1), np.int64(0)
    for v in range(n):
        if terminal[v] != 0:
            tree[v] = source if terminal[v] > 0 else sink
            parent[v], stamp[v], depth[v] = top, time, 1
            queue[n_queued], queued[v] = v, True
            n_queued += 1
    while n_queued > 0:
        v = queue[first]
        bridge = -1
        if tree[v] != free:
            for a in range(begin[v], begin[v + 1]):
                w = head[a]
                if (room[a] if tree[v] == source else room[sister[a]]) <= 0:
                    continue
                if tree[w] == free:
                    tree[w], parent[w], stamp[w], depth[w] = tree[v], sister[a], stamp[v], depth[v] + 1
                    if not queued[w]:
                        queue[(first + n_queued) % n], queued[w] = w, True
                        n_queued += 1
                elif tree[w] != tree[v]:
                    bridge = a if tree[v] == source else sister[a]
                    break
                elif stamp[w] <= stamp[v] and depth[w] > depth[v]:
                    parent[w], stamp[w], depth[w] = sister[a], stamp[v], depth[v] + 1
        if bridge < 0:
            queued[v] = False
            first = (first + 1) % n
            n_queued -= 1
            continue
        time += 1
        # the bottleneck of the path
        amount = room[bridge]
        w = head[sister[bridge]]
        while parent[w] != top:
            amount = min(amount, room[sister[parent[w]]])
            w = head[parent[w]]
        amount = min(amount, terminal[w])
        w = head[bridge]
        while parent[w] != top:
            amount = min(amount, room[parent[w]])
            w = head[parent[w]]
        amount = min(amount, -terminal[w])
        flow += amount
        # push
        n_orphans = 0
        room[bridge] -= amount
        room[sister[bridge]] += amount
        w = head[sister[bridge]]
        while parent[w] != top:
            a = parent[w]
            room[a] += amount
            room[sister[a]] -= amount
            if room[sister[a]] == 0:
                parent[w] = orphan
                orphans[n_orphans] = w
                n_orphans += 1
            w = head[a]
        terminal[w] -= amount
        if terminal[w] == 0:
            parent[w] = orphan
            orphans[n_orphans] = w
            n_orphans += 1
        w = head[bridge]
        while parent[w] != top:
            a = parent[w]
            room[sister[a]] += amount
            room[a] -= amount
            if room[a] == 0:
                parent[w] = orphan
                orphans[n_orphans] = w
                n_orphans += 1
            w = head[a]
        terminal[w] += amount
        if terminal[w] == 0:
            parent[w] = orphan
            orphans[n_orphans] = w
            n_orphans += 1
        # adopt
        while n_orphans > 0:
            n_orphans -= 1
            u = orphans[n_orphans]
            best, best_depth = none, np.int32(2147483647)
            for a in range(begin[u], begin[u + 1]):
                w = head[a]
                if tree[w] != tree[u] or parent[w] == none or parent[w] == orphan:
                    continue
                if (room[sister[a]] if tree[u] == source else room[a]) <= 0:
                    continue
                length, x = np.int32(0), w
                while True:
                    if stamp[x] == time:
                        length += depth[x]
                        break
                    length += 1
                    if parent[x] == top:
                        stamp[x], depth[x] = time, 1
                        break
                    if parent[x] == orphan or parent[x] == none:
                        length = np.int32(2147483647)
                        break
                    x = head[parent[x]]
                if length < best_depth:
                    best, best_depth = a, length
                    x = w
                    while stamp[x] != time:
                        stamp[x], depth[x] = time, length
                        length -= 1
                        x = head[parent[x]]
                elif length != 2147483647:
                    x = w
                    while stamp[x] != time:
                        stamp[x], depth[x] = time, length
                        length -= 1
                        x = head[parent[x]]
            if best != none:
                parent[u], stamp[u], depth[u] = best, time, best_depth + 1
                continue
            for a in range(begin[u], begin[u + 1]):
                w = head[a]
                if tree[w] != tree[u]:
                    continue
                if (room[sister[a]] if tree[u] == source else room[a]) > 0 and not queued[w]:
                    queue[(first + n_queued) % n], queued[w] = w, True
                    n_queued += 1
                if parent[w] >= 0 and head[parent[w]] == u:
                    parent[w] = orphan
                    orphans[n_orphans] = w
                    n_orphans += 1
            tree[u], parent[u] = free, none
    return flow, tree == source
