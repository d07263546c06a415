"""Surfaces with a handle or with borders laid out in the plane, so that angles are kept: which place is where.

A torus is cut along two loops, a tube along one line; a disc is a tube whose one end is a point. Functions whose level
lines are to be as evenly spaced as they can be are harmonic; on a torus two of them with whole periods are its
coordinates. A tube is doubled, a second copy turned over and sewn to the borders: that is a torus again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, dot, norm
from simplexmesh.errors import TopologyError
from simplexmesh.mesh import manifold
from simplexmesh.mesh.homology import Cut, cut_open
from simplexmesh.recognition.spheres import boosted, centering

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

THINNEST = 1e-9
"""Triangles of less than this of the squared mean edge have no area to divide by."""


@dataclass(frozen=True, eq=False)
class Unrolled:
    """A triangulated surface laid out in the plane.

    Attributes
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
    corners : (t, 3, 2) array of float
        Where each triangle lies, counter-clockwise; across a cut, triangles go on past the period 1.
    modulus : float
        What a map that keeps angles cannot change: for a tube its length over its radius, once it is as round as a
        cylinder; for a torus the length of its second period over that of the first. Zero for a disc.
    """

    vertices: Array
    faces: Indices
    corners: Array
    modulus: float


def unrolled(vertices: Array, faces: Indices, topology: str) -> Unrolled:
    """Return a surface laid out as a torus, a cylinder or a plane; see `simplexmesh.recognition.patches`.

    Parameters
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
        In one piece, counter-clockwise seen from outside, of the topology named.
    topology : {"torus", "cylinder", "plane"}

    Returns
    -------
    Unrolled
        Unique up to a shift along each direction that is closed, a turn of the disc, and a half turn of torus or
        cylinder. The first coordinate of a torus goes along the loops that bound outside of it, the second around the
        tube, also where it is knotted. The disc's area is balanced about its center.

    References
    ----------
    X. Gu, S.-T. Yau, *Global conformal surface parameterization*, SGP 2003, for harmonic forms and doubling.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> donut = sm.torus(40, 16, radius=1.0, tube_radius=0.5).triangulated()
    >>> flat = unrolled(donut.vertices, donut.faces, "torus")
    >>> bool(abs(flat.modulus * np.sqrt(1 / 0.5**2 - 1) - 1) < 0.05)
    True
    """
    return {"torus": _torus, "cylinder": tube, "plane": disc}[topology](vertices, faces)


def _torus(vertices: Array, faces: Indices) -> Unrolled:
    cut = cut_open(vertices, faces)
    if len(cut.generators) != 2:
        raise TopologyError(f"the surface must have one handle, not {len(cut.generators) // 2}")
    forms, energy = harmonic(cut)
    outer, inner = _kernel(cut.linking - np.eye(2, dtype=np.int64)), _kernel(cut.linking)
    if outer is None or inner is None or abs(np.linalg.det([outer, inner])) < 0.5:
        raise TopologyError("the surface must not cross itself, or its inside and outside cannot be told")
    chosen = np.linalg.inv(np.array([outer, inner], dtype=float))  # column j has period 1 along loop j only
    gram = chosen.T @ energy @ chosen
    corners = _facing(_corners(cut, forms @ chosen, np.arange(len(cut.faces))))
    return Unrolled(vertices, cut.faces, corners, float(np.sqrt(gram[0, 0] / gram[1, 1])))


def _kernel(matrix: Indices) -> Indices | None:
    """Return the shortest row of whole numbers, not zero, that a matrix (2, 2) of rank one takes to zero."""
    a, b = matrix[:, int(np.abs(matrix).sum(axis=0).argmax())].tolist()
    row = np.array([b, -a]) // max(int(np.gcd(a, b)), 1)
    return row if row.any() and not (row @ matrix).any() else None


def _facing(corners: Array) -> Array:
    """Return corners (t, 3, 2) mirrored, where need be, so that triangles are counter-clockwise."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    if (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() < 0:
        return corners * [-1.0, 1.0]
    return corners


