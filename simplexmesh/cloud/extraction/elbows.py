"""Bends that are seen alone: what was found of them with more noise than there is may be pieces of one torus."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.arrays import Mask
from simplexmesh.cloud.extraction.bends import WIDEST
from simplexmesh.cloud.extraction.growth import (
    DECISIVE,
    FITTED,
    UNEVEN,
    WIDE,
    Grown,
    connected,
    distances,
    evidence,
    grown,
    thinned,
)
from simplexmesh.cloud.extraction.patches import Limits, fit, refined
from simplexmesh.cloud.extraction.working import Working
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.fitting.starts import bent
from simplexmesh.data.primitives import Cylinder, Primitive, Torus


def with_elbows(work: Working, found: list[Grown], limits: Limits, rng: np.random.Generator) -> list[Grown]:
    """Return finds, some of which became elbows, and the others lost the points of those."""
    out, free = list(found), np.ones(len(work.points), bool)
    for k, each in enumerate(found):
        even = each.noise <= work.noise and not isinstance(each.primitive, Torus)
        if even or not free[each.members].all():
            continue
        elbow = elbow_of(work, each, free, limits, rng)
        if elbow is None:
            continue
        left = [without(work, other, elbow) for other in out]
        lost = sum(before.evidence - after.evidence for before, after in zip(out, left, strict=True))
        if elbow.evidence > lost + DECISIVE:
            out = left
            out[k] = elbow
            free[elbow.members] = False
    return [each for each in out if len(each.members) >= limits.fewest]


def elbow_of(work: Working, piece: Grown, free: Mask, limits: Limits, rng: np.random.Generator) -> Grown | None:
    """Return the torus that a find is a piece of, if it has no more noise than the cloud, or clearly less than that."""
    torus: Primitive | None = piece.primitive
    if piece.noise > work.noise:
        which = thinned(piece.members, FITTED, rng)
        some = work.points[which]
        around = torus if isinstance(torus, Cylinder) else fit("cylinder", some, work.normals[which])
        torus = bent(some, refined(around, some)) if isinstance(around, Cylinder) else None
    if torus is None:
        return None
    for band in (WIDE, WITHIN):
        about = connected(work, torus, free, piece.members, band * piece.noise)[0]
        if len(about) < limits.fewest:
            return None
        torus = refined(torus, work.points[thinned(about, FITTED, rng)], WITHIN * piece.noise)
    whole = grown(work, torus, free, piece.members, replace(limits, kinds=("torus",)), rng)
    suits = whole.noise <= max(work.noise, piece.noise / UNEVEN) and is_bend(whole.primitive)
    return whole if suits and len(whole.members) >= limits.fewest else None


def is_bend(primitive: Primitive) -> bool:
    """Tell whether a primitive is a torus as narrow as bends are: wider ones are pipes with a little of their bends."""
    return isinstance(primitive, Torus) and primitive.radius <= WIDEST * primitive.tube_radius


def without(work: Working, each: Grown, elbow: Grown) -> Grown:
    """Return a find without the points of an elbow."""
    left = np.setdiff1d(each.members, elbow.members)
    off = distances(work, each.primitive, left)
    return replace(each, members=left, evidence=max(evidence(work, each.primitive, off, each.noise), 0.0))
