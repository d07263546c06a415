"""Several initial values of one fit, of which the best is refined: costs have local minima (Chaperon 2002, 4.4)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm, normalized, tangents
from simplexmesh.cloud.fitting import composed_starts, starts
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.data.primitives import Cylinder, Primitive, Torus

Known = dict[str, Any]
"""Parameters that are known, by the names of arguments."""

DIRECTIONS = 100
"""Axes over the half sphere that a cylinder is looked for about: 14 degrees apart."""

TRIED = 4
"""The best of these, or of random subsets, are refined."""

FEW = 200
"""Points on which starts are compared."""

TRIPLES = 3
"""Random triples of places, at each of two sizes, from which a torus is started."""

STEPS = 12
"""Of starts that are compared."""


def candidates(kind: str, points: Array, normals: Array, known: Known, rng: int) -> Iterator[Primitive]:
    """Yield initial values for points (n, 3) about the origin and of unit size, with what is known put in."""
    axis = known.get("axis")
    found: Iterator[Primitive | None]
    if kind == "cylinder":
        found = _cylinders(points, normals, axis)
    elif kind == "cone":
        found = _cones(points, normals, known)
    elif kind == "torus":
        found = _tori(points, normals, axis, np.random.default_rng(rng))
    elif kind in composed_starts.STARTS:
        found = composed_starts.STARTS[kind](points, normals)
    else:
        found = iter([starts.STARTS[kind](points, normals)])
    for each in found:
        if each is not None:
            with suppress(ValueError):  # beside what is known the measures of a poor start may be none
                yield given(each, points, known)


def given(primitive: Primitive, points: Array, known: Known) -> Primitive:
    """Return a primitive with known parameters put in; the side of a surface that faces the points stays in place."""
    origin, axis = primitive._pose
    shape = dict(zip(primitive._measures(), primitive._shape, strict=True))
    if "axis" in known:
        turned = primitive.kind in ("cone", "flange") and "point" not in known and known["axis"] @ axis < 0
        axis = -known["axis"] if turned else known["axis"]
    if "point" in known:
        origin = known["point"]
    elif "radius" in known and primitive.kind in ("sphere", "cylinder"):
        apart = origin - points.mean(axis=0)
        apart = apart - (apart @ axis) * axis * (primitive.kind == "cylinder")
        origin = origin + (known["radius"] - shape["radius"]) * normalized(apart)
    shape |= {name: value for name, value in known.items() if name in shape}
    if isinstance(primitive, Torus):  # a start that is no torus gives way, as what is known may not
        if "tube_radius" in known:
            shape["radius"] = max(shape["radius"], shape["tube_radius"])
        shape["tube_radius"] = min(shape["tube_radius"], shape["radius"])
    return primitive._with(origin, axis, *shape.values())


def _cylinders(points: Array, normals: Array, axis: Array | None) -> Iterator[Cylinder | None]:
    """Yield cylinders about the axis of the normals, and about those axes that the points suit best."""
    if axis is not None:
        yield starts.cylinder_along(points, axis)
        return
    if len(normals):
        yield starts.cylinder(points, normals)
    yield starts.cylinder_of_patch(points)
    for direction in _directions(points):
        yield starts.cylinder_along(points, direction)


def _directions(points: Array) -> Array:
    """Return the few of many directions (m, 3) across which points are nearest to a circle (Kasa's, which is fast)."""
    some = points[:: -(-len(points) // FEW)]
    k = np.arange(DIRECTIONS) + 0.5
    z, turn = 1 - k / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * k
    axes = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])
    principal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    axes = np.concatenate([axes, principal])
    u, v = tangents(axes)
    x, y = some @ u.T, some @ v.T
    rows = np.stack([x, y, np.ones_like(x)], axis=2).transpose(1, 0, 2)
    square = (x**2 + y**2).T[..., None]
    matrix = rows.transpose(0, 2, 1) @ rows
    a, b, c = np.linalg.solve(matrix + 1e-9 * np.eye(3), rows.transpose(0, 2, 1) @ square)[..., 0].T
    off = np.hypot(x - a / 2, y - b / 2) - np.sqrt(np.maximum(c + (a**2 + b**2) / 4, 0))
    score = np.sqrt(np.mean(off**2, axis=0))
    chosen: list[int] = []
    for k in np.argsort(score):
        if all(abs(axes[k] @ axes[j]) < np.cos(np.radians(20)) for j in chosen):
            chosen.append(k)
        if len(chosen) == TRIED:
            break
    return np.asarray(axes[chosen])


def _cones(points: Array, normals: Array, known: Known) -> Iterator[Primitive | None]:
    """Yield cones from the apex of the tangent planes, and about the axes of cylinders."""
    if "point" in known:
        yield starts.cone_from(points, known["point"])
    elif "axis" in known:
        yield starts.cone_along(points, known["axis"])
    if len(normals):
        yield starts.cone(points, normals)
    for start in _cylinders(points, normals, known.get("axis")):
        if start is not None:
            yield starts.tapered(points, solve(start, points, iterations=STEPS))


def _tori(points: Array, normals: Array, axis: Array | None, rng: np.random.Generator) -> Iterator[Primitive | None]:
    """Yield tori from the axis of the normals, from the ring of the points, and from cylinders at three places."""
    if len(normals):
        yield starts.torus(points, normals) if axis is None else starts.torus_along(points, normals, axis)
        for share in (2, 6):
            for _ in range(TRIPLES):
                yield _torus_of_cylinders(points, normals, max(len(points) // share, 8), rng)
    yield starts.torus_around(points, normals)


def _torus_of_cylinders(points: Array, normals: Array, count: int, rng: np.random.Generator) -> Torus | None:
    """Return the torus through the axes of cylinders about three random points (4.4.1)."""
    feet, radii = [], []
    for seed in points[rng.choice(len(points), 3, replace=False)]:
        near = np.argsort(norm(points - seed))[:count]
        start = starts.start("cylinder", points[near], normals[near])
        if start is None:
            return None
        tube = solve(start, points[near], iterations=STEPS)
        origin, direction = tube._pose
        feet.append(origin + dot(seed - origin, direction) * direction)
        radii.append(tube._shape[0])
    ring = starts.circle(np.array(feet), normals)
    if ring is None or ring.radius > starts.LARGEST:
        return None
    return Torus(ring.center, ring.normal, ring.radius, min(float(np.mean(radii)), ring.radius))
