"""A surface deformed so that its landmarks reach given places, less and less farther away (Charton 2014, 5.2.2)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RBFInterpolator
from scipy.spatial.distance import cdist

from simplexmesh import _check
from simplexmesh._vec import norm
from simplexmesh.data.convert import as_data
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.errors import warn

Array = NDArray[np.float64]

STEEPEST = 135 / 64
"""Steepest slope of the window, per radius: a displacement may be no more than the radius over this, or space folds."""

REACH = 0.3
ROUNDS = 20
AT_ONCE = 65536


def morphed(
    surface: Any,
    landmarks: ArrayLike,
    targets: ArrayLike,
    *,
    radius: float | None = None,
    kernel: str = "compact",
    tolerance: float = 1e-6,
) -> Any:
    """Return a surface deformed so that its landmarks come to lie on the targets.

    Every point moves by sum of phi(distance to landmark) times what that landmark gives; these are solved for, so that
    landmarks that influence each other reach their targets all the same.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, PyVista or trimesh object, or path
        What is deformed.
    landmarks : (k,) array of int or (k, 3) array of float
        Vertices, or points in the surface's space, all different.
    targets : (k, 3) array of float
        Where they go.
    radius : float, optional
        How far the influence of a landmark reaches, with the compact kernel: beyond, nothing moves. By default 30 % of
        the diagonal, and at least four times the longest way, so that no landmark alone folds space.
    kernel : {"compact", "thin_plate"}
        "compact": phi = (1 - d / r)^4 (4 d / r + 1), smooth and damped (Wendland 1995). "thin_plate": the smoothest
        deformation of all space, which takes turns, shifts and stretches of all landmarks along (Bookstein 1989); it
        has no radius.
    tolerance : float
        How near landmarks must come, as a share of the diagonal.

    Returns
    -------
    TriangleMesh, SimplexMesh or PointCloud
        Of the same kind, with the same faces; normals of clouds are left out.

    Raises
    ------
    ValueError
        Landmarks that coincide but go to different places, or fewer than four for a thin plate; other lengths; a radius
        so small that space would fold; a surface of a size beyond what areas can be multiplied in.

    Warns
    -----
    SimplexMeshWarning
        Landmarks near each other are sent different ways, so that the surface folds between them.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> face = sm.sphere(16).triangulated("dual")
    >>> nose = int(face.vertices[:, 0].argmax())
    >>> out = sm.morphed(face, [nose], [[1.2, 0, 0]])
    >>> still = (out.vertices == face.vertices).all(axis=1)
    >>> bool(np.allclose(out.vertices[nose], [1.2, 0, 0])), bool(still.mean() > 0.4)
    (True, True)
    """
    data = surface if hasattr(surface, "connectivity") else as_data(surface, "surface")
    points = np.asarray(data.points if isinstance(data, PointCloud) else getattr(data, "vertices", None), dtype=float)
    if points.ndim != 2:
        raise TypeError(f"surface must be a mesh or points, not {type(data).__name__}")
    _check.size("surface", np.stack([points.min(axis=0), points.max(axis=0)]))
    _check.choice("kernel", kernel, ("compact", "thin_plate"))
    given = _check.any_array("landmarks", landmarks)
    at = points[_check.indices("landmarks", given, (None,), len(points))] if given.ndim == 1 else given
    at = _check.array("landmarks", at, (None, 3))
    ways = _check.array("targets", targets, (len(at), 3)) - at
    if not len(at):
        raise ValueError("landmarks must be at least one, not none")
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    near = _check.number("tolerance", tolerance, 0.0, open_low=True) * diagonal
    at, ways = _distinct(at, ways, near)
    if kernel == "thin_plate":
        if radius is not None:
            raise ValueError(f"radius must be left out with a thin plate, which has none, not be {radius!r}")
        moved = points + _thin_plate(at, ways, points)
    else:
        moved = points + _compact(at, ways, points, _reach(radius, ways, diagonal), near)
    if isinstance(data, PointCloud):
        return PointCloud(moved)
    return TriangleMesh(moved, data.faces) if isinstance(data, TriangleMesh) else data.moved(moved)


def _distinct(at: Array, ways: Array, near: float) -> tuple[Array, Array]:
    """Return landmarks once each; the same place cannot go two ways."""
    _, first, place = np.unique(at, axis=0, return_index=True, return_inverse=True)
    place = place.ravel()
    off = norm(ways - ways[first][place])
    if (off > near).any():
        k = int(off.argmax())
        raise ValueError(f"landmarks must be different, landmarks[{k}] is where another is and goes elsewhere")
    return at[first], ways[first]


def _reach(radius: float | None, ways: Array, diagonal: float) -> float:
    longest = float(norm(ways).max())
    if radius is None:
        return max(REACH * diagonal, 4 * longest)
    radius = _check.number("radius", radius, 0.0, open_low=True)
    if longest * STEEPEST > radius:
        raise ValueError(f"radius must be at least {longest * STEEPEST:.4g}, not {radius:g}: space would fold")
    return radius


def _compact(at: Array, ways: Array, points: Array, radius: float, near: float) -> Array:
    """Return how points move; what is left at the landmarks is solved for again, until nothing is."""
    matrix = _window(cdist(at, at), radius)
    weights = np.zeros_like(ways)
    for _ in range(ROUNDS):
        left = ways - matrix @ weights
        if norm(left).max() <= 1e-3 * near:
            break
        weights += np.linalg.lstsq(matrix, left, rcond=None)[0]
    if norm(ways - matrix @ weights).max() > near:
        raise ValueError("landmarks must be farther apart: they are too near each other to go where they are sent")
    out: Array = np.zeros_like(points)
    folded = 0
    for start in range(0, len(points), AT_ONCE):
        rows = slice(start, start + AT_ONCE)
        out[rows] = _window(cdist(points[rows], at), radius) @ weights
        folded += int((np.linalg.det(np.eye(3) + _gradients(points[rows], at, weights, radius)) <= 0).sum())
    if folded:
        where = f"{folded:,} of {len(points):,} points"
        warn(f"the surface folds at {where}: landmarks near each other go different ways")
    return out


def _gradients(points: Array, at: Array, weights: Array, radius: float) -> Array:
    """Return how displacements change in space, (n, 3, 3): rows for their x, y, z."""
    steep = -20 / radius**2 * (1 - np.minimum(cdist(points, at) / radius, 1.0)) ** 3
    spread = np.einsum("nk,ki,kj->nij", steep, weights, -at)
    out: Array = spread + (steep @ weights)[:, :, None] * points[:, None, :]
    return out


def _window(distance: Array, radius: float) -> Array:
    """Wendland's function of class C2: one at zero, nothing from the radius on."""
    share = np.minimum(distance / radius, 1.0)
    out: Array = (1 - share) ** 4 * (4 * share + 1)
    return out


def _thin_plate(at: Array, ways: Array, points: Array) -> Array:
    if len(at) < 4 or np.linalg.matrix_rank(at - at.mean(axis=0)) < 3:
        raise ValueError(f"landmarks must be at least 4, not in one plane, for a thin plate; they are {len(at)}")
    out: Array = RBFInterpolator(at, ways, kernel="linear", degree=1)(points)  # r is the thin plate's in space
    return out
