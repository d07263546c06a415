"""What is given to a fit, checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.vectors import norm, normalized
from simplexmesh.cloud.fitting.candidates import Known
from simplexmesh.cloud.fitting.starts import scaled
from simplexmesh.cloud.validation.validation import ROUNDING
from simplexmesh.data.conversion import as_points
from simplexmesh.data.points import warn_of_steps
from simplexmesh.data.primitives import (
    Beam,
    Circle,
    Cone,
    Cylinder,
    Flange,
    FlangePair,
    Line,
    Plane,
    Primitive,
    Sphere,
    Torus,
)

KINDS: dict[str, type[Primitive]] = {
    each.kind: each for each in (Plane, Sphere, Cylinder, Cone, Torus, Line, Circle, Beam, Flange, FlangePair)
}
"""All kinds."""

HELD = {
    "axis": ("tilt",),
    "point": ("shift", "x", "y", "z"),
    "radius": ("radius",),
    "tube_radius": ("tube",),
    "half_angle": ("half angle",),
}
"""How the parameters of charts begin that are known with an argument, unless they are called as that is."""

UNITLESS = ("axis", "point", "half_angle")
"""Arguments of known parameters that are no lengths."""


@dataclass(frozen=True, eq=False)
class Given:
    """What is given to a fit: in the user's unit the points, about their middle and of unit size what starts it."""

    points: Array
    normals: Array | None
    weights: Array | None  # of mean 1
    known: Known
    start: Primitive | None
    robust: bool
    noise: float | None
    rng: np.random.Generator
    middle: Array
    size: float
    flat: bool  # whether the points are in a plane, but for rounding

    @property
    def unit(self) -> Array:
        """The points about the origin and of unit size."""
        return (self.points - self.middle) / self.size


Rows = tuple[Array, Array | None, Array | None]
"""Points (n, 3), their normals and weights."""


def rows(points: Any, normals: ArrayLike | None, weights: ArrayLike | None) -> Rows:
    """Return the points that a fit uses, their normals and their weights of mean 1, or say what is wrong with them."""
    cloud = None if isinstance(points, np.ndarray | list | tuple) else as_points(points)
    at = checks.array("points", points if cloud is None else cloud.points, (None, 3))
    warn_of_steps(at)
    normals = cloud.normals if normals is None and cloud is not None else normals
    across = None if normals is None else normalized(checks.array("normals", normals, (len(at), 3)))
    mass = None if weights is None else checks.array("weights", weights, (len(at),))
    if mass is not None:
        if (mass < 0).any() or not mass.any():
            raise ValueError(f"weights must be at least 0 and not all 0, not {mass.min():g} to {mass.max():g}")
        used = mass > 0
        at, mass, across = at[used], mass[used] / mass[used].mean(), None if across is None else across[used]
    return at, across, mass


def checked(
    kind: str, known: Known, start: Primitive | None, given: Rows, *, robust: bool, noise: float | None, rng: Any
) -> Given:
    """Return what is given to a fit, or say what is wrong with it."""
    if checks.flag("robust", robust) and given[2] is not None:
        raise ValueError("weights must not be given to a robust fit, which finds its own")
    known = _known(kind, known)
    middle, size, flat = _frame(given[0], kind, known)
    if start is not None:
        start = scaled(scaled(_start(kind, start), 1.0, -middle), 1 / size, np.zeros(3))
    sigma = None if noise is None else checks.number("noise", noise, 0.0, open_low=True)
    generator = checks.generator("rng", rng)
    return Given(*given, known, start, robust, sigma, generator, middle, size, flat)


def held(kind: str, known: Known) -> Mask | None:
    """Return which parameters of a kind's chart are known, None if none are."""
    if not known:
        return None
    begins = tuple(begin for name in known for begin in _begins(name))
    return np.array([name.startswith(begins) for name in KINDS[kind].parameter_names])


def in_unit(given: Given) -> Known:
    """Return what is known, in the unit of the size of the points and about their middle."""
    lengths = {name: value / given.size for name, value in given.known.items() if name not in UNITLESS}
    place = {"point": (given.known["point"] - given.middle) / given.size} if "point" in given.known else {}
    return given.known | lengths | place


def _known(kind: str, given: Known) -> Known:
    """Return the known parameters, checked."""
    out: Known = {}
    for name, value in given.items():
        if value is None:
            continue
        if kind == "any":
            raise ValueError(f"{name} must be left out where any kind is looked for")
        if not any(each.startswith(_begins(name)) for each in KINDS[kind].parameter_names):
            raise ValueError(f"{name} must be left out: a {kind} has none")
        if name == "axis":
            out[name] = normalized(checks.array(name, value, (3,)))
            if not norm(out[name]) > 0:
                raise ValueError("axis must be a direction, not a vector of length 0")
        elif name == "point":
            out[name] = checks.array(name, value, (3,))
        else:
            out[name] = checks.number(name, value, 0.0, open_low=True)
    if out.get("half_angle", 0.0) >= np.pi / 2:
        raise ValueError(f"half_angle must be below pi / 2, in radians, not {out['half_angle']:g}")
    return out


def _begins(name: str) -> tuple[str, ...]:
    return HELD.get(name, (str(name).replace("_", " "),))


def _start(kind: str, start: Primitive) -> Primitive:
    if kind == "any" or not isinstance(start, Primitive) or start.kind != kind:
        raise TypeError(f"start must be a {kind}, not a {checks.type_name(start)}")
    return start


def _frame(points: Array, kind: str, known: Known) -> tuple[Array, float, bool]:
    """Return the middle and the size of points, and whether they are flat; refuse those that determine nothing."""
    wanted = "plane" if kind == "any" else kind
    mask = held(wanted, known)
    free = len(KINDS[wanted].parameter_names) if mask is None else int((~mask).sum())
    least = max(-(-free // KINDS[wanted].per_point), 1)
    if len(points) < least:
        raise ValueError(f"points must be at least {least} to determine a {wanted}, not {len(points)}")
    bounds = np.stack([points.min(axis=0), points.max(axis=0)])
    checks.size("points", bounds)
    if least > 1 and (bounds[0] == bounds[1]).all():
        raise ValueError(f"points must differ, but all {len(points):,} are at one place")
    few = len(np.unique(points[:: -(-len(points) // 1000)], axis=0)) < least
    if few and (different := len(np.unique(points, axis=0))) < least:
        raise ValueError(f"points must be at least {least} different ones to determine a {wanted}, not {different}")
    middle = points.mean(axis=0)
    size = float(norm(points - middle).max()) or 1.0
    rounding = ROUNDING * float(np.abs(points).max())
    some = points[:: -(-len(points) // 2000)] - middle
    extents = np.append(np.linalg.svd(some, compute_uv=False), np.zeros(3))[:3] / np.sqrt(len(some))
    flat = bool(extents[2] <= rounding)
    if not known and kind not in ("line", "any") and extents[1] <= rounding:
        raise ValueError(f"points must not lie on one line: they do not determine a {kind}")
    if not known and flat and kind not in ("line", "any", "plane", "circle"):
        raise ValueError(f"points must not lie in one plane: they do not determine a {kind}")
    return middle, size, flat
