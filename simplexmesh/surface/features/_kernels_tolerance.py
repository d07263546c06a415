"""Closed triangulations whose changes are watched by tolerances: spheres that the surface must go on touching.

Vertices from `caps` on are not there: each closes a border by triangles to its edges, which hold the spheres of the
border's vertices. A sphere is in the list of one triangle that it touches, or whose border edge it touches.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh.mesh.decimation._kernels_fitting import closest_on_triangle
from simplexmesh.mesh.triangles._kernels_half_edges import area_normal, following, previous
from simplexmesh.numerics._kernels_vectors import row

REMOVED = -1

MIN_COSINE = 0.2
"""Of the angle between a new triangle and the mean of those it replaces: noise turns them by more than a feature."""


class Triangulation(NamedTuple):
    """A closed triangulation; vertices from `caps` on close its borders."""

    vertices: Array  # (v, 3)
    corners: Indices  # (3t,)
    mates: Indices  # (3t,)
    frozen: Mask  # (v,) vertices whose triangles stay as they are
    sharp: Mask  # (3t,) half-edges on lines that stay
    caps: int


class Spheres(NamedTuple):
    """Balls that the surface must touch, in one list for each triangle: the first, and the next after each, or -1."""

    centers: Array  # (s, 3)
    squared_radii: Array  # (s,)
    first: Indices  # (t,)
    after: Indices  # (s,)
    claimed: Indices  # (s,) the triangle that would take a sphere over, in a change that is tried


class Change(NamedTuple):
    """Triangles that a change would leave in place of others: their indices and their new corners."""

    triangles: Indices  # (64,)
    corners: Indices  # (64, 3)
    size: Indices  # (1,)


@njit(cache=True, error_model="numpy")
def capped(corners, mates, vertices):
    """Return the corners and mates of a triangulation whose borders are closed by triangles to a new vertex for each.

    Their border edge is the first, the new vertex the last corner; also the number of new vertices.
    """
    n, caps = len(mates), 0
    borders = np.flatnonzero(mates < 0)
    place = np.full(n, -1)
    for i in range(len(borders)):
        place[borders[i]] = n + 3 * i
    all_corners, all_mates = np.full(n + 3 * len(borders), -1), np.full(n + 3 * len(borders), -1)
    for i in range(n):
        all_corners[i], all_mates[i] = corners[i], mates[i]
    for first in borders:
        if all_corners[place[first]] >= 0:
            continue
        h = first
        while True:
            t, before = place[h], previous(h)
            while mates[before] >= 0:
                before = previous(mates[before])
            all_corners[t], all_corners[t + 1], all_corners[t + 2] = corners[following(h)], corners[h], vertices + caps
            all_mates[t], all_mates[h] = h, t
            all_mates[t + 1], all_mates[place[before] + 2] = place[before] + 2, t + 1
            h = before
            if h == first:
                break
        caps += 1
    return all_corners, all_mates, caps


@njit(cache=True, error_model="numpy")
def is_cap(tri, h):
    """Return whether the triangle of a half-edge closes a border."""
    return tri.corners[3 * (h // 3) + 2] >= tri.caps


@njit(cache=True, error_model="numpy")
def fill_spheres(tri, spheres):
    """Enter the spheres: the first is at vertex 0 and so on, those of border vertices follow in the order of caps."""
    spheres.first[:] = -1
    entered = np.zeros(tri.caps, np.bool_)
    border = tri.caps
    for h in range(len(tri.corners)):
        v, t = tri.corners[h], h // 3
        if is_cap(tri, h):
            if h % 3 == 0:
                spheres.centers[border] = tri.vertices[v]
                spheres.squared_radii[border] = spheres.squared_radii[v]
                spheres.after[border], spheres.first[t] = spheres.first[t], border
                border += 1
        elif not entered[v]:
            entered[v] = True
            spheres.after[v], spheres.first[t] = spheres.first[t], v


@njit(cache=True, error_model="numpy")
def claims(tri, spheres, source, change):
    """Claim each sphere of triangle `source` for the nearest that a change makes; return whether all touch theirs.

    Spheres of triangles that close borders are claimed by such triangles, by their border edge, others by others.
    """
    border = tri.corners[3 * source + 2] >= tri.caps
    i = spheres.first[source]
    while i >= 0:
        best, place = math.inf, row(spheres.centers, i)
        for k in range(change.size[0]):
            c = change.corners[k, 2]
            if (c >= tri.caps) == border:
                a, b = row(tri.vertices, change.corners[k, 0]), row(tri.vertices, change.corners[k, 1])
                distance = closest_on_triangle(place, a, b, b if border else row(tri.vertices, c))[0]
                if distance < best:
                    best, spheres.claimed[i] = distance, change.triangles[k]
        if not best <= spheres.squared_radii[i]:
            return False
        i = spheres.after[i]
    return True


@njit(cache=True, error_model="numpy")
def unlist(spheres, triangle, chain):
    """Put the list of a triangle before a chain of spheres; return the first sphere of the chain then, or -1."""
    i = spheres.first[triangle]
    spheres.first[triangle] = -1
    while i >= 0:
        then = spheres.after[i]
        spheres.after[i] = chain
        chain, i = i, then
    return chain


@njit(cache=True, error_model="numpy")
def hand_over(spheres, chain):
    """Enter the spheres of a chain with the triangles that claimed them."""
    while chain >= 0:
        t, then = spheres.claimed[chain], spheres.after[chain]
        spheres.after[chain], spheres.first[t] = spheres.first[t], chain
        chain = then


@njit(cache=True, error_model="numpy")
def normal_of(tri, a, b, c):
    return area_normal(row(tri.vertices, a), row(tri.vertices, b), row(tri.vertices, c))


@njit(cache=True, error_model="numpy")
def squared_length(tri, a, b):
    p, q = row(tri.vertices, a), row(tri.vertices, b)
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@njit(cache=True, error_model="numpy")
def holders(spheres):
    """Return the triangle in whose list each sphere is."""
    out = np.full(len(spheres.after), -1)
    for t in range(len(spheres.first)):
        i = spheres.first[t]
        while i >= 0:
            out[i] = t
            i = spheres.after[i]
    return out
