"""Compare two signatures under all rotations and return the best hypotheses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import warn
from simplexmesh._base.vectors import normalized
from simplexmesh.recognition.sai import _kernels_rotations
from simplexmesh.recognition.sai._kernels_rotations import SignaturePair
from simplexmesh.recognition.sai.attribute_image import SAI
from simplexmesh.recognition.sai.match_result import CANDIDATES, MINIMUM_ANGLE, Match, warn_of_sizes
from simplexmesh.recognition.sai.partial_signatures import COMPLETE, Signature, scale_factor, signature_of
from simplexmesh.recognition.sai.rotations import GROUP_ORDER, Rotations, rotations
from simplexmesh.recognition.sai.shift_matching import match_shifts
from simplexmesh.recognition.sai.sphere_domain import SphereDomain, sphere_domain

SCALES = (0.6, 0.77, 1.0, 1.3, 1.69)
"""Multiples of k that are tried if the scale is not given."""

MOST = 100
"""Hypotheses that may be asked for: of an egg 7 of 100 differ, and the time grows with the square of the number."""

AREAS = 6.0
"""Ratio of areas, for the share of the sphere, up to which one is taken for a part of the other."""


def match(
    source: SAI,
    target: SAI,
    *,
    best: int = 5,
    minimum_overlap: float = 0.5,
    smoothing: int = 2,
    limit: float = 0.3,
    refine: bool = True,
    scale: float | str = "auto",
) -> tuple[Match, ...]:
    """Compare two signatures under all rotations and return the best hypotheses, nearest first.

    Parameters
    ----------
    source, target : SAI
        Of one frequency and topology. Those on a torus, cylinder or disc are compared under all shifts along periodic
        directions, and half turns; `refine` and `scale` are for spheres.
    best : int
        Maximum number of hypotheses, up to 100, each at least 15 degrees from the others.
    minimum_overlap : float
        Minimum size of the common part, as a fraction of the smaller visible part.
    smoothing : int
        Passes of averaging over each vertex and its neighbors before the comparison. Sharper signatures need rotations
        nearer to the true one.
    limit : float
        Angles are clipped to this absolute value, in radians: the magnitude at a tip or pit depends on one or two
        vertices. Pi does not clip.
    refine : bool
        Whether each hypothesis is refined to a local minimum between the rotations of the table.
    scale : float or {"auto"}
        Scale of the smaller visible part, relative to k of equation 6.8. "auto" tries 0.6 to 1.7 if a signature is
        incomplete, and 1 if both are complete.

    Returns
    -------
    tuple of Match
        Empty if no rotation has the minimum overlap.

    Raises
    ------
    ValueError, TypeError

    Warns
    -----
    SimplexMeshWarning
        The objects differ in size, so that no rigid motion maps one to the other, or incomplete ones so much that their
        matches are those of chance.

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
    check_comparable(source, target)
    sai_a, sai_b = target, source
    best = checks.integer("best", best, 1, MOST)
    minimum_overlap = checks.number("minimum_overlap", minimum_overlap, 0.0, 1.0, open_low=True)
    smoothing = checks.integer("smoothing", smoothing, 0)
    limit = checks.number("limit", limit, 0.0, np.pi, open_low=True)
    if sai_a.topology != "sphere":
        if (refine, scale) != (True, "auto"):
            raise ValueError(f"refine and scale are for signatures on spheres, not on a {sai_a.topology}")
        return warn_of_sizes(tuple(match_shifts(sai_a, sai_b, best, minimum_overlap, smoothing, limit)))
    table = rotations(sai_a.frequency)
    domain = sphere_domain(sai_a.frequency)
    hypotheses: list[_Hypothesis] = []
    areas = scale_factor(sai_a, sai_b)
    if min(sai_a.visible_fraction, sai_b.visible_fraction) <= COMPLETE and not 1 / AREAS < areas < AREAS:
        warn(f"target is about {areas**-0.5:.3g} times as large as source: parts are compared in one unit")
    for factor, which in tried_scales(sai_a, sai_b, scale):
        a, b = scaled_signatures(sai_a, sai_b, factor, which, smoothing=smoothing, limit=limit)
        if not (a.seen.any() and b.seen.any()):
            continue
        minimum_common = max(1, int(np.ceil(minimum_overlap * min(a.seen.sum(), b.seen.sum()))))
        for R, distance, common in _best_rotations(a, b, table, domain, minimum_common, best, refine=refine):
            hypotheses.append(_Hypothesis(R, distance, common / min(a.seen.sum(), b.seen.sum()), factor, which, a, b))
    hypotheses.sort(key=lambda hypothesis: hypothesis.distance)
    keep = distinct(np.array([hypothesis.rotation for hypothesis in hypotheses]).reshape(-1, 3, 3), best)
    return warn_of_sizes(tuple(_as_match(hypotheses[k], sai_a, sai_b) for k in keep))


