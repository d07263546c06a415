"""Decimation: fewer vertices, the same shape and topology, by T1 where it costs least."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.errors import SimplexMeshWarning, TopologyError
from simplexmesh.mesh import _kernels_corners as evening
from simplexmesh.mesh import _kernels_decimate as kernels
from simplexmesh.mesh import _kernels_exceptions as exceptions
from simplexmesh.mesh import _kernels_regions as regions
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.fitting import Fit, Surface, tangled_vertices
from simplexmesh.mesh.least import least_vertices
from simplexmesh.mesh.nearest import Nearest
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Indices = NDArray[np.int32]

Array = NDArray[np.float64]

WEIGHTS = kernels.Weights(
    normals=0.3,
    spread=4e-3,
    rim=1.0,
    sizes=0.05,
    turn=0.1,
    bend=-0.5,
    shape=0.1,
    least=4,
    most=10,
    piece=20,
    necks=False,
    flat=np.inf,
)
LAST_RESORT = WEIGHTS._replace(sizes=0.0, bend=-1.0, least=3, most=2**30, piece=4, necks=True)
LAX = WEIGHTS._replace(turn=-0.5, shape=0.05)
"""Of the edges that are swapped last."""

PASSES, PATH = 20, 3
"""How often all edges are looked at, and how many are swapped at most so that a face is no exception."""

ROUNDS = 6
STEPS = 2
"""How often vertices go towards the places where their three regions met, before the fit."""

KNOWN = 0.3
"""A region whose vector area is a smaller part of its area points nowhere."""

MARGIN = 0.95
"""Surfaces are compared at points, so that a part of a tolerance is spared."""

FLAT, LESS, ATTEMPTS, WIDELY = 0.5, 0.75, 20, 10
"""How far from flat a region may be, in parts of a tolerance. Where the surfaces are too far apart, regions may reach
only `LESS` of what they did, after `WIDELY` attempts those around there too; faces alone in theirs stay as they are."""


@dataclass(frozen=True, eq=False)
class Decimated(Edited):
    """A decimated mesh.

    Attributes
    ----------
    rms, largest : float
        How far the vertices of the mesh before are from the new one, in its unit; in the largest one the centroids of
        its faces count too, and how far its rims are from the new rims.
    exceptions : (m,) array of int
        The faces of the new mesh, holes left out, that have fewer than five or more than seven vertices.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> out = sm.decimate(sm.torus(40, 20), tolerance=0.1)
    >>> out.mesh.genus, out.largest <= 0.1
    (1, True)
    """

    rms: float
    largest: float
    exceptions: Indices


def decimate(mesh: SimplexMesh, *, vertices: int | None = None, tolerance: float | None = None) -> Decimated:
    """Return a mesh of the same shape and topology with fewer vertices.

    Edges are removed (T1), the one that costs least first. Each face stands for a region of the surface, and what an
    edge costs is how much less flat the region of both its faces is than the two: the squared distance to the plane
    that fits best, how far normals differ, and how far it reaches. So faces end at creases, and are long where the
    surface bends one way only. An edge stays when a triangle of the dual would turn over or become thin. Then sizes
    of faces are evened out by T7, and the vertices are moved so that the faces are closest to the surface in the
    least-squares sense, each only as far as no face folds or crosses another one more than before.

    Genus, components and holes stay. Faces never merge with holes, and merging two on a rim costs how far their parts
    of it are from a line.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh.
    vertices : int, optional
        How many to keep: even, as the number of vertices of a simplex mesh always is.
    tolerance : float, optional
        The largest distance allowed between the two surfaces, either way, and from rims to the new rims, in the unit of
        the mesh: at vertices, centroids of faces, and the middles of edges of the new one. Where they are farther
        apart, faces are kept smaller the next time, or as they were; a mesh without folds stays so. Give this or
        `vertices`.

    Returns
    -------
    Decimated
        The mesh, where everything went, and how far it is from the one given. Vertices that are kept take their data
        along to where they are moved; at the ends of edges that T7 turned, numbers become means, as in `swap_edge`.

    Raises
    ------
    TypeError
        When neither or both of `vertices` and `tolerance` are given.
    ValueError
        When `vertices` is odd, or more than there are, or `tolerance` is not above 0.
    TopologyError
        When the mesh is not complete, or `vertices` is less than its genus, holes and components allow.

    Warns
    -----
    SimplexMeshWarning
        When more vertices had to stay, or some are on faces that fold or cross: where the mesh did itself, or where
        there are too few for its thin parts.

    References
    ----------
    H. Delingette, thesis, 1994, section 7.1; M. Garland, A. Willmott and P. Heckbert, *Hierarchical face clustering on
    polygonal surfaces*, 2001, and D. Cohen-Steiner, P. Alliez and M. Desbrun, *Variational shape approximation*, 2004,
    for the cost.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(12)
    >>> out = sm.decimate(ball, vertices=400)
    >>> out.mesh
    SimplexMesh(400 vertices, 202 faces, genus 0, 0 holes)
    >>> out.rms < 0.01
    True
    """
    _check.instance("mesh", mesh, SimplexMesh)
    if (vertices is None) == (tolerance is None):
        raise TypeError("give vertices or tolerance" + ("" if vertices is None else ", not both"))
    if tolerance is not None:
        return _within(mesh, _check.number("tolerance", tolerance, 0, open_low=True))
    wanted = _count(mesh, vertices)
    out, wrong = _decimated(mesh, wanted)
    if wrong:
        message = f"{wrong} vertices of the decimated mesh are on faces that fold or cross"
        warnings.warn(message, SimplexMeshWarning, stacklevel=2)
    if (left := out.mesh.n_vertices) > wanted:
        message = f"{left} vertices are left, not {wanted}: no other edge can be removed without a fold"
        warnings.warn(message, SimplexMeshWarning, stacklevel=2)
    return out


def _count(mesh: SimplexMesh, vertices: int | None) -> int:
    """Return the number of vertices to keep, or say why it cannot be."""
    wanted = _check.integer("vertices", vertices, 1)
    if wanted > mesh.n_vertices:
        raise ValueError(f"vertices must be at most {mesh.n_vertices}, as many as the mesh has, not {wanted}")
    least = least_vertices(mesh.connectivity)
    if wanted < least:
        pieces = "" if mesh.n_components == 1 else f", {mesh.n_components} components"
        topology = f"genus {mesh.genus}, {mesh.n_holes} holes{pieces}"
        raise TopologyError(f"vertices must be at least {least}, the fewest with {topology}, not {wanted}")
    if wanted % 2:
        raise ValueError(
            f"vertices must be even, as three edges meet in each and every edge has two ends, not {wanted}"
        )
    return wanted


def _decimated(mesh: SimplexMesh, wanted: int) -> tuple[Decimated, int]:
    """Return the mesh with so many vertices, or more when no more can go, and how many are on faces that fold.

    With as many as there are, the mesh is returned as it is.
    """
    if wanted >= mesh.n_vertices:
        return _unchanged(mesh), 0
    reach = np.full(len(mesh.connectivity.face_sizes), np.inf)
    made = _made(mesh, wanted, WEIGHTS, reach, Surface.of(mesh))
    tangled = tangled_vertices(made.fit.mesh)
    if tangled.any():
        tangled = made.fit.loosen(tangled)
    return _result(made.fit, made.out), int(tangled.sum())


def _unchanged(mesh: SimplexMesh) -> Decimated:
    """Return the mesh as it is."""
    same = EditableMesh(mesh).result()
    return Decimated(mesh, same.vertex_map, same.face_map, 0.0, 0.0, _exceptions(mesh))


class _Made(NamedTuple):
    """A mesh with fewer vertices."""

    fit: Fit
    out: Edited
    part_of: Indices  # of each face before, the face that it is part of
    reach: Array  # of each face before, how far the region of that face reaches, rms


def _made(mesh: SimplexMesh, wanted: int, weights: kernels.Weights, reach: Array, surface: Surface) -> _Made:
    """Return the mesh with fewer vertices; edges are removed at any price when regions may be anything."""
    edit = EditableMesh(mesh)
    count = (mesh.n_vertices - wanted) // 2
    edit._reserve(count)
    corners = _collapsed(mesh, edit, count, weights, reach)
    met = edit._darts.values[: mesh.n_vertices, :3].copy()
    evening.place_vertices(edit._darts, corners)
    out = edit.result()
    rows, c = corners.regions, out.mesh.connectivity
    there = np.flatnonzero(out.face_map >= 0)
    vector, area = rows[there, regions.VECTOR : regions.VECTOR + 3], rows[there, regions.AREA]
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    along, free = np.zeros((len(c.face_sizes), 3)), np.ones(len(c.face_sizes), bool)
    known = length > np.maximum(KNOWN * area[:, None], np.finfo(float).tiny)
    along[out.face_map[there]] = np.where(known, vector / np.where(known, length, 1), 0)
    free[out.face_map[there]] = corners.reach[there] > 0
    fit = Fit(surface, out.mesh, out.face_map[corners.into], along, np.asarray(free[c.vertex_faces].all(axis=1)))
    fit.untangle(strictly=True)
    for _ in range(STEPS):
        fit.advance(met[out.vertex_map >= 0])
    fit.improve(ROUNDS)
    fit.untangle()
    squared = rows[:, regions.SPREAD : regions.SPREAD + 3].sum(axis=1) / np.where(rows[:, 0] > 0, rows[:, 0], 1)
    return _Made(fit, out, out.face_map[corners.into], np.sqrt(np.maximum(squared, 0))[corners.into])


def _collapsed(
    mesh: SimplexMesh, edit: EditableMesh, count: int, weights: kernels.Weights, reach: Array
) -> kernels.Corners:
    """T1 up to `count` times, and T7; return the faces as corners."""
    d, c = edit._darts, mesh.connectivity
    rows = regions.face_regions(d)
    energy = regions.energies(rows, weights.normals, weights.spread, weights.rim)
    points = np.ascontiguousarray(rows[:, regions.MIDDLE : regions.MIDDLE + 3])
    into, left = np.arange(len(rows), dtype=np.int32), np.bincount(c.components)
    corners = kernels.Corners(points, rows, energy, reach.copy(), into, c.components, left)
    done = kernels.collapse_cheapest(d, corners, weights, count)
    if done < count and weights.flat == np.inf:
        kernels.collapse_cheapest(d, corners, LAST_RESORT, count - done)
    for swapping in (WEIGHTS, LAX):
        evening.even_out_flat(d, corners, swapping, PASSES)
    exceptions.lessen_exceptions(d, corners, LAX, PATH)
    while (into[into] != into).any():
        into[:] = into[into]
    return corners


def _within(mesh: SimplexMesh, tolerance: float) -> Decimated:
    """Return the mesh with as few vertices as leave it within a tolerance, sound if it was."""
    surface, nearest = Surface.of(mesh), Nearest(mesh)
    sound = not tangled_vertices(mesh).any()
    reach = np.full(len(mesh.connectivity.face_sizes), np.inf)
    weights, least = WEIGHTS._replace(flat=FLAT * tolerance), least_vertices(mesh.connectivity)
    for attempt in range(ATTEMPTS):
        fit, out, part_of, reached = _made(mesh, least, weights, reach, surface)
        c = fit.mesh.connectivity
        wrong = fit.faces_beyond(MARGIN * tolerance) | nearest.faces_beyond(fit.mesh, MARGIN * tolerance)
        if sound:
            wrong[c.vertex_faces[tangled_vertices(fit.mesh)]] = True
        if not wrong.any():
            return _result(fit, out)
        around = wrong.copy()
        if attempt >= WIDELY:
            around[c.vertex_faces[wrong[c.vertex_faces].any(axis=1)]] = True
        alone = np.bincount(part_of, minlength=len(wrong))[part_of] == 1
        less = LESS * np.minimum(reach, reached)
        reach = np.where(around[part_of], np.where(wrong[part_of] & alone, 0.0, less), reach)
    return _unchanged(mesh)


def _result(fit: Fit, out: Edited) -> Decimated:
    return Decimated(fit.mesh, out.vertex_map, out.face_map, *fit.distances(), _exceptions(fit.mesh))


def _exceptions(mesh: SimplexMesh) -> Indices:
    c = mesh.connectivity
    odd = ((c.face_sizes < 5) | (c.face_sizes > 7)) & ~c.face_is_hole
    return _check.frozen(np.flatnonzero(odd).astype(np.int32))
