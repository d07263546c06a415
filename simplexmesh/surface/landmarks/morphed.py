"""Deformation of a surface by displacements of landmarks, interpolated radially (Charton 2014, 5.2.2)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RBFInterpolator
from scipy.spatial.distance import cdist

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.vectors import norm
from simplexmesh.data.conversion import as_data
from simplexmesh.data.points import PointCloud

MAX_SLOPE = 135 / 64
"""Largest slope of the kernel times the radius: a displacement larger than the radius over this folds space."""

CHUNK = 65536
"""Points evaluated at a time, to bound the memory."""


def morphed(
    surface: Any,
    landmarks: ArrayLike,
    targets: ArrayLike,
    *,
    radius: float | None = None,
    kernel: str = "compact",
    accuracy: float = 1e-6,
) -> Any:
    """Return a surface deformed so that its landmarks move to the targets.

    Displacements are interpolated by radial basis functions: every point moves by the sum over landmarks of a weight
    times phi(distance), and the weights solve the interpolation conditions.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, PyVista or trimesh object, or path
        The surface.
    landmarks : (k,) array of int or (k, 3) array of float
        Vertices, or points, all different.
    targets : (k, 3) array of float
        Positions they move to.
    radius : float, optional
        Support of the compact kernel around each landmark. By default 30 % of the diagonal, and at least four times the
        longest displacement, so that no single landmark folds space.
    kernel : {"compact", "thin_plate"}
        "compact": phi = (1 - d / r)^4 (4 d / r + 1), of compact support and class C2 (Wendland 1995). "thin_plate": the
        deformation of least bending energy, which reproduces affine maps (Bookstein 1989); it has no radius.
    accuracy : float
        Largest distance of the moved landmarks from the targets, as a share of the diagonal.

    Returns
    -------
    TriangleMesh, SimplexMesh or PointCloud
        Of the same type, with the same faces; normals of clouds are dropped.

    Raises
    ------
    ValueError
        Landmarks that coincide but have different targets, or fewer than four for a thin plate; inconsistent lengths; a
        radius so small that space would fold; coordinates so large or small that areas overflow or underflow.

    Warns
    -----
    SimplexMeshWarning
        The surface folds between landmarks that are near each other but move differently.

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
        raise TypeError(f"surface must be a mesh or points, not {checks.type_name(data)}")
    checks.size("surface", np.stack([points.min(axis=0), points.max(axis=0)]))
    checks.choice("kernel", kernel, ("compact", "thin_plate"))
    given = checks.any_array("landmarks", landmarks)
    at = points[checks.indices("landmarks", given, (None,), len(points))] if given.ndim == 1 else given
    at = checks.array("landmarks", at, (None, 3))
    displacements = checks.array("targets", targets, (len(at), 3)) - at
    if not len(at):
        raise ValueError("landmarks must be at least one, not none")
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    largest = checks.number("accuracy", accuracy, 0.0, open_low=True) * diagonal
    at, displacements = _distinct(at, displacements, largest)
    if kernel == "thin_plate":
        if radius is not None:
            raise ValueError(f"radius must be left out with a thin plate, which has none, not be {radius!r}")
        moved = points + _thin_plate(at, displacements, points)
    else:
        moved = points + _compact(at, displacements, points, _radius(radius, displacements, diagonal), largest)
    if isinstance(data, PointCloud):
        return replace(data, points=moved, normals=None)
    return replace(data, vertices=moved)


def _distinct(at: Array, displacements: Array, accuracy: float) -> tuple[Array, Array]:
    """Return the distinct landmarks and their displacements."""
    _, first, place = np.unique(at, axis=0, return_index=True, return_inverse=True)
    place = place.ravel()
    off = norm(displacements - displacements[first][place])
    if (off > accuracy).any():
        k = int(off.argmax())
        raise ValueError(f"landmarks must be different, landmarks[{k}] is where another is and goes elsewhere")
    return at[first], displacements[first]


def _radius(radius: float | None, displacements: Array, diagonal: float) -> float:
    longest = float(norm(displacements).max())
    if radius is None:
        return max(0.3 * diagonal, 4 * longest)
    radius = checks.number("radius", radius, 0.0, open_low=True)
    if longest * MAX_SLOPE > radius:
        raise ValueError(f"radius must be at least {longest * MAX_SLOPE:.4g}, not {radius:g}: space would fold")
    return radius


def _compact(at: Array, displacements: Array, points: Array, radius: float, accuracy: float) -> Array:
    """Return displacements of points by compact kernels, with iterative refinement of the weights."""
    matrix = _wendland(cdist(at, at), radius)
    weights = np.zeros_like(displacements)
    for _ in range(20):
        residual = displacements - matrix @ weights
        if norm(residual).max() <= 1e-3 * accuracy:
            break
        weights += np.linalg.lstsq(matrix, residual, rcond=None)[0]
    if norm(displacements - matrix @ weights).max() > accuracy:
        raise ValueError("landmarks must be farther apart: they are too near each other to go where they are sent")
    out: Array = np.zeros_like(points)
    folded = 0
    for start in range(0, len(points), CHUNK):
        rows = slice(start, start + CHUNK)
        out[rows] = _wendland(cdist(points[rows], at), radius) @ weights
        folded += int((np.linalg.det(np.eye(3) + _gradients(points[rows], at, weights, radius)) <= 0).sum())
    if folded:
        where = f"{folded:,} of {len(points):,} points"
        warn(f"the surface folds at {where}: landmarks near each other go different ways")
    return out


def _gradients(points: Array, at: Array, weights: Array, radius: float) -> Array:
    """Return the Jacobians of the displacements, (n, 3, 3), one row per component."""
    slope = -20 / radius**2 * (1 - np.minimum(cdist(points, at) / radius, 1.0)) ** 3
    first_term = np.einsum("nk,ki,kj->nij", slope, weights, -at)
    out: Array = first_term + (slope @ weights)[:, :, None] * points[:, None, :]
    return out


def _wendland(distance: Array, radius: float) -> Array:
    """Return Wendland's function of class C2: 1 at distance 0, 0 from the radius on."""
    share = np.minimum(distance / radius, 1.0)
    out: Array = (1 - share) ** 4 * (4 * share + 1)
    return out


def _thin_plate(at: Array, displacements: Array, points: Array) -> Array:
    if len(at) < 4 or np.linalg.matrix_rank(at - at.mean(axis=0)) < 3:
        raise ValueError(f"landmarks must be at least 4, not in one plane, for a thin plate; they are {len(at)}")
    out: Array = RBFInterpolator(at, displacements, kernel="linear", degree=1)(points)  # phi = r in 3D
    return out
