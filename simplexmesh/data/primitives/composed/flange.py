"""Flanges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.data.primitives.composed.composed import Composed
from simplexmesh.data.primitives.fits import Fit

FAR = 1e4
"""Radii after which a neck ends: as good as never, and near enough for rounding."""

NECK = [((0, 0, 1), (-FAR, 0, 0)), ((0, 0, 1), (0, 0, 0)), ((1, 0, 0), (0, 0, 0)), ((1, 0, 0), (0, 1, 0))]
"""Distances from the axis and heights by the three measures, where the neck begins, at the disc and around that."""


@dataclass(frozen=True, eq=False, repr=False)
class Flange(Composed):
    """The flange at the end of a pipe: a disc with a flat face, and behind it a neck without end.

    Its surface coordinates are the angle about the axis and the length along the profile, from the neck to the middle
    of the face; distances are negative within. Bolts, a bore and a raised face are not of it.

    Attributes
    ----------
    center : (3,) array of float
        The middle of the disc's side at the neck.
    axis : (3,) array of float
        Unit direction from the neck to the face.
    radius, thickness : float
        Of the disc.
    neck_radius : float
        Of the neck, less than that of the disc.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> flange = sm.primitives.Flange([0, 0, 0], [0, 0, 1], 0.1, 0.02, 0.05)
    >>> flange.distance([[0, 0, 0.05], [0.08, 0, -0.01], [0, 0.06, -1]]).round(6)
    array([0.03, 0.01, 0.01])
    """

    kind: ClassVar[str] = "flange"
    parameter_names: ClassVar[tuple[str, ...]] = (
        *("tilt v", "tilt w", "shift v", "shift w", "shift u"),
        *("radius", "thickness", "neck radius"),
    )
    _table: ClassVar[Array] = checks.frozen(np.array([*NECK, ((0, 0, 0), (0, 1, 0))], float))
    _begin: ClassVar[int] = 1

    center: Array
    axis: Array
    radius: float
    thickness: float
    neck_radius: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.neck_radius < self.radius:
            raise ValueError(f"neck_radius must be below the radius, {self.radius:g}, not {self.neck_radius:g}")


@dataclass(frozen=True, eq=False, repr=False)
class FlangePair(Flange):
    """Two flanges bolted together, as most in a plant are: one disc as thick as both of them, and necks on both sides.

    Attributes are those of `Flange`; the axis leads from the center into the disc, and a fit may give either direction.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.primitives.FlangePair([0, 0, 0], [0, 0, 1], 0.1, 0.04, 0.05).distance([[0.06, 0, 7]]).round(6)
    array([0.01])
    """

    kind: ClassVar[str] = "flange pair"
    _table: ClassVar[Array] = checks.frozen(np.array([*NECK, ((0, 0, 1), (0, 1, 0)), ((0, 0, 1), (FAR, 1, 0))], float))
