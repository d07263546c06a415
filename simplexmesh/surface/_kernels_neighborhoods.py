"""Vertex neighborhoods: ordered one-rings, k-rings, and connected balls."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True)
def wedges(faces, n_vertices):
    """Return CSR (offsets, ahead, behind): the other two vertices of the triangles around each vertex, ccw."""
    offsets = np.zeros(n_vertices + 1, np.int64)
    for f in range(faces.shape[0]):
        for j in range(3):
            offsets[faces[f, j] + 1] += 1
    for i in range(n_vertices):
        offsets[i + 1] += offsets[i]
    ahead, behind = np.empty(offsets[n_vertices], np.int64), np.empty(offsets[n_vertices], np.int64)
    filled = offsets[:n_vertices].copy()
    for f in range(faces.shape[0]):
        for j in range(3):
            place = filled[faces[f, j]]
            ahead[place], behind[place] = faces[f, (j + 1) % 3], faces[f, (j + 2) % 3]
            filled[faces[f, j]] = place + 1
    return offsets, ahead, behind


@njit(cache=True)
def _walk_fan(begin, start, wedges, lists, out, place):
    """Follow a fan of triangles from the wedge `begin`, writing its vertices in order; return the next free place."""
    (ahead, behind), (first, later, free) = wedges, lists
    out[place], current = ahead[begin], begin
    while current >= 0:
        place += 1
        out[place] = end = behind[current]
        free[current - start] = False
        first[ahead[current]] = later[current - start]
        current = first[end]
    return place + 1


@njit(cache=True)
def _start_at_smallest(members, begin, end, rotated):
    """Rotate the cycle of these members in place so that it begins with the smallest; `rotated` is work space."""
    smallest = begin
    for k in range(begin + 1, end):
        if members[k] < members[smallest]:
            smallest = k
    if smallest == begin:
        return
    for k in range(begin, end):
        rotated[k - begin] = members[k]
    for k in range(begin, end):
        members[k] = rotated[(smallest - 2 * begin + k) % (end - begin)]


@njit(cache=True)
def ordered_rings(starts, ahead, behind):
    """Return (offsets, members, closed): one-rings ccw, cycles from their smallest member, several fans in a row."""
    n_vertices, most = starts.shape[0] - 1, 0
    for i in range(n_vertices):
        most = max(most, starts[i + 1] - starts[i])
    offsets, closed = np.zeros(n_vertices + 1, np.int64), np.zeros(n_vertices, np.bool_)
    members = np.empty(2 * ahead.shape[0], np.int64)
    first = np.full(n_vertices, -1, np.int64)  # linked lists of the free wedges that begin at a vertex: heads ...
    entered = np.full(n_vertices, -1, np.int64)  # the last center with a wedge that ends at the vertex
    seen = np.full(n_vertices, -1, np.int64)  # the last center with the vertex in its ring
    later, free = np.empty(most, np.int64), np.empty(most, np.bool_)  # ... and links
    rotated, place = np.empty(most, np.int64), offsets[0]  # numba would compile all twice for a plain 0
    for i in range(n_vertices):
        start, stop, fans = starts[i], starts[i + 1], 0
        for wedge in range(stop - 1, start - 1, -1):
            later[wedge - start], first[ahead[wedge]] = first[ahead[wedge]], wedge
            entered[behind[wedge]], free[wedge - start] = i, True
        for bordering in range(2):  # fans with a border first, then cycles
            for begin in range(start, stop):
                if not free[begin - start] or (bordering == 0 and entered[ahead[begin]] == i):
                    continue
                first_place, fans = place, fans + 1
                place = _walk_fan(begin, start, (ahead, behind), (first, later, free), members, place)
                closed[i] = bordering == 1 and fans == 1 and members[place - 1] == members[first_place]
                if members[place - 1] == members[first_place]:
                    place -= 1
                    _start_at_smallest(members, first_place, place, rotated)
        kept = offsets[i]
        for k in range(offsets[i], place):
            if seen[members[k]] != i:
                seen[members[k]] = i
                members[kept] = members[k]
                kept += 1
        closed[i] &= kept == place  # False at edges of three triangles, where the walk passes a vertex twice
        place = offsets[i + 1] = kept
    return offsets, members[:place].copy(), closed


@njit(cache=True)
def within(offsets, members, points, centers, steps, radius, most):
    """Return CSR (offsets, members) of the vertices so many edges away in a ball, over such, until more than `most`."""
    stamp = np.full(points.shape[0], -1, np.int64)
    starts = np.zeros(centers.shape[0] + 1, np.int64)
    found = np.empty(max(16, 8 * centers.shape[0]), np.int64)
    place = 0
    for row in range(centers.shape[0]):
        center = centers[row]
        stamp[center] = row
        start, ring, stop, step = place, place - 1, place, 0  # the center is before the first ring
        while ring < stop and step < steps:
            for k in range(ring, stop):
                i = found[k] if k >= start else center
                for m in range(offsets[i], offsets[i + 1]):
                    j = members[m]
                    if stamp[j] == row:
                        continue
                    stamp[j] = row
                    square = 0.0
                    for axis in range(3):
                        square += (points[j, axis] - points[center, axis]) ** 2
                    if square <= radius * radius:
                        if place == found.shape[0]:
                            found = np.concatenate((found, np.empty_like(found)))
                        found[place] = j
                        place += 1
            ring, stop, step = stop, place, step + 1
        starts[row + 1] = place
        if place > most:
            break
    return starts, found[:place].copy()