def tube(vertices: Array, faces: Indices) -> Unrolled:
    """Return a tube laid out: turns around, and 0 to 1 from border to border; without edges that cut off a corner."""
    vertices, faces = without_bridges(vertices, faces)
    cut = cut_open(*_doubled(vertices, faces))
    forms, energy = harmonic(cut)
    periods = np.rint(_along(cut, forms, _border(faces)))
    across = np.array([periods[1], -periods[0]])  # no period around: it tells how far along
    around = np.linalg.solve(np.stack([periods, energy @ across]), [1.0, 0.0])  # and nothing of the other in it
    corners = _corners(cut, forms @ np.stack([around, across], axis=1), np.arange(len(faces)))
    low, high = corners[..., 1].min(), corners[..., 1].max()
    corners[..., 1] = (corners[..., 1] - low) / (high - low)
    ratio = (around @ energy @ around) / (across @ energy @ across) * (high - low) ** 2
    return Unrolled(vertices, faces, _facing(corners), float(2 * np.pi * np.sqrt(ratio)))


def _border(faces: Indices) -> Indices:
    """Return the vertices of one border of a surface, in order."""
    free = manifold.matched(faces)[1].ravel() < 0
    after = dict(zip(faces.ravel()[free].tolist(), np.roll(faces, -1, axis=1).ravel()[free].tolist(), strict=True))
    loop = [next(iter(after))]
    while after[loop[-1]] != loop[0]:
        loop.append(after[loop[-1]])
    return np.array(loop)


