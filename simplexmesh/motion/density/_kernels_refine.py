"""Kernels of refinement: edge lengths and areas of faces, the best cut across a face, disjoint groups of faces."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit


@njit(cache=True, error_model="numpy", fastmath=FAST)
def lengths_and_areas(vertices, face_vertices, offsets, elongation, area):
    """Fill, for each face, 1 + (longest - shortest edge) / median edge, and the area of the fan around the centroid."""
    for f in range(offsets.size - 1):
        begin, m = offsets[f], offsets[f + 1] - offsets[f]
        lengths = np.zeros(m)
        x = y = z = 0.0
        for k in range(m):
            p = face_vertices[begin + k]
            x, y, z = x + vertices[p, 0] / m, y + vertices[p, 1] / m, z + vertices[p, 2] / m
        total = 0.0
        for k in range(m):
            p, q = face_vertices[begin + k], face_vertices[begin + (k + 1) % m]
            ax, ay, az = vertices[p, 0] - x, vertices[p, 1] - y, vertices[p, 2] - z
            bx, by, bz = vertices[q, 0] - x, vertices[q, 1] - y, vertices[q, 2] - z
            u, v, w = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            total += 0.5 * math.sqrt(u * u + v * v + w * w)
            length, place = math.sqrt((bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2), k
            while place > 0 and lengths[place - 1] > length:  # sorting takes numba a second to compile
                lengths[place] = lengths[place - 1]
                place -= 1
            lengths[place] = length
        median = 0.5 * (lengths[(m - 1) // 2] + lengths[m // 2])
        elongation[f] = 1.0 + ((lengths[m - 1] - lengths[0]) / median if median > 0.0 else 0.0)
        area[f] = total


@njit(cache=True, error_model="numpy", fastmath=FAST)
def best_cuts(vertices, twin, face, face_darts, offsets, may_grow, faces, out):
    """Fill the darts (m, 2) between whose midpoints each face is best halved, in a short cut by small faces; or -1."""
    for i in range(faces.size):
        begin, m = offsets[faces[i]], offsets[faces[i] + 1] - offsets[faces[i]]
        out[i, 0] = out[i, 1] = -1
        longest = 0.0
        for sweep in range(2):  # the longest candidate, then the cheapest
            least = np.inf
            for one in range(m):
                for step in range(m // 2, (m + 1) // 2 + 1):
                    other = (one + step) % m
                    d, e = face_darts[begin + one], face_darts[begin + other]
                    length2 = 0.0
                    for c in range(3):
                        gap = vertices[d // 3, c] + vertices[twin[d] // 3, c]
                        gap -= vertices[e // 3, c] + vertices[twin[e] // 3, c]
                        length2 += 0.25 * gap * gap
                    if sweep == 0:
                        longest = max(longest, math.sqrt(length2))
                        continue
                    across, beyond = face[twin[d]], face[twin[e]]
                    if not (may_grow[across] and may_grow[beyond]):
                        continue
                    sizes = offsets[across + 1] - offsets[across] + offsets[beyond + 1] - offsets[beyond]
                    cost = math.sqrt(length2) / longest + 0.1 * (sizes - 12)  # a cut adds a vertex to both faces across
                    if cost < least:
                        least = cost
                        out[i, 0], out[i, 1] = d, e


@njit(cache=True)
def disjoint_rows(groups, free, limit, out):
    """Fill and count the rows of `groups` (m, k), at most `limit`, chosen greedily so that no two share an entry."""
    count = 0
    for i in range(groups.shape[0]):
        if count == limit:
            break
        disjoint = True
        for k in range(groups.shape[1]):
            disjoint = disjoint and free[groups[i, k]]
        if disjoint:
            for k in range(groups.shape[1]):
                free[groups[i, k]] = False
            out[count] = i
            count += 1
    return count
