"""Alignment from picked pairs: the rigid motion of at least three pairs, then point-to-plane ICP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import norm
from simplexmesh.data.poses import Posed
from simplexmesh.numerics.rigid import point_pairs, relative_extents, rigid_fit
from simplexmesh.recognition.register.icp import find_correspondences, refined, uncertainty
from simplexmesh.recognition.register.oriented_points import oriented_pair

REACH = 3.0
"""First reach, in root mean square distances of the pairs, and last reach, in spacings of the points: a larger one
finds farther, and mistakes what does not belong together."""

FEW = 2_000
"""Points of the source that are looked for in a wide reach, where wrong pairs would take several times as long."""

CONTRADICTION = 0.25
"""Distance of pairs after their motion, over that from their center, beyond which they do not belong together."""

AGREED = 0.9
"""Share of the source that is on the target however coarse the pairs were."""


@dataclass(frozen=True, eq=False, repr=False)
class Alignment(Posed):
    """The pose of a source on a target; made by `align`.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
        Maps the source to the target.
    T_pairs : (4, 4) array of float
        The motion fitted to the pairs alone.
    pairs_error : float
        Root mean square distance of the pairs after `T_pairs`, in the data's unit: the accuracy of picking.
    error : float
        Root mean square distance of the source's points to the target's tangent planes, where they overlap.
    overlap : float
        Fraction of the source's points that lie on the target.
    covariance : (6, 6) array of float
        Of a small rotation vector and shift after `T_target_source`.

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


def align(
    source: Any,
    target: Any,
    pairs: tuple[ArrayLike, ArrayLike],
    *,
    refine: bool = True,
    level: float | tuple[float | None, float | None] | None = None,
    label: int | tuple[int | None, int | None] | None = None,
    inside: str | tuple[str, str] = "above",
) -> Alignment:
    """Return the rigid motion from pairs of picked points, refined on the surfaces (iterative closest points).

    Three or more points picked by hand on both give the initial pose, which is refined where both overlap. `register`
    needs no picks.

    Parameters
    ----------
    source, target : SimplexMesh, TriangleMesh, PointCloud, Volume, array, PyVista or trimesh object, or path
        In one unit; either may be partial.
    pairs : pair of (k, 3) arrays of float
        Points of the source and the corresponding points of the target; at least three, not collinear.
    refine : bool
        Whether to refine the motion of the pairs on the surfaces.
    level, label, inside : optional
        The surface of volumes, as in `register`.

    Returns
    -------
    Alignment

    Raises
    ------
    ValueError, TypeError, OSError
        Fewer than three pairs, collinear pairs, data that is missing, fewer than 50 points, two units.

    Warns
    -----
    SimplexMeshWarning
        No point of the source is near the target after the motion, or the pairs contradict each other.

    References
    ----------
    J. Charton, thesis, 2014, 1.3.1 (coarse alignment from three pairs, then ICP); B. Horn 1987 (the motion of pairs);
    Y. Chen, G. Medioni 1992 (point to plane).

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 14).vertices
    >>> turned = egg @ np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 1]])
    >>> found = sm.align(egg, turned, (egg[[0, 200, 500]], turned[[0, 200, 500]]), refine=False)
    >>> bool(found.pairs_error < 1e-9)
    True
    """
    source_points, target_points = _checked_pairs(pairs)
    start = rigid_fit(source_points, target_points)
    residuals = norm(source_points @ start[:3, :3].T + start[:3, 3] - target_points)
    pairs_error = float(np.sqrt((residuals**2).mean()))
    moving, fixed = oriented_pair(source, target, level, label, inside)
    common_unit("source and target", (moving, fixed))
    reach, T = REACH * max(moving.spacing, fixed.spacing), start
    if refine:
        fine_moving, fine_fixed = moving.on_quadrics(), fixed.on_quadrics()
        tree = cKDTree(fine_fixed.points)
        few = moving.sample(FEW, np.random.default_rng(0))
        for wider in np.geomspace(max(REACH * pairs_error, reach), reach, 5)[:-1]:
            T = refined(fine_moving, fine_fixed, tree, T, float(wider), chosen=few)
        T = refined(fine_moving, fine_fixed, tree, T, reach)
    found = find_correspondences(moving, fixed, cKDTree(fixed.points), T, reach)
    covariance, error = uncertainty(moving, fixed, found, T)
    overlap = float(found.inlier.mean())
    if refine and not overlap:
        warn("source has no points near target after the motion of the pairs: check their order and unit")
    elif overlap < AGREED and pairs_error > CONTRADICTION * float(np.sqrt(target_points.var(axis=0).sum())):
        warn(f"no rigid motion brings the pairs nearer than {pairs_error:.3g}: check their order and unit")
    frozen = checks.frozen
    return Alignment(frozen(T), frozen(start), pairs_error, error, overlap, frozen(covariance))


def _checked_pairs(pairs: Any) -> tuple[Array, Array]:
    """Return the points of source and target, at least three and not on one line."""
    source_points, target_points = point_pairs(pairs, "of the source and of the target")
    if len(source_points) < 3:
        raise ValueError(f"pairs must be at least 3, not {len(source_points)}")
    for owner, points in (("source", source_points), ("target", target_points)):
        if relative_extents(points)[1] < 1e-6:
            raise ValueError(f"pairs must not lie on one line, those of the {owner} do")
    return source_points, target_points
