"""Decimation: fewer vertices, the same shape and topology, by T1 where it costs least."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.errors import SimplexMeshWarning, TopologyError
from simplexmesh.mesh import _kernels_corners as evening
from simplexmesh.mesh import _kernels_decimate as kernels
from simplexmesh.mesh import _kernels_quadrics as quadrics
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.fitting import REPAIRS, Fit, Surface, tangled_vertices
from simplexmesh.mesh.least import least_vertices
from simplexmesh.mesh.nearest import Nearest
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Indices = NDArray[np.int32]

WEIGHTS = kernels.Weights(
    stay=1e-3, spread=2e-4, sizes=0.05, turn=0.17, bend=-0.5, shape=0.1, least=4, most=10, piece=20, necks=False
)
LAST_RESORT = WEIGHTS._replace(sizes=0.0, bend=-1.0, least=3, most=2**30, piece=4, necks=True)
SHARPENING = 3
"""Rounds in which the corners of the dual triangulation are found, whose centroids the vertices are."""

ON_RIM = 1.0
PASSES = 20
ROUNDS = 6

GENTLE = REPAIRS[:2]
"""Repairs that stay near the surface, for what is tangled anyway."""

MARGIN, PULLED, PRECISION = 0.95, 0.8, 50
"""Surfaces are compared at points, so that a part of a tolerance is spared; how near the fewest vertices are found."""


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

    Edges are removed (T1), the one that costs least first. In the dual triangulation, where faces are corners, that
    merges the two ends of an edge; the new corner goes where the sum of squared distances to the planes of all
    triangles merged so far is least, and that sum is the cost, with some weight on the length of the edge and on faces
    of other than six vertices. An edge stays when a triangle of the dual would turn over or become thin. Then sizes of
    faces are evened out by T7, each vertex goes to the centroid of its triangle, all are moved so that the faces are
    closest to the surface in the least-squares sense, and where that folds, it is taken back.

    Genus, components and holes stay. Faces never merge with holes; a rim's own planes, upright on the surface, keep its
    shape.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh.
    vertices : int, optional
        How many to keep: even, as the number of vertices of a simplex mesh always is.
    tolerance : float, optional
        The largest distance allowed between the two surfaces, either way, and from rims to the new rims, in the unit of
        the mesh: at vertices, centroids of faces, and the middles of edges of the new one. Found by trying about ten
        numbers of vertices; a mesh without folds stays so. Give this or `vertices`.

    Returns
    -------
    Decimated
        The mesh, where everything went, and how far it is from the one given. Data of vertices that are kept stay.

    Raises
    ------
    TypeError
        When neither or both of `vertices` and `tolerance` are given.
    ValueError
        When `vertices` is odd, or more than there are.
    TopologyError
        When the mesh is not complete, or `vertices` is less than its genus, holes and components allow.

    Warns
    -----
    SimplexMeshWarning
        When more vertices had to stay, or some are on faces that fold or cross: where the mesh did itself, or where
        there are too few for its thin parts.

    References
    ----------
    H. Delingette, thesis, 1994, section 7.1; M. Garland and P. Heckbert, *Surface simplification using quadric error
    metrics*, 1997, for the cost.

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


def _decimated(
    mesh: SimplexMesh,
    wanted: int,
    surface: Nearest | None = None,
    bound: float = 0.0,
    repairs: tuple[str, ...] = REPAIRS,
) -> tuple[Decimated, int]:
    """Return the mesh with so many vertices, or more when no more can go, and how many are on faces that fold.

    With as many as there are, the mesh is returned as it is. Vertices farther from a surface than a bound go to it.
    """
    edit = EditableMesh(mesh)
    if wanted >= mesh.n_vertices:
        same = edit.result()
        return _result(Fit(Surface.of(mesh), mesh, same.face_map), same), 0
    edit._reserve((mesh.n_vertices - wanted) // 2)
    into = _collapsed(mesh, edit, (mesh.n_vertices - wanted) // 2)
    out = edit.result()
    fit = Fit(Surface.of(mesh), out.mesh, out.face_map[into])
    fit.improve(ROUNDS)
    if surface is not None:
        fit.move(surface.pulled(fit.mesh, bound))
    wrong = fit.repair(out.mesh.vertices, repairs)
    return _result(fit, out), wrong


def _collapsed(mesh: SimplexMesh, edit: EditableMesh, count: int) -> Indices:
    """T1 up to `count` times and T7, and vertices placed; return the face that each face is part of."""
    d, c = edit._darts, mesh.connectivity
    origin = mesh.vertices.mean(axis=0)
    vertices = mesh.vertices - origin
    points, rim = quadrics.face_points(d.face, d.face_hole, vertices, SHARPENING)
    planes = quadrics.face_quadrics(d.face, d.twin, d.face_hole, vertices, points, ON_RIM)
    into, left = np.arange(len(points), dtype=np.int32), np.bincount(c.components)
    corners = kernels.Corners(points, planes, rim, into, c.components, left)
    done = kernels.collapse_cheapest(d, corners, WEIGHTS, count)
    if done < count:
        kernels.collapse_cheapest(d, corners, LAST_RESORT, count - done)
    evening.even_out_flat(d, corners, WEIGHTS, PASSES)
    evening.place_vertices(d, corners, origin)
    while (into[into] != into).any():
        into = into[into]
    return into


def _within(mesh: SimplexMesh, tolerance: float) -> Decimated:
    """Return the mesh with the fewest vertices found by halving that stays within a tolerance, sound if it was."""
    low, high = least_vertices(mesh.connectivity) // 2, mesh.n_vertices // 2
    best, sound = _decimated(mesh, mesh.n_vertices)[0], not tangled_vertices(mesh).any()
    surface = Nearest(mesh)
    while high - low > max(1, low // PRECISION):
        middle = min(max(int(np.sqrt(low * high)), low + 1), high - 1)
        out, wrong = _decimated(mesh, 2 * middle, surface, PULLED * tolerance, REPAIRS if sound else GENTLE)
        left = out.mesh.n_vertices // 2
        near = out.largest <= MARGIN * tolerance and surface.largest(out.mesh) <= MARGIN * tolerance
        if near and not (wrong and sound) and left < high:
            best, high = out, left
        low = max(low, left if left > middle else 0, middle if high != middle else 0)
    return best


def _result(fit: Fit, out: Edited) -> Decimated:
    c = fit.mesh.connectivity
    odd = np.flatnonzero(((c.face_sizes < 5) | (c.face_sizes > 7)) & ~c.face_is_hole).astype(np.int32)
    rms, largest = fit.distances()
    return Decimated(fit.mesh, out.vertex_map, out.face_map, rms, largest, _check.frozen(odd))
