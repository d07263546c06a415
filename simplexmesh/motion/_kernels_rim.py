"""Kernels of the rims of holes, closed polygons in space under the internal force of 1-simplex meshes.

`rim[k]` is a vertex, `before[k]` and `after[k]` are the rows of `rim` with its neighbors along the hole.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._kernels_both import FAST
from simplexmesh._kernels_njit import njit
from simplexmesh.motion._kernels import FREE, ORIENTATION, SHAPE


@njit(cache=True, error_model="numpy", fastmath=FAST)
def rim_curvatures(vertices, rim, before, after, bend, tangent):
    """Fill the unit chord and the curvature vector, pointing from the chord to the vertex, of each rim vertex."""
    for k in range(rim.shape[0]):
        p, a, b = vertices[rim[k]], vertices[rim[before[k]]], vertices[rim[after[k]]]
        chord2 = 0.0
        for j in range(3):
            chord2 += (b[j] - a[j]) ** 2
        along = 0.0
        chord = math.sqrt(chord2)
        for j in range(3):
            tangent[k, j] = (b[j] - a[j]) / chord if chord > 0.0 else 0.0
            along += (p[j] - 0.5 * (a[j] + b[j])) * tangent[k, j]
        size2 = 0.0
        for j in range(3):
            bend[k, j] = p[j] - 0.5 * (a[j] + b[j]) - along * tangent[k, j]
            size2 += bend[k, j] ** 2
        r2 = 0.25 * chord2
        power = r2 - along * along - size2
        radius_term = math.sqrt(4.0 * size2 * r2 + power * power)
        scale = 2.0 / radius_term if radius_term > 0.0 else 0.0
        for j in range(3):
            bend[k, j] *= scale


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _transported_mean(k, before, after, bend, tangent, wanted):
    """Fill the weighted mean of a vertex's curvature vector and its neighbors', parallel-transported to its chord."""
    for j in range(3):
        wanted[j] = 0.5 * bend[k, j]
    for other in (before[k], after[k]):
        cosine = crossing = 0.0
        for j in range(3):
            cosine += tangent[k, j] * tangent[other, j]
            crossing += tangent[k, j] * bend[other, j]
        if cosine > -0.9:
            for j in range(3):
                transported = bend[other, j] - crossing / (1.0 + cosine) * (tangent[k, j] + tangent[other, j])
                wanted[j] += 0.25 * transported


@njit(cache=True, error_model="numpy", fastmath=FAST)
def rim_goals(vertices, rim, before, after, constraint, restored, bend, tangent, wanted, out):
    """Fill the goal of the internal force at each rim vertex: midway between its neighbors, at its constraint's height.

    Its present curvature under `free`, zero curvature under `orientation`, the `restored` position under `shape`, and
    curvature averaged along the rim under all others, so that circles are at rest.
    """
    rim_curvatures(vertices, rim, before, after, bend, tangent)
    for k in range(rim.shape[0]):
        i = rim[k]
        p, a, b = vertices[i], vertices[rim[before[k]]], vertices[rim[after[k]]]
        kind = constraint[i]
        for j in range(3):
            out[k, j] = 0.5 * (a[j] + b[j])
        if kind == ORIENTATION:
            continue
        if kind == SHAPE:
            out[k] = restored[k]
            continue
        if kind == FREE:
            wanted[:] = bend[k]
        else:
            _transported_mean(k, before, after, bend, tangent, wanted)
        size2 = r2 = from_middle2 = aside2 = 0.0
        for j in range(3):
            size2 += wanted[j] ** 2
            r2 += 0.25 * (b[j] - a[j]) ** 2
            from_middle2 += (p[j] - 0.5 * (a[j] + b[j])) ** 2
            aside2 += 0.5 * ((p[j] - a[j]) ** 2 + (p[j] - b[j]) ** 2)
        sine2 = size2 * r2
        height = r2 / (1.0 + math.sqrt(1.0 - sine2)) if sine2 < 1.0 else r2 / math.sqrt(sine2)
        if kind == FREE and from_middle2 > r2:  # an angle beyond pi/2: the far side of the circle
            height = (1.0 + math.sqrt(max(1.0 - sine2, 0.0))) / size2 if size2 > 0.0 else 0.0
            height = min(height, math.sqrt(aside2 / size2)) if size2 > 0.0 else 0.0
        for j in range(3):
            out[k, j] += height * wanted[j]


@njit(cache=True, error_model="numpy", fastmath=FAST)
def rim_step(
    vertices, previous, neighbors, normals, rim, goals, extra, gaps, alpha, beta, damping, out, moves, energy
):  # fmt: skip
    """Fill the next positions of rim vertices, by the law of motion and with the safeguards of all other vertices."""
    for k in range(rim.shape[0]):
        i = rim[k]
        agreement = star2 = force2 = 0.0
        for n in range(3):
            for j in range(3):
                agreement += normals[i, j] * normals[neighbors[i, n], j]
                star2 += (vertices[neighbors[i, n], j] - vertices[i, j]) ** 2
        attracted = gaps[i] == gaps[i] and agreement > 0.0
        gap = gaps[i] if attracted else 0.0
        step2 = 0.0
        for j in range(3):
            force = goals[k, j] - vertices[i, j]
            force2 += force * force
            step = (1.0 - damping[i]) * (vertices[i, j] - previous[i, j]) + alpha[i] * force
            step += extra[i, j] + (beta[i] * gap * normals[i, j] if attracted else 0.0)
            out[i, j] = step
            step2 += step * step
        limit2 = star2 / 12.0  # half the root mean square distance, squared
        shrink = math.sqrt(limit2 / step2) if limit2 < step2 < math.inf else 1.0
        for j in range(3):
            out[i, j] = vertices[i, j] + shrink * out[i, j]
        moves[i] = min(limit2, step2) if step2 < math.inf else step2
        energy[i] = 0.5 * (alpha[i] * force2 + beta[i] * gap * gap)
