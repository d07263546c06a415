"""Conformal parameterization of triangulated tori, cylinders and discs by harmonic one-forms.

The coordinates of a torus are the potentials of two harmonic forms with integer periods. A cylinder is doubled, a
reversed copy glued to its borders, which gives a torus. A disc is a cylinder one of whose borders is a point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.vectors import cross, dot, norm, triangle_vectors
from simplexmesh.mesh import manifold
from simplexmesh.mesh.lattices import subdivided
from simplexmesh.mesh.triangles.homology import CutSurface, cut_open
from simplexmesh.recognition.sai.sphere_domain import mobius_centering, mobius_map

MINIMUM_AREA = 1e-9
"""Lower bound of triangle areas in cotangent weights, in squared mean edges."""


@dataclass(frozen=True, eq=False)
class Parameterization:
    """A triangulated surface with coordinates in the plane."""

    vertices: Array
    faces: Indices
    corners: Array
    modulus: float


def conformal_parameterization(vertices: Array, faces: Indices, topology: str) -> Parameterization:
    """Return the conformal parameterization of a surface over one of `simplexmesh.recognition.sai.flat_domains`."""
    method = {"torus": parameterize_torus, "cylinder": parameterize_tube, "plane": parameterize_disc}[topology]
    return method(vertices, faces)


def parameterize_torus(vertices: Array, faces: Indices) -> Parameterization:
    """Return the parameterization of a torus, in turns along the null-homologous loops outside, then inside."""
    cut = cut_open(vertices, faces)
    if len(cut.generators) != 2:
        raise TopologyError(f"the surface must have one handle, not {len(cut.generators) // 2}")
    forms, energy = harmonic_forms(cut)
    outer, inner = _integer_null_vector(cut.linking - np.eye(2, dtype=np.int64)), _integer_null_vector(cut.linking)
    if outer is None or inner is None or abs(np.linalg.det([outer, inner])) < 0.5:
        raise TopologyError("the surface must not cross itself; its inside and outside are undefined")
    chosen = np.linalg.inv(np.array([outer, inner], dtype=float))  # column j has period 1 along loop j only
    gram = chosen.T @ energy @ chosen
    corners = _counter_clockwise(_integrated(cut, forms @ chosen, np.arange(len(cut.faces))))
    return Parameterization(vertices, cut.faces, corners, float(np.sqrt(gram[0, 0] / gram[1, 1])))


def _integer_null_vector(matrix: Indices) -> Indices | None:
    """Return the shortest nonzero integer row x with x @ matrix = 0, for a matrix (2, 2) of rank one, or None."""
    a, b = matrix[:, int(np.abs(matrix).sum(axis=0).argmax())].tolist()
    row = np.array([b, -a]) // max(int(np.gcd(a, b)), 1)
    return row if row.any() and not (row @ matrix).any() else None


def _counter_clockwise(corners: Array) -> Array:
    """Return corners (t, 3, 2), mirrored if triangles are clockwise."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    if (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() < 0:
        return corners * [-1.0, 1.0]
    return corners


def parameterize_tube(vertices: Array, faces: Indices) -> Parameterization:
    """Return a tube's parameterization: turns around it, and 0 to 1 from border to border; chords are split."""
    vertices, faces = without_chords(vertices, faces)
    cut = cut_open(*_doubled(vertices, faces))
    forms, energy = harmonic_forms(cut)
    periods = np.rint(_periods(cut, forms, _boundary_loop(faces)))
    across = np.array([periods[1], -periods[0]])  # no period around the tube
    around = np.linalg.solve(np.stack([periods, energy @ across]), [1.0, 0.0])  # period 1, orthogonal to `across`
    corners = _integrated(cut, forms @ np.stack([around, across], axis=1), np.arange(len(faces)))
    low, high = corners[..., 1].min(), corners[..., 1].max()
    corners[..., 1] = (corners[..., 1] - low) / (high - low)
    ratio = (around @ energy @ around) / (across @ energy @ across) * (high - low) ** 2
    return Parameterization(vertices, faces, _counter_clockwise(corners), float(2 * np.pi * np.sqrt(ratio)))


