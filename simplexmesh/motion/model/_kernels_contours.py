"""Kernels of contours: polygons in a plane or in space, closed or open, under the force of 1-simplex meshes.

H. Delingette, thesis, 1994, sections 3.1 and 4.7 and 4.8.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base.arrays import Array, Indices32
from simplexmesh.motion.model._kernels_step import FREE, ORIENTATION, SHAPE, advance


class Courses(NamedTuple):
    """The vertices of contours, each with its neighbors along its own; at an end of an open one these are itself."""

    vertices: Indices32  # (m,)
    before: Indices32  # (m,) rows of `vertices`: the previous one along the same contour
    after: Indices32  # (m,) and the next one


class Shapes(NamedTuple):
    """What is prescribed of the shape of contours."""

    curvature: Array  # (m,) NaN for the mean of the neighbors
    torsion: Array  # (m,) the angle psi of Delingette's (3.17), NaN for the direction of the mean curvature vector
    plane: Array  # (m, 3) unit normal of the plane of a contour with a planar frame (3.8), otherwise zero


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _curvatures(vertices, courses, bend, tangent):
    """Fill the curvature vector, pointing from the chord to the vertex, and the unit chord (m, 3) of each row."""
    rows, before, after = courses
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
def _transported_mean(k, courses, bend, tangent, wanted):
    """Fill the weighted mean of a vertex's curvature vector and its neighbors', parallel-transported to its chord."""
    for j in range(3):
        wanted[j] = 0.5 * bend[k, j]
    for other in (courses.before[k], courses.after[k]):
        if courses.before[other] == other:  # an end has no curvature
            for j in range(3):
                wanted[j] += 0.25 * bend[k, j]
            continue
        cosine = crossing = 0.0
        for j in range(3):
            cosine += tangent[k, j] * tangent[other, j]
            crossing += tangent[k, j] * bend[other, j]
        if cosine > -0.9:
            for j in range(3):
                transported = bend[other, j] - crossing / (1.0 + cosine) * (tangent[k, j] + tangent[other, j])
                wanted[j] += 0.25 * transported


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _in_plane(k, courses, normal, bend, tangent, prescribed, wanted):
    """Fill the curvature vector in a plane: prescribed, or the mean; positive to the right, as of a loop around."""
    total = weights = 0.0
    rows = (np.int64(k), np.int64(courses.before[k]), np.int64(courses.after[k]))
    for place in range(3):
        row = rows[place]
        if courses.before[row] != row:
            weight = 0.5 if place == 0 else 0.25
            t, b = tangent[row], bend[row]
            total += weight * (
                b[0] * (t[1] * normal[2] - t[2] * normal[1])
                + b[1] * (t[2] * normal[0] - t[0] * normal[2])
                + b[2] * (t[0] * normal[1] - t[1] * normal[0])
            )
            weights += weight
    size = total / weights if prescribed != prescribed else prescribed
    t = tangent[k]
    wanted[0] = size * (t[1] * normal[2] - t[2] * normal[1])
    wanted[1] = size * (t[2] * normal[0] - t[0] * normal[2])
    wanted[2] = size * (t[0] * normal[1] - t[1] * normal[0])


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _turned(k, vertices, courses, tangent, psi, wanted):
    """Turn the wanted curvature vector to the torsion angle psi (3.17), if the four neighbors define it."""
    rows, before, after = courses
    first, last = before[before[k]], after[after[k]]
    if first == before[k] or last == after[k]:
        return
    a, b, c, d = vertices[rows[first]], vertices[rows[before[k]]], vertices[rows[after[k]]], vertices[rows[last]]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    wx, wy, wz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    t = tangent[k]
    rx, ry, rz = t[1] * wz - t[2] * wy, t[2] * wx - t[0] * wz, t[0] * wy - t[1] * wx
    size = math.sqrt(rx * rx + ry * ry + rz * rz)
    if size <= 1e-12 * math.sqrt((ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)):
        return
    if rx * wanted[0] + ry * wanted[1] + rz * wanted[2] < 0.0:  # edges that turn by more than pi
        size = -size
    rx, ry, rz = rx / size, ry / size, rz / size
    length = math.sqrt(wanted[0] ** 2 + wanted[1] ** 2 + wanted[2] ** 2)
    cosine, sine = length * math.cos(psi), length * math.sin(psi)
    wanted[0] = cosine * rx + sine * (t[1] * rz - t[2] * ry)
    wanted[1] = cosine * ry + sine * (t[2] * rx - t[0] * rz)
    wanted[2] = cosine * rz + sine * (t[0] * ry - t[1] * rx)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _prescribed(k, vertices, courses, shapes, bend, tangent, wanted):
    """Fill the curvature vector that the shape of a row and its neighbors want."""
    plane, curvature, psi = shapes.plane[k], shapes.curvature[k], shapes.torsion[k]
    if plane[0] != 0.0 or plane[1] != 0.0 or plane[2] != 0.0:
        _in_plane(k, courses, plane, bend, tangent, curvature, wanted)
        return
    _transported_mean(k, courses, bend, tangent, wanted)
    if curvature == curvature:
        size = math.sqrt(wanted[0] ** 2 + wanted[1] ** 2 + wanted[2] ** 2)
        for j in range(3):
            wanted[j] *= curvature / size if size > 0.0 else 0.0
    if psi == psi:
        _turned(k, vertices, courses, tangent, psi, wanted)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def contour_goals(vertices, courses, shapes, constraint, restored, out):
    """Fill the goal (m, 3) of the internal force of each row: between its neighbors, at its constraint's height."""
    rows, before, after = courses
    bend, tangent, wanted = np.empty((len(rows), 3)), np.empty((len(rows), 3)), np.empty(3)
    _curvatures(vertices, courses, bend, tangent)
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
            _prescribed(k, vertices, courses, shapes, bend, tangent, wanted)
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
def contour_step(courses, moving, normals, goals, extra, forces, out):
    """Fill the rows of a `Step` of vertices on contours, except ends, from the goals (m, 3) of their internal force."""
    vertices, neighbors = moving.vertices, moving.neighbors
    for k in range(courses.vertices.shape[0]):
        i = courses.vertices[k]
        if courses.before[k] == k:
            continue
        star2 = 0.0
        for n in range(3):
            for j in range(3):
                star2 += (vertices[neighbors[i, n], j] - vertices[i, j]) ** 2
        force = (goals[k, 0] - vertices[i, 0], goals[k, 1] - vertices[i, 1], goals[k, 2] - vertices[i, 2])
        push = (extra[i, 0], extra[i, 1], extra[i, 2])
        advance(i, moving, normals, force, push, math.sqrt(star2 / 3.0), forces, out)
