"""Alignment from picked pairs: the rigid motion of three points or more, then points to tangent planes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh._vec import norm
from simplexmesh.errors import warn
from simplexmesh.recognition.icp import paired, refined, uncertainty
from simplexmesh.recognition.rigid import rigid_fit
from simplexmesh.recognition.surfaces import Surface, surface_of

Array = NDArray[np.float64]

STAGES = 5
WIDEST, CLOSEST = 3.0, 3.0
"""Reaches at first, in root mean square distances of the pairs, and at last, in spacings of the points."""

THIN = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Alignment:
    """Where a source lies on a target.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
        Brings the source to the target.
    T_pairs : (4, 4) array of float
        That of the picked pairs alone.
    pairs_error : float
        Root mean square distance of the pairs after `T_pairs`, in the data's unit: how well they were picked.
    error : float
        Root mean square distance of the source's points to the target's tangent planes, where both are seen.
    overlap : float
        Share of the source's points that lie on the target.
    covariance : (6, 6) array of float
        Of a small rotation vector and shift after the motion.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 14).vertices
    >>> picks = egg[[0, 100, 300, 500]]
    >>> found = sm.align(egg, egg + [5, 0, 0], (picks, picks + [5.1, 0, 0.1]))
    >>> found.T_target_source[:3, 3].round(2).tolist(), round(found.overlap, 1)
    ([5.0, 0.0, 0.0], 1.0)
    """

    T_target_source: Array
    T_pairs: Array
    pairs_error: float
    error: float
    overlap: float
    covariance: Array

    def __repr__(self) -> str:
        return f"Alignment(overlap {self.overlap:.0%}, error {self.error:.3g}, pairs_error {self.pairs_error:.3g})"


def align(source: Any, target: Any, pairs: tuple[ArrayLike, ArrayLike], *, refine: bool = True) -> Alignment:
    """Return the rigid motion from pairs of picked points, refined on the surfaces (iterative closest points).

    The way of clinics and workshops: three or more points picked on both by hand bring one near the other, and what is
    seen of both does the rest. For objects that nobody picks points on see `register`.

    Parameters
    ----------
    source, target : SimplexMesh, TriangleMesh, PointCloud, array, PyVista or trimesh object, or path
        In one unit; either may show only a part of the object.
    pairs : pair of (k, 3) arrays of float
        Points of the source, and where the same points are on the target; at least three, not on a line.
    refine : bool
        False: take the motion of the pairs as it is.

    Returns
    -------
    Alignment

    Raises
    ------
    ValueError, TypeError, OSError
        Fewer than three pairs, pairs on a line, data that is not there, fewer than 50 points.

    Warns
    -----
    SimplexMeshWarning
        Nothing of the source is near the target then.

    References
    ----------
    J. Charton, thesis, 2014, 1.3.1 (coarse alignment from three pairs, then ICP); B. Horn 1987 (the motion of pairs);
    Y. Chen, G. Medioni 1992 (points to planes).

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 14).vertices
    >>> turned = egg @ np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 1]])
    >>> found = sm.align(egg, turned, (egg[[0, 200, 500]], turned[[0, 200, 500]]), refine=False)
    >>> bool(found.pairs_error < 1e-9)
    True
    """
    here, there = _pairs(pairs)
    start = rigid_fit(here, there)
    off = norm(here @ start[:3, :3].T + start[:3, 3] - there)
    pairs_error = float(np.sqrt((off**2).mean()))
    one, other = surface_of(source, "source"), surface_of(target, "target")
    tree = cKDTree(other.points)
    grain = CLOSEST * max(one.spacing, other.spacing)
    T = _followed(one, other, start, max(WIDEST * pairs_error, grain), grain) if refine else start
    found = paired(one, other, tree, T, grain)
    covariance, error = uncertainty(one, other, found, T)
    overlap = float(found.common.mean())
    if refine and not overlap:
        warn("source is nowhere near target where the pairs bring it: are they in the same order and unit?")
    frozen = _check.frozen
    return Alignment(frozen(T), frozen(start), pairs_error, error, overlap, frozen(covariance))


def _pairs(pairs: Any) -> tuple[Array, Array]:
    if not isinstance(pairs, tuple | list) or len(pairs) != 2:
        raise TypeError("pairs must be two arrays of points, of the source and of the target")
    here = _check.array("pairs[0]", pairs[0], (None, 3))
    there = _check.array("pairs[1]", pairs[1], (len(here), 3))
    if len(here) < 3:
        raise ValueError(f"pairs must be at least 3, not {len(here)}")
    for k, points in enumerate((here, there)):
        extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if not extents[1] > THIN * extents[0]:
            raise ValueError(f"pairs must not lie on one line, those of the {('source', 'target')[k]} do")
    return here, there


def _followed(source: Surface, target: Surface, start: Array, widest: float, grain: float) -> Array:
    """Return the motion that ever nearer points lead to."""
    one, other = source.drawn(), target.drawn()
    tree = cKDTree(other.points)
    T = start
    for reach in np.geomspace(widest, grain, STAGES):
        T = refined(one, other, tree, T, float(reach))
    return T