def _doubled(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a surface with a second copy of it, turned over, sewn to its borders; the first copy's triangles first."""
    free = manifold.matched(faces)[1].ravel() < 0
    shared = np.zeros(len(vertices), bool)
    shared[faces.ravel()[free]] = True
    second = np.where(shared, np.arange(len(vertices)), len(vertices) + np.cumsum(~shared) - 1)
    return np.concatenate([vertices, vertices[~shared]]), np.concatenate([faces, second[faces[:, ::-1]]])


def without_bridges(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a surface in which edges between two vertices on borders are cut in two, save those of the borders.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> len(without_bridges(square, np.array([[0, 1, 2], [0, 2, 3]]))[1])
    4
    """
    while True:
        faces, mates, _ = manifold.matched(faces)
        mates = mates.ravel()
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        rim = np.zeros(len(vertices), bool)
        rim[start[mates < 0]] = True
        sides = np.flatnonzero(rim[start] & rim[end] & (np.arange(len(mates)) < mates))
        pairs = np.stack([sides // 3, mates[sides] // 3], axis=1)
        _, first = np.unique(pairs.ravel(), return_index=True)
        free = np.isin(np.arange(2 * len(pairs)), first).reshape(-1, 2).all(axis=1)  # one a triangle and round
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


def harmonic(cut: Cut) -> tuple[Array, Array]:
    """Return harmonic forms with the periods of a cut's, what each edge adds (e, k), and their energies (k, k)."""
    from scipy.sparse import csr_array, diags_array
    from scipy.sparse.linalg import splu

    number, _ = _sides(cut)
    a, b, c = (cut.vertices[cut.faces[:, j]] for j in range(3))
    weight, least = np.zeros(len(cut.edges)), THINNEST * float(np.mean(cut.lengths)) ** 2
    for j, (p, q, r) in enumerate(((a, b, c), (b, c, a), (c, a, b))):  # side j is p q, its angle at r
        one, two = p - r, q - r
        np.add.at(weight, number[:, j], 0.5 * dot(one, two) / np.maximum(norm(cross(one, two)), least))
    e, n = len(cut.edges), len(cut.vertices)
    rows = np.tile(np.arange(e), 2)
    difference = csr_array((np.repeat([-1.0, 1.0], e), (rows, cut.edges.T.ravel())), shape=(e, n))
    used = np.unique(cut.faces)[1:]  # one vertex stays where it is
    difference = difference[:, used]
    weighted = diags_array(weight) @ difference
    forms = cut.forms.astype(float)
    potential = splu((difference.T @ weighted).tocsc()).solve(-(weighted.T @ forms))
    forms = forms + difference @ potential
    return forms, forms.T @ (weight[:, None] * forms)


def _sides(cut: Cut) -> tuple[Indices, Indices]:
    """Return (t, 3) the edge of each triangle's side, and 1 or -1: whether it runs as the edge does."""
    mates = manifold.matched(cut.faces)[1].ravel()
    half = np.flatnonzero(np.arange(len(mates)) < mates)
    number, sign = np.zeros(len(mates), np.int64), np.ones(len(mates), np.int64)
    number[half] = number[mates[half]] = np.arange(len(half))
    sign[mates[half]] = -1
    return number.reshape(-1, 3), sign.reshape(-1, 3)


def _along(cut: Cut, forms: Array, loop: Indices) -> Array:
    """Return (k,) the sums of forms along a closed way of vertices."""
    number = {(a, b): k for k, (a, b) in enumerate(cut.edges.tolist())}
    total = np.zeros(forms.shape[1])
    for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True):
        total += forms[number[a, b]] if (a, b) in number else -forms[number[b, a]]
    return total


def _corners(cut: Cut, forms: Array, rows: Indices) -> Array:
    """Return (t, 3, k) the potentials of forms at the corners of some triangles that hang together."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    number, sign = (each[rows] for each in _sides(cut))
    mine = np.unique(number)
    one, other = cut.edges[mine].T
    n = len(cut.vertices)
    graph = csr_array((mine + 1.0, (one, other)), shape=(n, n))
    order, before = breadth_first_order(graph, int(one[0]), directed=False)
    at = np.zeros((n, forms.shape[1]))
    both = (graph + graph.T).tocsr()
    edge = np.zeros(n, np.int64)
    edge[order[1:]] = np.asarray(both[before[order[1:]], order[1:]]).ravel().astype(np.int64) - 1
    for vertex in order[1:].tolist():
        k = edge[vertex]
        at[vertex] = at[before[vertex]] + (forms[k] if cut.edges[k, 1] == vertex else -forms[k])
    steps = sign[..., None] * forms[number]
    first = at[cut.faces[rows, 0]]
    return np.stack([first, first + steps[:, 0], first - steps[:, 2]], axis=1)


def disc(vertices: Array, faces: Indices) -> Unrolled:
    """Return a disc laid out in the circle of radius 1, its area balanced about the center.

    The triangles around a vertex far from the border are taken out, and the tube left is laid out; which vertex is
    forgotten when the area is balanced.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    vertices, faces = without_bridges(vertices, faces)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    length = norm(vertices[end] - vertices[start])
    graph = csr_array((length, (start, end)), shape=(len(vertices),) * 2)
    far = dijkstra(graph, directed=False, indices=_border(faces), min_only=True)
    middle = int(np.argmax(np.where(np.isfinite(far), far, -1.0)))
    around = (faces == middle).any(axis=1)
    ring = tube(vertices, faces[~around])
    turns, along = ring.corners.reshape(-1, 2).T
    at = np.zeros((len(ring.vertices), 2))
    place = ring.faces.ravel()
    if along[np.isin(place, _border(faces))].mean() > 0.5:
        along = 1 - along
    angle = 2 * np.pi * turns[:, None] + [0.0, -np.pi / 2]
    at[place] = np.exp(-ring.modulus * along)[:, None] * np.cos(angle)
    whole = np.concatenate([ring.faces, faces[around]])
    at = balanced(ring.vertices, whole, at)
    return Unrolled(ring.vertices, whole, _facing(at[whole]), 0.0)


def balanced(vertices: Array, faces: Indices, at: Array) -> Array:
    """Return places (v, 2) in the unit disc under the map of the disc, keeping angles, that balances a surface's area.

    The disc is seen as the upper half of the sphere, and the surface doubled: of the whole sphere's maps
    (`simplexmesh.recognition.spheres.centering`) the one that balances both copies keeps the equator.
    """
    a, b, c = (vertices[faces[:, j]] for j in range(3))
    area = np.zeros(len(vertices))
    np.add.at(area, faces.ravel(), np.repeat(norm(cross(b - a, c - a)) / 6, 3))
    square = (at**2).sum(axis=1)
    upper = np.column_stack([2 * at, 1 - square]) / (1 + square)[:, None]
    steps = centering(np.concatenate([upper, upper * [1, 1, -1]]), np.tile(area, 2))
    for step in steps:
        upper = boosted(upper, step * [1, 1, 0])
    return upper[:, :2] / (1 + upper[:, 2:])
