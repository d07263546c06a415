"""The result of a comparison of two signatures: a hypothesis with its correspondences and rigid motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import warn
from simplexmesh.numerics.rigid import point_to_plane_fit, rigid_fit, rotation_angle

MINIMUM_ANGLE = np.radians(15.0)
"""Hypotheses nearer to each other than this are duplicates."""

CANDIDATES = 4
"""Number of hypotheses that are refined in a few steps, per hypothesis that is refined to the end: more take longer."""


SIZES = {False: 1.1, True: 1.5}
"""Ratio of sizes up to which objects count as of one size, and where one is incomplete, whose size is a guess."""


@dataclass(frozen=True, eq=False, repr=False)
class Match:
    """One hypothesis of how one signature maps to another.

    Attributes
    ----------
    rotation : (3, 3) array of float
        R of equation 6.2, proper: ``phi_target(R p) = phi_source(p)``. It maps the sphere of the source to that of the
        target; the rotation
        between the objects is in `T_target_source`.
    distance : float
        Root mean square difference of the angles over the common visible part, in radians.
    overlap : float
        Size of the common part, as a fraction of the smaller visible part.
    scale : float
        Scale of the visible part of `scaled` about its center (k of equation 6.8 times the factor tried).
    scaled : {"target", "source", ""}
        The signature that was scaled.
    vertices_target, vertices_source : (c,) array of int
        Corresponding vertices, each the nearest.
    points_target, points_source : (c, 3) array of float
        Corresponding points of the two objects, interpolated between vertices.
    normals_target : (c, 3) array of float
        Outward normals at `points_target`.
    shift : (2,) array of float
        For signatures on a torus, cylinder or disc: the shift from coordinates of the source to those of the target, in
        radians, around the axis and, on a torus, around the tube. `rotation` turns `SAI.directions` by the first.
    flipped : bool
        Whether a half turn, which reverses both directions, precedes the shift.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> one = sm.sai(sm.ellipsoid((3, 2, 1), 12), frequency=5)
    >>> [f"{each.overlap:.0%}" for each in sm.match(one, one, best=2)]
    ['100%', '100%']
    """

    rotation: Array
    distance: float
    overlap: float
    scale: float
    scaled: str
    vertices_target: Indices
    vertices_source: Indices
    points_target: Array
    points_source: Array
    normals_target: Array
    shift: Array = field(default_factory=lambda: np.zeros(2))
    flipped: bool = False

    def __repr__(self) -> str:
        scale = f", scale {self.scale:.2f} of {self.scaled}" if self.scaled else ""
        flip = ", turned over" if self.flipped else ""
        if self.shift.any():
            turn = ", ".join(f"{each + 0.0:.1f}" for each in np.degrees(self.shift).round(1))
            return f"Match(distance {self.distance:.4f}, overlap {self.overlap:.0%}, shifted by {turn} degrees{flip})"
        turned = np.degrees(rotation_angle(self.T_target_source))
        return f"Match(distance {self.distance:.4f}, overlap {self.overlap:.0%}, turned by {turned:.1f} degrees{scale})"

    @cached_property
    def T_target_source(self) -> Array:
        """(4, 4) the rigid motion that maps the source to the target (section 6.3.3).

        The point-to-point least-squares fit (E0) is refined point to plane (E1), since corresponding points may be
        displaced along the surface.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> egg = sm.sphere(12)
        >>> egg = egg.moved(egg.vertices * [1.6, 1.3, 1.0] + 0.1 * egg.vertices**2)
        >>> one = sm.sai(egg, frequency=6)
        >>> bool(np.allclose(sm.match(one, one)[0].T_target_source, np.eye(4), atol=1e-6))
        True
        """
        return point_to_plane_fit(
            self.points_source,
            self.points_target,
            self.normals_target,
            rigid_fit(self.points_source, self.points_target),
        )


def warn_of_sizes(found: tuple[Match, ...]) -> tuple[Match, ...]:
    """Return matches, after a warning if the objects differ in size in the best: signatures do not, motions do."""
    for best in found[:1]:
        target, source = (np.linalg.norm(each - each.mean(axis=0)) for each in (best.points_target, best.points_source))
        ratio = float(target / source) if source else np.inf
        if not 1 / SIZES[bool(best.scaled)] < ratio < SIZES[bool(best.scaled)]:
            warn(f"target is {ratio:.3g} times as large as source in the best match: T_target_source does not scale")
    return found
