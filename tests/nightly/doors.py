"""Shapes that nobody means, and the functions of the API that take a shape."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

import simplexmesh as sm


@cache
def shapes() -> dict[str, Any]:
    rng = np.random.default_rng(0)
    ball = sm.sphere(3)
    triangles = ball.triangulated()
    points, vertices, faces = rng.normal(size=(60, 3)), triangles.vertices, triangles.faces
    flat = vertices * [1.0, 1.0, 0.0]
    line = np.linspace(0, 1, 60)[:, None] * [1.0, 2.0, 3.0]
    circle = np.linspace(0, 2 * np.pi, 2000)
    return {
        "nothing": None,
        "text": "no such file",
        "no points": np.zeros((0, 3)),
        "one point": np.zeros((1, 3)),
        "equal points": np.ones((60, 3)),
        "two places": np.repeat([[0.0, 0, 0], [1, 0, 0]], 30, axis=0),
        "points on a line": line,
        "points in a plane": points * [1.0, 1.0, 0.0],
        "points far away": points + 1e15,
        "not a number": np.where(np.arange(60)[:, None] == 7, np.nan, points),
        "a ring": np.stack([np.cos(circle), np.sin(circle), 0 * circle], axis=1),
        "infinite": np.where(np.arange(60)[:, None] == 7, np.inf, points),
        "complex": points * 1j,
        "whole numbers": (4 * points).astype(int),
        "one outlier": np.vstack([points, [[1e12, 0, 0]]]),
        **{
            f"points of {scale:g}": points * scale for scale in (1e-310, 1e-160, 1e-59, 1e-20, 1e20, 1e59, 1e100, 1e300)
        },
        **{f"surface of {scale:g}": (vertices * scale, faces) for scale in (1e-310, 1e-160, 1e-40, 1e40, 1e100)},
        **{f"mesh of {scale:g}": ball.moved(ball.vertices * scale) for scale in (1e-160, 1e-40, 1e40, 1e100)},
        "flat surface": (flat, faces),
        "flat mesh": ball.moved(ball.vertices * [1.0, 1.0, 0.0]),
        "mesh in a point": ball.moved(np.zeros_like(ball.vertices)),
        "surface on a line": (np.linspace(0, 1, len(vertices))[:, None] * [1.0, 2.0, 3.0], faces),
        "one triangle": (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 1, 2]])),
        "a page of a book": (
            np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]),
            np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]]),
        ),
        "twice the same face": (vertices, np.vstack([faces, faces[:5]])),
        "inside out": (vertices, faces[:, ::-1]),
        "mixed sides": (vertices, np.vstack([faces[::2], faces[1::2, ::-1]])),
        "loose vertices": (np.vstack([vertices, points]), faces),
        "wild faces": (vertices, rng.integers(0, len(vertices), (80, 3))),
        "random soup": (rng.normal(size=(90, 3)), np.arange(90).reshape(-1, 3)),
        "a hole": (vertices, faces[10:]),
        "two balls": (np.vstack([vertices, vertices + 5]), np.vstack([faces, faces + len(vertices)])),
        "a constant volume": sm.Volume(np.ones((5, 5, 5))),
        "one bright voxel": sm.Volume(np.eye(1, 125, 62).reshape(5, 5, 5)),
        "noise": sm.Volume(rng.normal(size=(5, 6, 7))),
        "a volume of 1e300": sm.Volume(1e300 * rng.normal(size=(5, 6, 7))),
        "a thin volume": sm.Volume(rng.normal(size=(2, 2, 50))),
    }


@cache
def other() -> sm.SimplexMesh:
    return sm.sphere(4)


def featured(x: Any) -> Any:
    """Every step from a surface to a mesh with its edges along sharp lines."""
    network = sm.feature_lines(x)
    return network, sm.zones(x, network).kinds, sm.aligned(x, network)


def around(x: Any) -> Any:
    """A contour around the middle of a mesh, which a model then pins."""
    contour = sm.Contour.through(x, [0, 60, 120])
    for _ in sm.DeformableModel(x, contours=sm.pinned(contour)).run(5):
        pass


def run(mesh: Any, target: Any) -> None:
    for _ in sm.DeformableModel(mesh, target).run(5):
        pass


KINDS = "plane", "sphere", "cylinder", "cone", "torus"
DOORS: dict[str, Callable[[Any], Any]] = {
    "PointCloud": lambda x: sm.PointCloud(x),
    "TriangleMesh": lambda x: sm.TriangleMesh(*x) if isinstance(x, tuple) else sm.TriangleMesh(x, x),
    "Volume": lambda x: sm.Volume(x),
    "dual": sm.dual,
    "reconstruct": lambda x: sm.reconstruct(x, vertices=100),
    "reconstruct from a sphere": lambda x: sm.reconstruct(x, vertices=100, init="sphere"),
    "reconstruct a level": lambda x: sm.reconstruct(x, vertices=100, level=0.5),
    "targets.Points": lambda x: run(other(), sm.targets.Points(x)),
    "targets.Triangles": lambda x: run(other(), sm.targets.Triangles(x)),
    "targets.Isosurface": lambda x: run(other(), sm.targets.Isosurface(x, 0.5)),
    "DeformableModel": lambda x: run(x, sm.targets.Triangles(other().triangulated())),
    "register to": lambda x: sm.register(x, other()),
    "register from": lambda x: sm.register(other(), x),
    "sai": lambda x: sm.sai(x, frequency=5),
    "deviation": lambda x: sm.deviation(x, other()),
    "curvature": sm.curvature,
    "vertex_normals": sm.vertex_normals,
    "saliency": sm.saliency,
    "decimate": lambda x: sm.decimate(x, vertices=40),
    "simplify": lambda x: sm.simplify(x, 0.1),
    "divided": lambda x: sm.divided(x, 0.5),
    "separated": sm.separated,
    "refine": lambda x: sm.refine(x, other().triangulated()),
    "regularize": sm.regularize,
    "open_holes": lambda x: sm.open_holes(x, other().triangulated()),
    "add_handles": sm.add_handles,
    "redistribute": lambda x: sm.redistribute(x, other().triangulated()),
    "spread": sm.spread,
    "salient_points": sm.salient_points,
    "clipped": lambda x: sm.clipped(x, origin=(0, 0, 0), normal=(0, 0, 1)),
    "register_all": lambda x: sm.register_all([x, other()]),
    "occlude": lambda x: sm.occlude(x, other()),
    "features": featured,
    "a contour": around,
    "fit_circle": sm.fit_circle,
    **{f"fit a {kind}": partial(sm.fit_primitive, kind=kind) for kind in KINDS},
    "extract_primitives": sm.extract_primitives,
    "extract_pipes": sm.extract_pipes,
    "follow_pipe": lambda x: sm.follow_pipe(x, pick=(0.0, 0.0, 0.0)),
}


def call(shape: str, door: str) -> Any:
    return DOORS[door](shapes()[shape])