def check_comparable(source: Any, target: Any) -> None:
    """Require two signatures of one frequency and topology."""
    for name, value in (("source", source), ("target", target)):
        if not isinstance(value, SAI):
            raise TypeError(f"{name} must be an SAI, made by sm.sai, not {type(value).__name__}")
    for quality in ("frequency", "topology"):
        a, b = getattr(source, quality), getattr(target, quality)
        if a != b:
            raise ValueError(f"target must have the {quality} of source, {a}, not {b}")


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """A candidate rotation; see `Match`."""

    rotation: Array
    distance: float
    overlap: float
    scale: float
    scaled: str
    a: Signature
    b: Signature


def tried_scales(sai_a: SAI, sai_b: SAI, scale: float | str) -> list[tuple[float, str]]:
    """Return the scales to try, and which signature they apply to: "target" (a), "source" (b), or "" for none."""
    seen_a, seen_b = sai_a.visible_fraction, sai_b.visible_fraction
    complete = min(seen_a, seen_b) > COMPLETE
    if isinstance(scale, str):
        checks.choice("scale", scale, ("auto",))
        if complete:
            return [(1.0, "")]
    else:
        scale = checks.number("scale", scale, 0.0, open_low=True)
        if complete and scale == 1.0:
            return [(1.0, "")]
    which = "target" if seen_a < seen_b else "source"
    k = scale_factor(sai_b, sai_a) if which == "target" else scale_factor(sai_a, sai_b)
    return [(k * factor, which) for factor in (SCALES if isinstance(scale, str) else (scale,))]


def scaled_signatures(
    sai_a: SAI, sai_b: SAI, factor: float, which: str, *, smoothing: int, limit: float
) -> tuple[Signature, Signature]:
    """Return the values of two signatures for comparison, those of one of them scaled as `tried_scales` tells."""
    a = signature_of(sai_a, smoothing=smoothing, limit=limit, scale=factor if which == "target" else 1.0)
    return a, signature_of(sai_b, smoothing=smoothing, limit=limit, scale=factor if which == "source" else 1.0)


def rotation_differences(a: Signature, b: Signature, table: Rotations) -> tuple[Array, Array]:
    """Return the sum of squared differences over commonly visible vertices, and their number, for each rotation."""
    shape = (len(table.representatives), GROUP_ORDER)
    total = np.zeros(shape, np.float32)
    rotated = _rotated_by_group(a.values, table)
    values = b.values.astype(np.float32)
    if a.seen.all() and b.seen.all():
        _kernels_rotations.search(table.maps, rotated, values, total)
        return total.ravel().astype(float), np.full(total.size, float(len(values)))
    common = np.zeros(shape, np.float32)
    seen = _rotated_by_group(a.seen, table)
    _kernels_rotations.search_visible(table.maps, rotated, seen, values, b.seen, total, common)
    return total.ravel().astype(float), common.ravel().astype(float)


