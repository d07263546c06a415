"""Parts with exact primitives (Fit4CAD, Romanengo et al. 2021) and a fixture with known dimensions."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

import simplexmesh as sm
from tests.cloud.scenes.scoring import matched
from tests.nightly.marks import nightly

PRINTED = 1e-4
"""To which the files print sizes."""


def segments(folder, name):
    """Yield the points of a part's segments, what they are, and the vectors that tell that."""

    def text(ending):
        return (folder / f"fit4cad_{name}{ending}.txt").read_text()

    points = np.array(re.findall(r"\[\s*([-\d.eE+]+),\s*([-\d.eE+]+),\s*([-\d.eE+]+)\]", text("")), float)
    members = re.findall(r"Primitive\d+:=\[([\d\s]+)\]", text("_primitives"))
    told = re.findall(r"Primitive\d+:=\[(\w+),\s*\[([^\]]+)\]\]", text("_parametric"))
    assert len(members) == len(told)
    for rows, (kind, values) in zip(members, told, strict=True):
        yield points[np.array(rows.split(), int) - 1], kind.lower(), np.array(values.split(), float).reshape(-1, 3)


def part(folder, name):
    """A part as a scene: all points, the number of the segment that each is of, and the segments' primitives."""
    pieces = [points for points, _, _ in segments(folder, name)]
    return SimpleNamespace(
        points=np.concatenate(pieces),
        labels=np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]),
        shapes=[sm.fit_primitive(piece, "any") for piece in pieces],
    )


@pytest.mark.data
@pytest.mark.parametrize(("parts", "count"), [(["PC42", "PC49"], 11), *nightly((["PC18"], 23))])
def test_kinds_and_parameters_of_parts(data_folder, parts, count):
    right = total = 0
    for name in parts:
        for points, kind, vectors in segments(data_folder, name):
            found, size = sm.fit_primitive(points, "any"), np.ptp(points, axis=0).max()
            total += 1
            right += found.kind == kind
            assert found.rms < PRINTED * size
            if found.kind != kind:
                continue
            lengths = np.linalg.norm(vectors, axis=1)
            if kind == "plane":
                assert abs(found.normal @ np.cross(vectors[0], vectors[1])) == pytest.approx(1, abs=PRINTED)
                assert abs(found.distance(vectors[2:])[0]) < PRINTED * size
            elif kind == "cylinder":
                assert found.radius == pytest.approx(lengths[0], abs=PRINTED)
                assert np.linalg.norm(np.cross(vectors[3] - found.point, found.axis)) < PRINTED * max(size, 10)
            elif kind == "sphere":
                assert found.radius == pytest.approx(lengths[0], abs=PRINTED)
                assert np.linalg.norm(found.center - vectors[-1]) < PRINTED
            else:
                assert (found.radius, found.tube_radius) == pytest.approx((lengths[0], lengths[2]), abs=PRINTED)
                assert np.linalg.norm(found.center - vectors[-1]) < PRINTED
    assert total == count
    assert right >= 0.9 * total


@pytest.mark.data
@pytest.mark.parametrize(("name", "least"), [*nightly(("PC18", 9)), ("PC42", 2)])
def test_parts_are_found_when_nothing_is_told(data_folder, name, least):
    truth = part(data_folder, name)
    out = sm.extract_primitives(truth.points)
    assert len(matched(out.primitives, out.labels, truth)) >= max(least, 0.9 * len(out))


@pytest.mark.nightly
@pytest.mark.data
def test_small_caps_are_found_beside_what_is_of_no_kind(data_folder):
    out = sm.extract_primitives(sm.read_points(data_folder / "abc_00949.xyzc"), rng=1)  # its oblique pipe is elliptic
    assert sum(each.kind == "plane" for each in out.primitives) >= 10  # of 6 faces and 5 caps


@pytest.mark.data
def test_dimensions_of_a_fixture(data_folder):
    points = sm.read_points(data_folder / "cyl_fixture.ply").points
    away = np.hypot(points[:, 0] - 49, points[:, 1] - 52)
    around = points[(away > 14.5) & (away < 20.5) & (points[:, 2] > 12) & (points[:, 2] < 48)]
    boss = sm.fit_primitive(around, "cylinder", robust=True)
    assert boss.radius == pytest.approx(17.5, abs=0.05)
    assert np.linalg.norm(np.cross(boss.point - [49, 52, 0], boss.axis)) < 0.05
    assert abs(boss.axis[2]) == pytest.approx(1, abs=1e-5)
    base = sm.fit_primitive(points[(away > 25) & (away < 40) & (points[:, 2] < 20)], "any", robust=True)
    top = sm.fit_primitive(points[(away < 15) & (points[:, 2] > 45)], "any", robust=True)
    assert base.kind == top.kind == "plane"
    assert abs(base.distance(top.point[None])[0]) == pytest.approx(40, abs=0.05)
    edge = sm.fit_primitive(points[abs(points[:, 1] - 122) < 1], "plane", robust=True)
    assert abs(edge.distance([[49, 122, 5]])[0]) < 0.1
