"""Kernels of the boundary: the outlines of holes, closed polygons in space under the force of 1-simplex meshes."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_both import FAST
from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Indices32
from simplexmesh.motion.model._kernels_step import FREE, ORIENTATION, SHAPE, advance


class Outlines(NamedTuple):
    """The vertices on holes, each with its neighbors along its hole."""

    vertices: Indices32  # (m,)
    before: Indices32  # (m,) rows of `vertices`: the previous one along the same hole
    after: Indices32  # (m,) and the next one


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _curvatures(vertices, outlines, bend, tangent):
    """Fill the curvature vector, pointing from the chord to the vertex, and the unit chord (m, 3) of each row."""
    rows, before, after = outlines
    for k in range(rows.shape[0]):
        p, a, b = vertices[rows[k]], vertices[rows[before[k]]], vertices[rows[after[k]]]
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
def _transported_mean(k, outlines, bend, tangent, wanted):
    """Fill the weighted mean of a vertex's curvature vector and its neighbors', parallel-transported to its chord."""
    for j in range(3):
        wanted[j] = 0.5 * bend[k, j]
    for other in (outlines.before[k], outlines.after[k]):
        cosine = crossing = 0.0
        for j in range(3):
            cosine += tangent[k, j] * tangent[other, j]
            crossing += tangent[k, j] * bend[other, j]
        if cosine > -0.9:
            for j in range(3):
                transported = bend[other, j] - crossing / (1.0 + cosine) * (tangent[k, j] + tangent[other, j])
                wanted[j] += 0.25 * transported


@njit(cache=True, error_model="numpy", fastmath=FAST)
def boundary_goals(vertices, outlines, constraint, restored, out):
    """Fill the goal (m, 3) of the internal force of each row: between its neighbors, at its constraint's height."""
    rows, before, after = outlines
    bend, tangent, wanted = np.empty((len(rows), 3)), np.empty((len(rows), 3)), np.empty(3)
    _curvatures(vertices, outlines, bend, tangent)
    for k in range(rows.shape[0]):
        i = rows[k]
        p, a, b = vertices[i], vertices[rows[before[k]]], vertices[rows[after[k]]]
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
            _transported_mean(k, outlines, bend, tangent, wanted)
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
def boundary_step(boundary_vertices, moving, normals, goals, extra, forces, out):
    """Fill the rows of a `Step` of boundary vertices from the goals (m, 3) of their internal force."""
    vertices, neighbors = moving.vertices, moving.neighbors
    for k in range(boundary_vertices.shape[0]):
        i = boundary_vertices[k]
        star2 = 0.0
        for n in range(3):
            for j in range(3):
                star2 += (vertices[neighbors[i, n], j] - vertices[i, j]) ** 2
        force = (goals[k, 0] - vertices[i, 0], goals[k, 1] - vertices[i, 1], goals[k, 2] - vertices[i, 2])
        push = (extra[i, 0], extra[i, 1], extra[i, 2])
        advance(i, moving, normals, force, push, math.sqrt(star2 / 3.0), forces, out)