def _rotated_by_group(values: NDArray[Any], table: Rotations) -> NDArray[np.float32]:
    """Return (n, 64) the values that each of the 60 icosahedral rotations brings to each vertex, padded with zeros."""
    out = np.zeros((len(values), _kernels_rotations.WIDTH), np.float32)
    out[:, :GROUP_ORDER] = values[table.turns].T
    return out


def _best_rotations(
    a: Signature, b: Signature, table: Rotations, domain: SphereDomain, minimum_common: int, best: int, *, refine: bool
) -> list[tuple[Array, float, float]]:
    """Return the rotations with the smallest distances, these distances and the numbers of common vertices."""
    maximum = CANDIDATES * best if refine else best
    total, common = rotation_differences(a, b, table)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(common >= minimum_common, total / common, np.inf)
    order = np.argpartition(mean, min(40 * maximum, len(mean) - 1))[: 40 * maximum]
    order = order[np.argsort(mean[order], kind="stable")]
    order = order[np.isfinite(mean[order])]
    kept = order[distinct(table.matrices[order], maximum)]
    turns, distance, shared = table.matrices[kept].copy(), np.sqrt(mean[kept]), common[kept]
    if refine and len(kept):
        near = table.turns[(kept % GROUP_ORDER)[:, None], table.maps[kept // GROUP_ORDER]].astype(np.int64)
        distance, shared = _refined(turns, near, a, b, domain, minimum_common, 4)
        order = np.argsort(distance, kind="stable")
        kept = order[distinct(turns[order], best)]
        turns, near = turns[kept], near[kept]
        distance, shared = _refined(turns, near, a, b, domain, minimum_common, 25)
    return [(turns[k], float(distance[k]), float(shared[k])) for k in np.flatnonzero(np.isfinite(distance))]


def distinct(turns: Array, maximum: int) -> list[int]:
    """Return up to `maximum` indices of rotations (k, 3, 3), each at least `MINIMUM_ANGLE` from those before it."""
    kept: list[int] = []
    limit = 1 + 2 * np.cos(MINIMUM_ANGLE)
    for k in range(len(turns)):
        if len(kept) == maximum:
            break
        if not kept or np.einsum("kab,ab->k", turns[kept], turns[k]).max() < limit:
            kept.append(k)
    return kept


def _refined(
    turns: Array, near: Indices, a: Signature, b: Signature, domain: SphereDomain, minimum_common: int, steps: int
) -> tuple[Array, Array]:
    """Refine rotations to local minima of the distance, in place; return distances and numbers of common vertices."""
    distance, common = np.zeros(len(turns)), np.zeros(len(turns))
    pair = SignaturePair(a.values, domain.face_means(a.values), a.seen, b.values, b.seen)
    _kernels_rotations.refine(turns, near, pair, domain.arrays, minimum_common, steps, distance, common)
    return np.sqrt(distance), common


def _as_match(hypothesis: _Hypothesis, sai_a: SAI, sai_b: SAI) -> Match:
    """Return the match of a hypothesis, with its correspondences."""
    domain = sphere_domain(sai_a.frequency)
    locations = domain.locate(domain.vertices @ hypothesis.rotation.T)
    common = hypothesis.b.seen & hypothesis.a.seen[locations.vertex]
    on_a = domain.interpolated(hypothesis.a.sources, locations)[common]
    location_a, location_b = domain.locate(normalized(on_a)), domain.locate(hypothesis.b.sources[common])
    return Match(
        rotation=checks.frozen(hypothesis.rotation),
        distance=hypothesis.distance,
        overlap=hypothesis.overlap,
        scale=hypothesis.scale,
        scaled=hypothesis.scaled,
        vertices_target=checks.frozen(location_a.vertex),
        vertices_source=checks.frozen(location_b.vertex),
        points_target=checks.frozen(domain.interpolated(sai_a.mesh.vertices, location_a)),
        points_source=checks.frozen(domain.interpolated(sai_b.mesh.vertices, location_b)),
        normals_target=checks.frozen(normalized(domain.interpolated(sai_a.mesh.normals, location_a))),
    )