def _boundary_loop(faces: Indices) -> Indices:
    """Return the vertices of one boundary loop of a surface, in order."""
    free = manifold.matched(faces)[1].ravel() < 0
    after = dict(zip(faces.ravel()[free].tolist(), np.roll(faces, -1, axis=1).ravel()[free].tolist(), strict=True))
    loop = [next(iter(after))]
    while after[loop[-1]] != loop[0]:
        loop.append(after[loop[-1]])
    return np.array(loop)


def _doubled(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return the double of a surface: itself, then a copy with reversed faces, glued at the borders."""
    free = manifold.matched(faces)[1].ravel() < 0
    shared = np.zeros(len(vertices), bool)
    shared[faces.ravel()[free]] = True
    second = np.where(shared, np.arange(len(vertices)), len(vertices) + np.cumsum(~shared) - 1)
    return np.concatenate([vertices, vertices[~shared]]), np.concatenate([faces, second[faces[:, ::-1]]])


def without_chords(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a surface with chords, interior edges between two border vertices, split at their midpoints."""
    while True:
        faces, mates, _ = manifold.matched(faces)
        mates = mates.ravel()
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        on_border = np.zeros(len(vertices), bool)
        on_border[start[mates < 0]] = True
        sides = np.flatnonzero(on_border[start] & on_border[end] & (np.arange(len(mates)) < mates))
        pairs = np.stack([sides // 3, mates[sides] // 3], axis=1)
        _, first = np.unique(pairs.ravel(), return_index=True)
        free = np.isin(np.arange(2 * len(pairs)), first).reshape(-1, 2).all(axis=1)  # one split per triangle and pass
        sides = sides[free]
        if not len(sides):
            return vertices, faces
        middle = len(vertices) + np.arange(len(sides))
        vertices = np.concatenate([vertices, 0.5 * (vertices[start[sides]] + vertices[end[sides]])])
        faces, more = faces.copy(), []
        for side in (sides, mates[sides]):
            rows, j = side // 3, side % 3
            halves = faces[rows].copy()
            halves[np.arange(len(rows)), j] = middle
            faces[rows, (j + 1) % 3] = middle
            more.append(halves)
        faces = np.concatenate([faces, *more])


def harmonic_forms(cut: CutSurface) -> tuple[Array, Array]:
    """Return harmonic one-forms (e, k) with the periods of a cut's forms, and their inner products (k, k)."""
    from scipy.sparse import csr_array, diags_array
    from scipy.sparse.linalg import splu

    edge_of, _ = _side_edges(cut)
    a, b, c = (cut.vertices[cut.faces[:, j]] for j in range(3))
    weight, least = np.zeros(len(cut.edges)), MINIMUM_AREA * float(np.mean(cut.lengths)) ** 2
    for j, (p, q, r) in enumerate(((a, b, c), (b, c, a), (c, a, b))):  # side j is pq, opposite r
        one, two = p - r, q - r
        np.add.at(weight, edge_of[:, j], 0.5 * dot(one, two) / np.maximum(norm(cross(one, two)), least))
    e, n = len(cut.edges), len(cut.vertices)
    rows = np.tile(np.arange(e), 2)
    difference = csr_array((np.repeat([-1.0, 1.0], e), (rows, cut.edges.T.ravel())), shape=(e, n))
    used = np.unique(cut.faces)[1:]  # one vertex is fixed
    difference = difference[:, used]
    weighted = diags_array(weight) @ difference
    forms = cut.forms.astype(float)
    potential = splu((difference.T @ weighted).tocsc()).solve(-(weighted.T @ forms))
    forms = forms + difference @ potential
    return forms, forms.T @ (weight[:, None] * forms)


def _side_edges(cut: CutSurface) -> tuple[Indices, Indices]:
    """Return the edge of each triangle's side (t, 3), and whether it has the edge's direction, 1 or -1."""
    mates = manifold.matched(cut.faces)[1].ravel()
    half = np.flatnonzero(np.arange(len(mates)) < mates)
    edge_of, sign = np.zeros(len(mates), np.int64), np.ones(len(mates), np.int64)
    edge_of[half] = edge_of[mates[half]] = np.arange(len(half))
    sign[mates[half]] = -1
    return edge_of.reshape(-1, 3), sign.reshape(-1, 3)


def _periods(cut: CutSurface, forms: Array, loop: Indices) -> Array:
    """Return the periods (k,) of forms along a loop of vertices."""
    edge_of = {(a, b): k for k, (a, b) in enumerate(cut.edges.tolist())}
    total = np.zeros(forms.shape[1])
    for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True):
        total += forms[edge_of[a, b]] if (a, b) in edge_of else -forms[edge_of[b, a]]
    return total


def _integrated(cut: CutSurface, forms: Array, rows: Indices) -> Array:
    """Return the potentials (t, 3, k) of forms at the corners of a connected set of triangles."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    edge_of, sign = (each[rows] for each in _side_edges(cut))
    used = np.unique(edge_of)
    one, other = cut.edges[used].T
    n = len(cut.vertices)
    graph = csr_array((used + 1.0, (one, other)), shape=(n, n))
    order, before = breadth_first_order(graph, int(one[0]), directed=False)
    at = np.zeros((n, forms.shape[1]))
    both = (graph + graph.T).tocsr()
    edge = np.zeros(n, np.int64)
    edge[order[1:]] = np.asarray(both[before[order[1:]], order[1:]]).ravel().astype(np.int64) - 1
    for vertex in order[1:].tolist():
        k = edge[vertex]
        at[vertex] = at[before[vertex]] + (forms[k] if cut.edges[k, 1] == vertex else -forms[k])
    steps = sign[..., None] * forms[edge_of]
    first = at[cut.faces[rows, 0]]
    return np.stack([first, first + steps[:, 0], first - steps[:, 2]], axis=1)


def parameterize_disc(vertices: Array, faces: Indices) -> Parameterization:
    """Return the parameterization of a disc over the unit disc, its area balanced about the center."""
    vertices, faces, around = _with_inner_star(vertices, faces)
    ring = parameterize_tube(vertices, faces[~around])
    turns, along = ring.corners.reshape(-1, 2).T
    at = np.zeros((len(ring.vertices), 2))
    corner_vertices = ring.faces.ravel()
    if along[np.isin(corner_vertices, _boundary_loop(faces))].mean() > 0.5:
        along = 1 - along
    angle = 2 * np.pi * turns[:, None] + [0.0, -np.pi / 2]
    at[corner_vertices] = np.exp(-ring.modulus * along)[:, None] * np.cos(angle)
    whole = np.concatenate([ring.faces, faces[around]])
    at = area_balanced(ring.vertices, whole, at)
    return Parameterization(ring.vertices, whole, _counter_clockwise(at[whole]), 0.0)


def _with_inner_star(vertices: Array, faces: Indices) -> tuple[Array, Indices, Mask]:
    """Return a disc, subdivided if coarse, and a mask (t,) of a vertex star that does not touch the border."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    while True:
        vertices, faces = without_chords(vertices, faces)
        border = _boundary_loop(faces)
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        length = norm(vertices[end] - vertices[start])
        graph = csr_array((length, (start, end)), shape=(len(vertices),) * 2)
        far = dijkstra(graph, directed=False, indices=border, min_only=True)
        middle = int(np.argmax(np.where(np.isfinite(far), far, -1.0)))
        star = (faces == middle).any(axis=1)
        if not np.isin(faces[star], border).any():
            return vertices, faces, star
        vertices, faces = subdivided(vertices, faces, 2)


def area_balanced(vertices: Array, faces: Indices, at: Array) -> Array:
    """Return points (v, 2) of the unit disc under the conformal map of the disc that balances the surface's area."""
    area = np.bincount(faces.ravel(), np.repeat(norm(triangle_vectors(vertices, faces)) / 6, 3), len(vertices))
    square = (at**2).sum(axis=1)
    upper = np.column_stack([2 * at, 1 - square]) / (1 + square)[:, None]
    steps = mobius_centering(np.concatenate([upper, upper * [1, 1, -1]]), np.tile(area, 2))
    for step in steps:
        upper = mobius_map(upper, step * [1, 1, 0])
    return upper[:, :2] / (1 + upper[:, 2:])
