"""Two signatures compared under all rotations: the few under which they agree best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh._vec import normalized
from simplexmesh.recognition import _kernels_match
from simplexmesh.recognition.matches import Match
from simplexmesh.recognition.occlusion import WHOLE, Signature, scale_factor, signature_of
from simplexmesh.recognition.rotations import FAMILIES, TURNS, Rotations, rotations
from simplexmesh.recognition.sai import SAI
from simplexmesh.recognition.sliding import slid
from simplexmesh.recognition.sphere_domain import SphereDomain, sphere_domain

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SCALES = (0.6, 0.77, 1.0, 1.3, 1.69)
"""Where scale is not known, k is tried times each of these."""

APART = np.radians(15.0)
"""Hypotheses nearer to each other than this are one."""

CANDIDATES = 4
"""So many times more hypotheses are followed to their minimum than are asked for."""

FIRST_STEPS, LAST_STEPS = 4, 25
LONGEST = np.radians(6.0)


def match(
    sai_a: SAI,
    sai_b: SAI,
    *,
    best: int = 5,
    minimum_overlap: float = 0.5,
    method: str = "even",
    smoothing: int = 2,
    limit: float = 0.3,
    refine: bool = True,
    scale: float | str = "auto",
) -> list[Match]:
    """Compare two signatures under all rotations and return the best hypotheses, nearest first.

    Parameters
    ----------
    sai_a, sai_b : SAI
        Of one frequency and topology. Those on a torus, a tube or a disc are compared under all shifts along the
        directions that are closed, and half turns; `method`, `refine` and `scale` are for spheres.
    best : int
        How many hypotheses to return at most, each at least 15 degrees from the others.
    minimum_overlap : float
        The least part in common, as a share of what is visible of the one that shows less.
    method : {"even", "darts"}
        Which rotations are tried: see `simplexmesh.recognition.rotations`. The 3n of the thesis are "darts".
    smoothing : int
        How often angles are averaged with their neighbors' before they are compared; the sharper a signature is, the
        nearer a rotation must be to be noticed.
    limit : float
        Angles beyond this, in radians, count as this: tips and pits say that they are there, but how sharp they are is
        a matter of a vertex or two. Pi leaves them as they are.
    refine : bool
        Whether each hypothesis is followed to its minimum between the rotations of the table.
    scale : float or {"auto"}
        By how much what is visible of the one that shows less is scaled, over k of equation 6.8. "auto" tries 0.6 to
        1.7 where one of them is incomplete, and leaves complete ones alone.

    Returns
    -------
    list of Match
        Empty when no rotation leaves the overlap asked for.

    Raises
    ------
    ValueError, TypeError

    References
    ----------
    H. Delingette, thesis, 1994, section 6.3 (equations 6.2 to 6.4 and 6.8 to 6.10).

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.sphere(12)
    >>> egg = egg.moved(egg.vertices * [1.6, 1.3, 1.0] + 0.1 * egg.vertices**2)
    >>> signature = sm.sai(egg, frequency=6)
    >>> sm.match(signature, signature)[0].distance < 1e-6
    True
    """
    comparable(sai_a, sai_b)
    best = _check.integer("best", best, 1)
    minimum_overlap = _check.number("minimum_overlap", minimum_overlap, 0.0, 1.0, open_low=True)
    smoothing = _check.integer("smoothing", smoothing, 0)
    limit = _check.number("limit", limit, 0.0, np.pi, open_low=True)
    _check.choice("method", method, FAMILIES)
    if sai_a.topology != "sphere":
        if (method, refine, scale) != ("even", True, "auto"):
            raise ValueError(f"method, refine and scale are for signatures on spheres, not on a {sai_a.topology}")
        return slid(sai_a, sai_b, best, minimum_overlap, smoothing, limit)
    table = rotations(sai_a.frequency, method)
    here = sphere_domain(sai_a.frequency)
    found: list[_Hypothesis] = []
    for factor, which in _scales(sai_a, sai_b, scale):
        a = signature_of(sai_a, smoothing=smoothing, limit=limit, scale=factor if which == "a" else 1.0)
        b = signature_of(sai_b, smoothing=smoothing, limit=limit, scale=factor if which == "b" else 1.0)
        if not (a.seen.any() and b.seen.any()):
            continue
        least = max(1, int(np.ceil(minimum_overlap * min(a.seen.sum(), b.seen.sum()))))
        for R, distance, common in _turns(a, b, table, here, least, best, refine=refine):
            found.append(_Hypothesis(R, distance, common / min(a.seen.sum(), b.seen.sum()), factor, which, a, b))
    found.sort(key=lambda one: one.distance)
    keep = separate(np.array([one.rotation for one in found]).reshape(-1, 3, 3), best)
    return [_told(found[k], sai_a, sai_b) for k in keep]


def comparable(sai_a: Any, sai_b: Any) -> None:
    """Refuse what is no pair of signatures of one kind.

    Raises
    ------
    ValueError, TypeError
    """
    for name, one in (("sai_a", sai_a), ("sai_b", sai_b)):
        if not isinstance(one, SAI):
            raise TypeError(f"{name} must be an SAI, made by sm.sai, not {type(one).__name__}")
    for quality in ("frequency", "topology"):
        a, b = getattr(sai_a, quality), getattr(sai_b, quality)
        if a != b:
            raise ValueError(f"sai_b must have the {quality} of sai_a, {a}, not {b}")


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """A rotation that may be kept; see `Match`."""

    rotation: Array
    distance: float
    overlap: float
    scale: float
    scaled: str
    a: Signature
    b: Signature


def _scales(sai_a: SAI, sai_b: SAI, scale: float | str) -> list[tuple[float, str]]:
    """Return the scales to try, and of which signature what is visible is scaled."""
    seen_a, seen_b = sai_a.visible_fraction, sai_b.visible_fraction
    complete = min(seen_a, seen_b) > WHOLE
    if isinstance(scale, str):
        _check.choice("scale", scale, ("auto",))
        if complete:
            return [(1.0, "")]
    else:
        scale = _check.number("scale", scale, 0.0, open_low=True)
        if complete and scale == 1.0:
            return [(1.0, "")]
    which = "a" if seen_a < seen_b else "b"
    k = scale_factor(sai_b, sai_a) if which == "a" else scale_factor(sai_a, sai_b)
    return [(k * factor, which) for factor in (SCALES if isinstance(scale, str) else (scale,))]


def searched(a: Signature, b: Signature, table: Rotations) -> tuple[Array, Array]:
    """Return, for every rotation of a table, the sum of squared differences over what is seen of both, and its size.

    Returns
    -------
    total, common : (len(table),) arrays of float
    """
    shape = (len(table.representatives), TURNS)
    total = np.zeros(shape, np.float32)
    turned = _turned(a.values, table)
    values = b.values.astype(np.float32)
    if a.seen.all() and b.seen.all():
        _kernels_match.search(table.maps, turned, values, total)
        return total.ravel().astype(float), np.full(total.size, float(len(values)))
    common = np.zeros(shape, np.float32)
    seen = _turned(a.seen, table)
    _kernels_match.search_seen(table.maps, turned, seen, values, b.seen, total, common)
    return total.ravel().astype(float), common.ravel().astype(float)


def _turned(values: NDArray[Any], table: Rotations) -> NDArray[np.float32]:
    """Return (n, 64) what each of the 60 turns of the icosahedron brings to each vertex."""
    out = np.zeros((len(values), _kernels_match.WIDTH), np.float32)
    out[:, :TURNS] = values[table.turns].T
    return out


def _turns(a: Signature, b: Signature, table: Rotations, here: SphereDomain, least: int, best: int, *,
           refine: bool) -> list[tuple[Array, float, float]]:  # fmt: skip
    """Return the rotations under which two signatures differ least, their distance and how many vertices are common."""
    most = CANDIDATES * best if refine else best
    total, common = searched(a, b, table)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(common >= least, total / common, np.inf)
    order = np.argpartition(mean, min(40 * most, len(mean) - 1))[: 40 * most]
    order = order[np.argsort(mean[order], kind="stable")]
    order = order[np.isfinite(mean[order])]
    kept = order[separate(table.matrices[order], most)]
    turns, distance, shared = table.matrices[kept].copy(), np.sqrt(mean[kept]), common[kept]
    if refine and len(kept):
        near = table.turns[(kept % TURNS)[:, None], table.maps[kept // TURNS]].astype(np.int64)
        distance, shared = _followed(turns, near, a, b, here, least, FIRST_STEPS)
        order = np.argsort(distance, kind="stable")
        kept = order[separate(turns[order], best)]
        turns, near = turns[kept], near[kept]
        distance, shared = _followed(turns, near, a, b, here, least, LAST_STEPS)
    return [(turns[k], float(distance[k]), float(shared[k])) for k in np.flatnonzero(np.isfinite(distance))]


def separate(turns: Array, most: int) -> list[int]:
    """Return which rotations (k, 3, 3), in order, are at least `APART` from all kept before, at most so many.

    Examples
    --------
    >>> separate(np.stack([np.eye(3), np.eye(3), np.diag([1.0, -1, -1])]), 5)
    [0, 2]
    """
    kept: list[int] = []
    limit = 1 + 2 * np.cos(APART)
    for k in range(len(turns)):
        if len(kept) == most:
            break
        if not kept or np.einsum("kab,ab->k", turns[kept], turns[k]).max() < limit:
            kept.append(k)
    return kept


def _followed(turns: Array, near: Indices, a: Signature, b: Signature, here: SphereDomain, least: int,
              steps: int) -> tuple[Array, Array]:  # fmt: skip
    """Follow rotations toward the least distance around, in place; return distances and numbers of common vertices."""
    distance, common = np.zeros(len(turns)), np.zeros(len(turns))
    _kernels_match.follow(
        *(turns, here.vertices, near, a.values, here.face_means(a.values), a.seen, b.values, b.seen),
        *(here.vertices, here.mesh.neighbors, here.mesh.connectivity.face, here.centers),
        *(least, steps, LONGEST, distance, common),
    )
    return np.sqrt(distance), common


def _told(one: _Hypothesis, sai_a: SAI, sai_b: SAI) -> Match:
    """Return a hypothesis with the correspondences it makes."""
    here = sphere_domain(sai_a.frequency)
    places = here.locate(here.vertices @ one.rotation.T)
    common = one.b.seen & one.a.seen[places.vertex]
    on_a = here.interpolated(one.a.sources, places)[common]
    place_a, place_b = here.locate(normalized(on_a)), here.locate(one.b.sources[common])
    return Match(
        rotation=_check.frozen(one.rotation),
        distance=one.distance,
        overlap=one.overlap,
        scale=one.scale,
        scaled=one.scaled,
        vertices_a=_check.frozen(place_a.vertex),
        vertices_b=_check.frozen(place_b.vertex),
        points_a=_check.frozen(here.interpolated(sai_a.mesh.vertices, place_a)),
        points_b=_check.frozen(here.interpolated(sai_b.mesh.vertices, place_b)),
        normals_a=_check.frozen(normalized(here.interpolated(sai_a.mesh.normals, place_a))),
    )
