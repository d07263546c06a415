"""How well found primitives agree with the true shapes of a scene, and elbows with their pipes."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment

from simplexmesh._base.vectors import cross, norm, normalized
from tests.surface.features.scoring import rand_index

OVERLAP = 0.5
"""A found primitive is a true shape's if of the points of either they have more in common: no other can be."""

RADIUS = 0.1
"""... if its radii are wrong by a smaller share, the bend radius by twice as much,"""

PLACE = 0.1
"""... if it is away from the middle of the true one by a smaller share of its size,"""

ANGLE = np.radians(5)
"""... and its direction by less. Not meant to tell good from better, for which there are the errors."""

KINDS = ("plane", "cylinder", "torus", "sphere", "cone")


@dataclass(frozen=True)
class Score:
    """What was found of a scene: shares, errors of those found (NaN of none), radii relative, angles in radians.

    `index` is the adjusted Rand index of the labels of all points, `curved_index` of those not on planes, which have
    most; `claimed` the share of outliers that got a label. `found` and `true` count by kind; `pairs` are (found, true)
    numbers. `tangency` is how far the elbows, whose pipes were found too, are from continuing them: by place and
    radius in tube radii, or by angle, whichever is most.
    """

    precision: float
    recall: float
    index: float
    curved_index: float
    claimed: float
    radius: float
    worst_radius: float
    bend_radius: float
    worst_bend_radius: float
    axis: float
    worst_axis: float
    tangency: float
    found: Counter = field(default_factory=Counter)
    true: Counter = field(default_factory=Counter)
    pairs: tuple[tuple[int, int], ...] = ()


def score(primitives, labels, scene, least=1):
    """Compare primitives, and which of them (or -1) each point is of, with a scene.

    Primitives have a `kind` and parameters by name. Shapes with fewer points than `least` need not be found.
    """
    labels = np.asarray(labels)
    if labels.shape != scene.labels.shape or labels.min(initial=-1) < -1 or labels.max(initial=-1) >= len(primitives):
        raise ValueError("labels must be one number of a primitive, or -1, for each point of the scene")
    asked = np.bincount(scene.labels[scene.labels >= 0], minlength=len(scene.shapes)) >= least
    pairs = matched(primitives, labels, scene)
    hits = [pair for pair in pairs if asked[pair[1]]]
    wrong = [errors(primitives[a], scene.shapes[b], scene.points[scene.labels == b]) for a, b in hits]
    radius, bend = ([each[name] for each in wrong if name in each] for name in ("radius", "bend_radius"))
    axis = [each["axis"] for each in wrong if "axis" in each]
    curved = np.isin(scene.labels, [k for k, shape in enumerate(scene.shapes) if shape.kind != "plane"])
    strays = labels[scene.labels < 0]
    return Score(
        precision=ratio(len(hits), len(primitives) - (len(pairs) - len(hits))),
        recall=ratio(len(hits), asked.sum()),
        index=rand_index(labels, scene.labels),
        curved_index=rand_index(labels[curved], scene.labels[curved]) if curved.any() else np.nan,
        claimed=float((strays >= 0).mean()) if len(strays) else np.nan,
        **dict(zip(("radius", "worst_radius"), middle_and_most(radius), strict=True)),
        **dict(zip(("bend_radius", "worst_bend_radius"), middle_and_most(bend), strict=True)),
        **dict(zip(("axis", "worst_axis"), middle_and_most(axis), strict=True)),
        tangency=max(tangencies(primitives, scene, {b: a for a, b in hits}), default=np.nan),
        found=Counter(scene.shapes[b].kind for _, b in hits),
        true=Counter(shape.kind for shape, one in zip(scene.shapes, asked, strict=True) if one),
        pairs=tuple(pairs),
    )


def ratio(part, whole):
    return float(part / whole) if whole else np.nan


def middle_and_most(values):
    return (float(np.median(values)), float(max(values))) if values else (np.nan, np.nan)


def matched(primitives, labels, scene):
    """Pairs (found, true) of the same kind whose points overlap and whose parameters agree, one to one."""
    shapes = scene.shapes
    table = np.zeros((len(primitives) + 1, len(shapes) + 1))
    np.add.at(table, (labels, scene.labels), 1)
    common = table[:-1, :-1]
    either = table[:-1].sum(axis=1)[:, None] + table[:, :-1].sum(axis=0) - common
    overlap = np.divide(common, either, out=np.zeros_like(common), where=either > 0)
    for a, b in np.argwhere(overlap > OVERLAP):
        alike = primitives[a].kind == shapes[b].kind
        if not (alike and agree(errors(primitives[a], shapes[b], scene.points[scene.labels == b]))):
            overlap[a, b] = 0
    pairs = zip(*linear_sum_assignment(-overlap), strict=True)
    return [(int(a), int(b)) for a, b in pairs if overlap[a, b] > OVERLAP]


def agree(wrong):
    limits = {"radius": RADIUS, "bend_radius": 2 * RADIUS, "place": PLACE, "axis": ANGLE, "half_angle": ANGLE}
    return all(value <= limits[name] for name, value in wrong.items())


def errors(found, true, points):
    """Errors of a found primitive: radii relative, place in sizes of the true one at its points, angles in radians."""
    middle = points.mean(axis=0)
    size = float(norm(points - middle).max())
    if true.kind == "plane":
        away = abs((middle - found.point) @ found.normal)
        return {"axis": between(found.normal, true.normal), "place": away / size}
    if true.kind == "sphere":
        away = norm(found.center - true.center)
        return {"radius": relative(found.radius, true.radius), "place": float(away) / true.radius}
    if true.kind == "torus":
        return {
            "radius": relative(found.tube_radius, true.tube_radius),
            "bend_radius": relative(found.radius, true.radius),
            "place": float(norm(found.center - true.center)) / (2 * true.radius),
            "axis": between(found.axis, true.axis),
        }
    on_axis = true.point + ((middle - true.point) @ true.axis) * true.axis
    away = float(norm(cross(found.axis, on_axis - found.point)))
    wrong = {"axis": between(found.axis, true.axis), "place": away / size}
    if true.kind == "cylinder":
        return wrong | {"radius": relative(found.radius, true.radius)}
    return wrong | {"half_angle": abs(found.half_angle - true.half_angle)}


def relative(found, true):
    return abs(found - true) / true


def between(one, other):
    """The angle between two lines; as accurate for small ones."""
    return float(np.arctan2(norm(cross(np.asarray(one), np.asarray(other))), abs(np.dot(one, other))))


def tangencies(primitives, scene, found):
    """How far each elbow is from continuing each of its pipes, of those that were found: {true: found}."""
    for number, shape in enumerate(scene.shapes):
        joins = [other for other in getattr(shape, "joins", ()) if {number, other} <= found.keys()]
        yield from (untangent(primitives[found[number]], primitives[found[other]]) for other in joins)


def untangent(torus, pipe):
    """How far a torus is from being tangent to a cylinder along a circle; 0 for an elbow and its pipe.

    The largest of: the difference of their radii, of the axis' distance from the center and the bend radius, the axis'
    height over the torus' plane where it is nearest to the center, each in tube radii, and of its angle to that plane.
    """
    along, up = normalized(np.asarray(pipe.axis)), normalized(np.asarray(torus.axis))
    foot = pipe.point + ((torus.center - pipe.point) @ along) * along - torus.center
    height = foot @ up
    lengths = (pipe.radius - torus.tube_radius, norm(foot - height * up) - torus.radius, height)
    return float(max(*(abs(each) / torus.tube_radius for each in lengths), abs(np.arcsin(np.clip(along @ up, -1, 1)))))
