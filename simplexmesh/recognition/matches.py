"""What a comparison of two signatures found: how one lies on the other, and the motion that means for the objects."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition.rigid import rigid_fit, to_planes
from simplexmesh.recognition.rotations import angles_between

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class Match:
    """One hypothesis of how two signatures lie on each other.

    Attributes
    ----------
    rotation : (3, 3) array of float
        R of equation 6.2, proper: ``phi_a(R p) = phi_b(p)``. It turns the sphere of b to that of a; it is not the
        rotation between the objects, which is in `T_a_b`.
    distance : float
        Root mean square difference of the angles over what is visible of both, in radians.
    overlap : float
        The common part, as a share of what is visible of the signature that shows less.
    scale : float
        By how much what is visible of `scaled` was scaled about its center (k of equation 6.8, times what was tried).
    scaled : {"a", "b", ""}
        Which of the two.
    vertices_a, vertices_b : (c,) array of int
        Vertices that correspond, each to the nearest.
    points_a, points_b : (c, 3) array of float
        Points of the two objects that correspond, between vertices where need be.
    normals_a : (c, 3) array of float
        The outward normals of a there.
    shift : (2,) array of float
        For signatures on a torus, a tube or a disc, in radians: how far the places of b are shifted to be those of a,
        around and, on a torus, around the tube as well. `rotation` then turns the model of `SAI.directions` by the
        first of them.
    flipped : bool
        Whether they are turned by half a turn before, both directions reversed.

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
    vertices_a: Indices
    vertices_b: Indices
    points_a: Array
    points_b: Array
    normals_a: Array
    shift: Array = field(default_factory=lambda: np.zeros(2))
    flipped: bool = False

    def __repr__(self) -> str:
        scale = f", scale {self.scale:.2f} of {self.scaled}" if self.scaled else ""
        flip = ", turned over" if self.flipped else ""
        if self.shift.any():
            turn = ", ".join(f"{each + 0.0:.1f}" for each in np.degrees(self.shift).round(1))
            return f"Match(distance {self.distance:.4f}, overlap {self.overlap:.0%}, shifted by {turn} degrees{flip})"
        turned = np.degrees(angles_between(np.eye(3)[None], self.T_a_b[None, :3, :3])[0, 0])
        return f"Match(distance {self.distance:.4f}, overlap {self.overlap:.0%}, turned by {turned:.1f} degrees{scale})"

    @cached_property
    def T_a_b(self) -> Array:
        """(4, 4) the rigid motion that brings object b to object a (section 6.3.3).

        Points that correspond are brought together in least squares (E0), then points to tangent planes (E1): what
        corresponds may have slid along the surface.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> egg = sm.sphere(12)
        >>> egg = egg.moved(egg.vertices * [1.6, 1.3, 1.0] + 0.1 * egg.vertices**2)
        >>> one = sm.sai(egg, frequency=6)
        >>> bool(np.allclose(sm.match(one, one)[0].T_a_b, np.eye(4), atol=1e-6))
        True
        """
        return to_planes(self.points_b, self.points_a, self.normals_a, rigid_fit(self.points_b, self.points_a))
