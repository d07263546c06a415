"""Mechanical parts with exactly known creases and patches, in the tessellations that programs and scanners make."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import simplexmesh as sm
from tests.surface.features.reference import Reference
from tests.surface.features.remeshing import halves, remeshed, scanned
from tests.surface.features.scoring import lengths
from tests.surface.features.solids import Solid, ball, box, pose, profile, rod

KINDS = ("aligned", "irregular", "sliver", "scan")


@dataclass(frozen=True, eq=False)
class Part:
    """A closed mesh, its exact sharp and soft creases as segments (k, 2, 3), patches (t,) and their kinds, and the mean
    edge length."""

    mesh: sm.TriangleMesh
    creases: np.ndarray
    soft: np.ndarray
    patches: np.ndarray
    kinds: dict[int, str]
    edge: float
    name: str


def tessellated(reference, kind, edge, seed=0):
    """The part of a reference in triangles of about a given edge length, of one of the KINDS."""
    rng = np.random.default_rng(seed)
    if kind == "sliver":
        vertices, faces, labels = reference.built(max(16, round(0.6 * np.pi / edge)))
    elif kind == "scan":
        vertices, faces = scanned(reference, edge, rng)
        labels = None
    else:
        vertices, faces, labels = remeshed(reference, edge, rng, even=kind == "aligned")
    mesh = sm.TriangleMesh(vertices, faces)
    if labels is None:
        nearest = reference.nearest(vertices[faces].mean(axis=1))[0]
        patches, labels = reference.fine_patches[nearest], reference.fine[2][nearest]
    else:
        patches = reference.patches(vertices, faces, labels)
    kinds = {}
    for patch in np.unique(patches).tolist():
        on = np.unique(labels[patches == patch])
        kinds[patch] = "free form" if len(on) > 1 else reference.kind(on[0])
    ends, half = halves(faces)
    mean = float(lengths(vertices[ends[half[:, 0]]]).mean())
    return Part(mesh, *reference.creases, patches, kinds, mean, reference.name)


def noisy(part, share, seed=0):
    """The part with every vertex moved by normally distributed noise, its deviation in mean edges."""
    moves = share * part.edge * np.random.default_rng(seed).normal(size=part.mesh.vertices.shape)
    return replace(part, mesh=sm.TriangleMesh(part.mesh.vertices + moves, part.mesh.faces))


def block(rng):
    """A fillet along an edge, a chamfer, a top folded by 20 degrees, a boss, and a hole through the folded part."""
    fold, boss, hole = rng.uniform([1.5, 0.2, 0.2], [1.8, 0.3, 0.3])
    right = 1 - (3 - fold) * np.tan(np.radians(20))
    side = profile((0.2, 0), (3, 0), (3, right), (fold, 1), (0, 1), (0, 0.2), radii=[(4, 0.25)])
    return [
        ("+", Solid(side, 1.4, pose(0, 1.4, 0, (0, -1, 0)))),
        ("+", rod(boss, 0.5, 1.3, pose(0.8, 0.7))),
        ("-", rod(hole, -1, 2, pose(2.35, 0.7))),
    ]


def plate(rng):
    """Two ribs that cross, one of them flush with the plate, and holes."""
    rib, thick = rng.uniform([1.2, 0.25], [1.6, 0.35])
    holes = [(x, y, rng.uniform(0.12, 0.22)) for x in (0.5, 2.5) for y in (0.5, 1.5)]
    return [
        ("+", box((0, 0, 0), (3, 2, thick))),
        ("+", box((rib, 0, 0.1), (rib + 0.3, 2, 0.9))),
        ("+", box((0.3, 0.85, 0.1), (2.7, 1.15, 0.7))),
        *(("-", rod(r, -1, 1, pose(x, y))) for x, y, r in holes),
    ]


def crossing(rng):
    """A cylinder, another one out of it across, and a third one on it askew."""
    inner, outer, tilt = rng.uniform([0.3, 0.25, 0.3], [0.45, 0.35, 0.8])
    return [
        ("+", rod(0.6, 0, 2.4)),
        ("+", rod(outer, 0, 1.3, pose(0, 0, 1.6, (0, 1, tilt)))),
        ("-", rod(inner, -2, 2, pose(0.05, 0, 0.7, (1, 0, 0)))),
    ]


def dome(rng):
    """A ball cut by planes, with a round pocket."""
    a, b, c = rng.uniform(0.3, 0.55, 3)
    return [
        ("+", ball(1, (0, 0, 0))),
        ("&", box((-a, -b, -c), (2, 2, 2))),
        ("-", ball(0.45, (0.6, 0.5, 0.7))),
    ]


def tip(rng):
    """A cone on a cylinder on a disk, with a bore from below that ends in a hemisphere."""
    r, slope, bore = rng.uniform([0.5, 0.4, 0.2], [0.7, 1.2, 0.3])
    side = profile((0, 0), (1, 0), (1, 0.3), (r, 0.3), (r, 1), (0.15, 1 + slope), (0, 1 + slope))
    inside = np.array([[0, -1, 0], [bore, -1, 0], [bore, 0.6, np.tan(np.pi / 8)], [0, 0.6 + bore, 0]])
    return [("+", Solid(side)), ("-", Solid(inside))]


def bracket(rng):
    """An angle, rounded inside, with a gusset and holes, one of them countersunk."""
    thick, inside, hole = rng.uniform([0.25, 0.15, 0.15], [0.35, 0.3, 0.22])
    side = profile((0, 0), (2, 0), (2, thick), (thick, thick), (thick, 1.6), (0, 1.6), radii=[(3, inside)])
    gusset = Solid(profile((0.1, 0.1), (1, 0.1), (0.1, 1.2)), 0.25, pose(0, 0.9, 0, (0, -1, 0)))
    sink = profile((0, -1), (hole, -1), (hole, thick / 2), (hole + thick, 1.5 * thick), (0, 1.5 * thick))
    return [
        ("+", Solid(side, 1.5, pose(0, 1.5, 0, (0, -1, 0)))),
        ("+", gusset),
        ("-", Solid(sink, None, pose(1.45, 0.48))),
        ("-", rod(hole, -1, 1, pose(1.45, 1.18))),
        ("-", rod(hole, -1, 1, pose(0, 1.15, 1.2, (1, 0, 0)))),
    ]


def shaft(rng):
    """Steps, a rounded shoulder, a round groove, a chamfer and a keyway."""
    a, b, c = rng.uniform([0.3, 0.5, 0.32], [0.4, 0.65, 0.42])
    steps = (0, 0), (a, 0), (a, 1), (b, 1), (b, 1.8), (c, 1.8), (c, 2.9), (c - 0.12, 3.02), (0, 3.02)
    side = profile(*steps, radii=[(2, 0.1)])
    ring = np.array([[b + 0.15, 1.4, 1], [b - 0.15, 1.4, 1]])[::-1]
    return [
        ("+", Solid(side)),
        ("-", Solid(ring)),
        ("-", box((-0.12, 0.16, 2.2), (0.12, 1, 2.75))),
    ]


def pulley(rng):
    """A disk with a round groove around it, a hub and holes."""
    hub, hole, count = rng.uniform(0.35, 0.45), rng.uniform(0.13, 0.18), rng.integers(3, 7)
    turns = 2 * np.pi * np.arange(count) / count
    return [
        ("+", rod(1.2, 0, 0.6)),
        ("+", rod(hub, -0.2, 0.9)),
        ("-", Solid(np.array([[1.08, 0.3, 1], [1.36, 0.3, 1]]))),
        ("-", rod(0.2, -1, 1)),
        *(("-", rod(hole, -1, 1, pose(0.7 * np.cos(t), 0.7 * np.sin(t)))) for t in turns),
    ]


def lid(rng):
    """Soft creases around: a flat cone on a steeper one, and a shallow round dent in its top."""
    one, two, dent = np.tan(np.radians(rng.uniform([10, 22, 8], [14, 28, 16])))
    low, high = 0.3 + 0.3 * two, 0.3 + 0.3 * two + 0.4 * one
    side = profile((0, 0), (1.2, 0), (1.2, 0.3), (0.9, low), (0.5, high), (0, high))
    return [("+", Solid(side)), ("-", ball(0.3 * np.hypot(1, 1 / dent), (0, 0, high + 0.3 / dent)))]


def gem(rng):
    """A block between planes at random angles, some of them soft, with a slanted hole."""
    steps = [("+", box((-1, -0.8, -0.6), (1, 0.8, 0.6)))]
    for _ in range(6):
        out = rng.normal(size=3) * [1, 1, 1.5]
        out /= np.linalg.norm(out)
        far = rng.uniform(0.75, 0.85) * np.abs(out) @ [1, 0.8, 0.6]
        steps.append(("-", Solid(profile((-3, -3), (3, -3), (3, 3), (-3, 3)), 3.0, pose(*far * out, axis=out))))
    return [*steps, ("-", rod(0.22, -2, 2, pose(axis=(0.3, 0.2, 1))))]


SHAPES = {shape.__name__: shape for shape in (block, plate, crossing, dome, tip, bracket, shaft, pulley, lid, gem)}


def reference(name, seed=0):
    """A shape with random measures."""
    return Reference(name, SHAPES[name](np.random.default_rng(seed)))
