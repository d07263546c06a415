"""Sharp edges of data near a model, as lines: those of a surface through the data at the data's own resolution.

Where many meet, noise and triangles that straddle them show several corners, joined by short lines.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, norm, normalized, vertex_normals
from simplexmesh.data.cutting.dividing import divided
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.line import CreaseLine, at_distances
from simplexmesh.motion.start.solid_mesh import decimated, relaxed
from simplexmesh.surface.features.feature_lines import feature_lines
from simplexmesh.surface.features.lines.network import FeatureNetwork

POINTS_PER_VERTEX = 5.0
"""Of the surface, at least: fewer leave noise, more blur the edges."""

NOISE = 0.08
"""In edges of the surface: more noise than that, in means of the points of a vertex, is averaged over more points."""

SHORT = 3.0
"""In edges of the surface: nodes that so short a line joins may be one corner."""

BESIDE = 1.5
"""In the same unit: lines no farther apart are courses of one, on either side of triangles that straddle it."""

MEETING = 0.5
"""In the same unit: how far from one place lines may pass that meet there, root mean square."""

SEEN = np.array([1.0, 4.0])
"""In the same unit: where lines tell how they come to a corner."""


def crease_lines(mesh: SimplexMesh, points: Array, noise: float) -> tuple[list[CreaseLine], TriangleMesh]:
    """Return the sharp edges of points (n, 3) near a closed mesh, the longest first, and the surface they are on."""
    surface, side = TriangleMesh(*surface_through(mesh, points, noise)), resolution(mesh.area / len(points), noise)
    found = without_loops(feature_lines(surface), side)
    lines = [CreaseLine(line.points, line.closed, float(line.angle.mean())) for line in found.lines]
    return joined(lines, side), surface


def resolution(area: float, noise: float) -> float:
    """Return the mean edge of the surface through points that have an area each."""
    spacing = np.sqrt(2 / np.sqrt(3) * area)
    return float(spacing * np.sqrt(max(POINTS_PER_VERTEX, noise / (NOISE * spacing))))


def surface_through(mesh: SimplexMesh, points: Array, noise: float) -> tuple[Array, Indices]:
    """Return an even triangulation near a mesh, each vertex moved along its normal to the mean of the points around it.

    So its triangles straddle the sharp edges of the data as those of a scan do, and round them no more than that.
    """
    rough = mesh.triangulated(method="dual")
    side = resolution(rough.area / len(points), noise)
    surface = divided(rough, side)
    wanted = int(4 / np.sqrt(3) * rough.area / side**2)
    vertices, faces = relaxed(*decimated(surface.vertices, surface.faces, wanted))
    for last in (False, False, True):
        normals = vertex_normals(vertices, faces)
        nearest = cKDTree(vertices).query(points, workers=-1)[1]
        heights = dot(points - vertices[nearest], normals[nearest])
        count = np.bincount(nearest, minlength=len(vertices))
        mean = np.bincount(nearest, heights, len(vertices)) / np.maximum(count, 1)
        vertices = vertices + mean[:, None] * normals
        if not last:
            vertices, faces = relaxed(vertices, faces)
    return vertices, faces


def without_loops(found: FeatureNetwork, side: float) -> FeatureNetwork:
    """Return a network without lines that run beside a sharper one between its nodes, or stay beside their node."""
    groups: dict[frozenset[int], list[int]] = {}
    for k, line in enumerate(found.lines):
        groups.setdefault(frozenset(line.vertices[[0, 0 if line.closed else -1]].tolist()), []).append(k)
    gone = []
    for nodes, group in groups.items():
        kept: list[Array] = [found.lines[group[0]].points[:1]] if len(nodes) == 1 else []
        if len(kept) + len(group) < 2:
            continue
        for k in sorted(group, key=lambda k: -float(found.lines[k].angle.mean())):
            line = found.lines[k]
            samples = CreaseLine(line.points, line.closed, 0.0).samples(0.2 * side)[0]
            if any(_apart(samples, other) < BESIDE * side for other in kept):
                gone.append(k)
            else:
                kept.append(samples)
    return found.without(*gone) if gone else found


def _apart(one: Array, other: Array) -> float:
    """Return the Hausdorff distance of two sets of points (k, 3)."""
    return float(max(cKDTree(a).query(b)[0].max() for a, b in ((one, other), (other, one))))


def joined(lines: Sequence[CreaseLine], side: float) -> list[CreaseLine]:
    """Return lines without short ones between nodes at which the others would meet in one place."""
    ends = [(k, last) for k, line in enumerate(lines) if not line.closed for last in (0, 1)]
    at = np.array([lines[k].points[-last] for k, last in ends]).reshape(-1, 3)
    places, which = np.unique(at, axis=0, return_inverse=True)
    node, ends_at = dict(zip(ends, which.tolist(), strict=True)), defaultdict(list)
    for end in ends:
        ends_at[node[end]].append(end)
    short = {k: line.length for k, line in enumerate(lines) if not line.closed and line.length < SHORT * side}

    def join(nodes: set[int]) -> None:
        others = [end for i in sorted(nodes) for end in ends_at[i] if end[0] not in short]
        if len(others) > 2 and len(nodes) > 1:
            place, off = _meeting([lines[k].points[:: -1 if last else 1] for k, last in others], side)
            if off < MEETING * side:
                places[min(nodes)] = place
                ends_at[min(nodes)] = [end for i in nodes for end in ends_at.pop(i)]
                node.update(dict.fromkeys(ends_at[min(nodes)], min(nodes)))

    pairs = np.array([(node[k, 0], node[k, 1]) for k in short], np.int64).reshape(-1, 2)
    links = coo_array((np.ones(len(short)), pairs.T), shape=(len(places), len(places)))
    whole = connected_components(links, directed=False)[1]
    for component in np.unique(whole[pairs]):
        join(set(np.flatnonzero(whole == component).tolist()))
    for k in sorted(short, key=short.__getitem__):
        join({node[k, 0], node[k, 1]})
    out = [line for line in lines if line.closed]
    between = {i for k, last in ends for i in (node[k, 0], node[k, 1]) if node[k, 0] != node[k, 1]}
    for k in (k for k, last in ends if last):
        first, second = node[k, 0], node[k, 1]
        if first == second and first not in between and k not in short:
            out.append(lines[k]._replace(closed=True))  # closed lines that came close to one place
        elif first != second or k not in short:
            points = lines[k].points.copy()
            points[[0, -1]] = places[[first, second]]
            out.append(lines[k]._replace(points=points))
    return sorted(out, key=lambda line: -line.length)


def _meeting(lines: Sequence[Array], side: float) -> tuple[Array, float]:
    """Return the place (3,) nearest to the courses with which lines (k, 3) begin, and how far off they pass."""
    seen = []
    for points in lines:
        far = np.append(0.0, np.cumsum(norm(np.diff(points, axis=0))))
        seen.append(at_distances(points, far, np.minimum(SEEN * side, far[-1] * SEEN / SEEN.max())))
    first, last = np.array(seen).reshape(-1, 2, 3).transpose(1, 0, 2)
    along = normalized(last - first)
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    place = np.linalg.lstsq(across.reshape(-1, 3), (across @ first[:, :, None]).ravel(), rcond=1e-3)[0]
    off = np.linalg.norm(across @ (place - first)[:, :, None], axis=1)
    return np.asarray(place), float(np.sqrt((off**2).mean()))
