"""Initial meshes from primitives placed around the data: sphere, ellipsoid, cylinder, plane and torus."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.mesh import shapes
from simplexmesh.mesh.simplex_mesh import SimplexMesh

PRIMITIVES = ("sphere", "ellipsoid", "cylinder", "plane", "torus")
ENCLOSING = ("sphere", "ellipsoid")

SECTORS = 12
"""Angular sectors in which the ends of a tube are located."""


def principal_frame(points: Array) -> tuple[Array, Array]:
    """Return the center of the points' bounding box along their principal axes, and the axes as rows, longest first."""
    center = points.mean(axis=0)
    _, _, axes = np.linalg.svd((points - center).T @ (points - center))
    local = (points - center) @ axes.T
    order = np.argsort(-np.ptp(local, axis=0), kind="stable")
    axes = axes[order]
    if np.linalg.det(axes) < 0:
        axes[2] *= -1
    middle = 0.5 * (local.min(axis=0) + local.max(axis=0))
    return center + middle[order] @ axes, axes


def primitive_around(points: Array, kind: str, vertices: int, *, facing: Array | None = None) -> SimplexMesh:
    """Return a primitive with about `vertices` vertices around points, or through them, on the side of `facing`."""
    checks.choice("init", kind, PRIMITIVES)
    center, axes = principal_frame(points)
    if kind == "plane" and facing is not None and axes[2] @ facing < 0:
        axes[1:] *= -1
    if kind == "plane":
        center, axes = _min_area_frame(points, center, axes)
    local = (points - center) @ axes.T
    half = np.maximum(np.abs(local).max(axis=0), 1e-3 * np.abs(local).max())
    if kind == "sphere":
        return shapes.sphere(vertices=vertices, radius=1.05 * float(norm(local).max()), center=center)
    if kind == "ellipsoid":
        outside = 1.05 * float(norm(local / half).max())
        mesh = shapes.ellipsoid(half * outside, vertices=vertices)
    elif kind == "cylinder":
        radius = float(norm(local[:, 1:]).mean())
        mesh = shapes.cylinder(vertices=vertices, radius=radius, height=2 * float(half[0]), axis=(1.0, 0.0, 0.0))
        mesh = _fit_ends(mesh, local)
    elif kind == "plane":
        mesh = shapes.plane(size=(2 * float(half[0]), 2 * float(half[1])), vertices=vertices)
    else:
        around = norm(local[:, :2])
        low, high = np.percentile(around, [1, 99])
        ring, tube = 0.5 * (low + high), 0.5 * (high - low)
        thick = min(float(max(tube, half[2])), 0.9 * float(ring))
        mesh = shapes.torus(vertices=vertices, radius=float(ring), tube_radius=thick)
    return mesh.moved(mesh.vertices @ axes + center)


def _fit_ends(tube: SimplexMesh, local: Array) -> SimplexMesh:
    """Return a tube along x with its ends, which the far side would attract, moved to where the points end."""
    angle = np.arctan2(local[:, 2], local[:, 1])
    sector = np.minimum(((angle + np.pi) * (SECTORS / (2 * np.pi))).astype(np.int64), SECTORS - 1)
    if len(np.unique(sector)) < SECTORS:
        return tube
    middle = np.linspace(-np.pi, np.pi, 2 * SECTORS + 1)[1::2]
    low, high = np.full(SECTORS, np.inf), np.full(SECTORS, -np.inf)
    np.minimum.at(low, sector, local[:, 0])
    np.maximum.at(high, sector, local[:, 0])
    planes = np.linalg.lstsq(_harmonics(middle), np.stack([low, high], axis=1), rcond=None)[0]
    vertices = tube.vertices.copy()
    ends = _harmonics(np.arctan2(vertices[:, 2], vertices[:, 1])) @ planes
    if not (ends[:, 1] - ends[:, 0] > 0.1 * np.ptp(local[:, 0])).all():
        return tube
    part = (vertices[:, 0] - vertices[:, 0].min()) / np.ptp(vertices[:, 0])
    vertices[:, 0] = ends[:, 0] + part * (ends[:, 1] - ends[:, 0])
    return tube.moved(vertices)


def _harmonics(angle: Array) -> Array:
    """Return the columns 1, cos, sin of a plane cut through a cylinder."""
    return np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)


def _min_area_frame(points: Array, center: Array, axes: Array) -> tuple[Array, Array]:
    """Return the frame rotated about its last axis to the bounding rectangle of least area, within 2 degrees."""
    local = (points - center) @ axes.T
    turns = np.radians(np.arange(0.0, 90.0, 2.0))
    frames = np.stack([np.cos(turns), np.sin(turns), -np.sin(turns), np.cos(turns)], axis=1).reshape(-1, 2, 2)
    flat = np.einsum("kij,nj->kni", frames, local[:, :2])
    low, high = flat.min(axis=1), flat.max(axis=1)
    best = int(np.prod(high - low, axis=1).argmin())
    turned = np.vstack([frames[best] @ axes[:2], axes[2]])
    return center + 0.5 * (low + high)[best] @ turned[:2], turned
