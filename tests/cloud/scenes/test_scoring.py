"""The scores of the truth, and what each kind of fault does to them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from tests.cloud.scenes.line_scoring import line_score
from tests.cloud.scenes.piping import Make, pipe_line
from tests.cloud.scenes.plant import plant_scene
from tests.cloud.scenes.scoring import score, untangent
from tests.cloud.scenes.shapes import pipe

SCENE = plant_scene(0, count=20_000)
LINE = pipe_line(0, make=Make(reducers=1), count=2000)
PERFECT = list(SCENE.shapes)


def changed(number, **values):
    """The true shapes, but one with other values."""
    return [*PERFECT[:number], replace(PERFECT[number], **values), *PERFECT[number + 1 :]]


def tilted(shape, degrees):
    """A frame turned about its x axis."""
    return Rotation.from_rotvec(np.radians(degrees) * shape.frame[0]).apply(shape.frame)


class TestPrimitives:
    def test_the_truth_is_perfect(self):
        found = score(PERFECT, SCENE.labels, SCENE)
        assert (found.precision, found.recall, found.index, found.curved_index, found.claimed) == (1, 1, 1, 1, 0)
        assert (found.worst_radius, found.worst_bend_radius) == (0, 0)
        assert found.worst_axis < 1e-12
        assert found.tangency < 1e-12
        assert found.found == found.true == {"plane": 2, "cylinder": 4, "torus": 2, "sphere": 1, "cone": 1}

    def test_neither_order_nor_the_sense_of_axes_matters(self):
        order = np.random.default_rng(0).permutation(10)
        turned = [replace(PERFECT[k], frame=PERFECT[k].frame * [[1], [-1], [-1]]) for k in order]
        found = score(turned, np.append(np.argsort(order), -1)[SCENE.labels], SCENE)
        assert (found.precision, found.recall, found.index) == (1, 1, 1)
        assert found.worst_axis < 1e-12
        assert {(a, int(order[a])) for a in range(10)} == set(found.pairs)

    def test_anything_with_the_names_will_do(self):
        cone = SimpleNamespace(**{name: getattr(PERFECT[9], name) for name in ("kind", "point", "axis", "half_angle")})
        assert score([*PERFECT[:9], cone], SCENE.labels, SCENE).recall == 1

    @pytest.mark.parametrize("number", [2, 8])
    def test_wrong_radii(self, number):
        radius = PERFECT[number].radius
        found = score(changed(number, radius=1.01 * radius), SCENE.labels, SCENE)
        assert_allclose([found.worst_radius, found.radius, found.recall], [0.01, 0, 1], atol=1e-12)
        found = score(changed(number, radius=0.88 * radius), SCENE.labels, SCENE)
        assert (found.precision, found.recall, found.worst_radius) == (0.9, 0.9, 0)

    def test_wrong_bends(self):
        found = score(changed(6, radius=1.1 * PERFECT[6].radius), SCENE.labels, SCENE)
        assert_allclose([found.worst_bend_radius, found.bend_radius, found.worst_radius], [0.1, 0.05, 0], atol=1e-12)
        assert score(changed(6, radius=1.3 * PERFECT[6].radius), SCENE.labels, SCENE).found["torus"] == 1

    @pytest.mark.parametrize("number", [0, 5, 6, 9])
    def test_tilted(self, number):
        shape = PERFECT[number]
        found = score(changed(number, frame=tilted(shape, 1.0)), SCENE.labels, SCENE)
        assert_allclose(np.degrees(found.worst_axis), 1.0, rtol=1e-9)
        found = score(changed(number, frame=tilted(shape, 6.0)), SCENE.labels, SCENE)
        assert found.found[shape.kind] == found.true[shape.kind] - 1

    @pytest.mark.parametrize("number", range(10))
    def test_out_of_place(self, number):
        shape = PERFECT[number]
        middle = SCENE.points[SCENE.labels == number].mean(axis=0)
        size = np.linalg.norm(SCENE.points[SCENE.labels == number] - middle, axis=1).max()
        across = shape.frame[2 if shape.kind == "plane" else 0]
        for share, recall in ((0.02, 1.0), (0.6, 0.9)):
            moved = changed(number, origin=shape.origin + share * size * across)
            assert score(moved, SCENE.labels, SCENE).recall == recall

    def test_another_kind_is_not_found(self):
        cylinder = pipe(PERFECT[8].origin, PERFECT[8].origin + 1, PERFECT[8].radius)
        assert score([*PERFECT[:8], cylinder, PERFECT[9]], SCENE.labels, SCENE).found["sphere"] == 0

    def test_half_the_points_are_not_enough_nor_too_many(self):
        wall = np.flatnonzero(SCENE.labels == 0)
        small = SCENE.labels.copy()
        small[wall[: round(0.55 * len(wall))]] = -1
        assert score(PERFECT, small, SCENE).recall == 0.9
        most = SCENE.labels.copy()
        most[wall[: round(0.45 * len(wall))]] = -1
        assert score(PERFECT, most, SCENE).recall == 1
        large = SCENE.labels.copy()
        large[np.isin(large, [3, 4])] = 2
        found = score(PERFECT, large, SCENE)
        assert found.found["cylinder"] == 1 + (np.bincount(large[large >= 0])[2] < 2 * (SCENE.labels == 2).sum())

    def test_claimed_outliers(self):
        labels, strays = SCENE.labels.copy(), np.flatnonzero(SCENE.labels < 0)
        labels[strays[::4]] = 1
        assert_allclose(score(PERFECT, labels, SCENE).claimed, 0.25, atol=1e-3)
        assert np.isnan(score(PERFECT, SCENE.labels[:], plant_clean()).claimed)

    def test_nothing_found(self):
        found = score([], np.full(len(SCENE.labels), -1), SCENE)
        assert np.isnan(found.precision)
        assert (found.recall, found.index) == (0, 0)

    def test_too_many_found(self):
        assert_allclose(score(PERFECT * 2, SCENE.labels, SCENE).precision, 0.5)

    def test_small_shapes_need_not_be_found_but_may(self):
        least = np.bincount(SCENE.labels[SCENE.labels >= 0]).min() + 1
        for shapes in (PERFECT, PERFECT[:-1]):
            number = int(np.bincount(SCENE.labels[SCENE.labels >= 0]).argmin())
            kept = shapes if shapes is PERFECT else PERFECT[:number] + PERFECT[number + 1 :]
            moved = np.arange(10) if shapes is PERFECT else np.insert(np.arange(9), number, -1)
            found = score(kept, np.append(moved, -1)[SCENE.labels], SCENE, least)
            assert (found.precision, found.recall, sum(found.true.values())) == (1, 1, 9)

    def test_labels_of_what_is_not_there(self):
        with pytest.raises(ValueError, match=r"^labels must be one number of a primitive"):
            score(PERFECT[:3], SCENE.labels, SCENE)


def plant_clean():
    return replace(SCENE, labels=np.where(SCENE.labels < 0, 0, SCENE.labels))


class TestTangency:
    def test_of_each_fault(self):
        elbow, tube = PERFECT[6], PERFECT[2]
        up = elbow.axis * elbow.tube_radius
        outward = elbow.frame[0] * elbow.tube_radius
        assert untangent(elbow, tube) < 1e-12
        assert_allclose(untangent(elbow, replace(tube, radius=1.1 * tube.radius)), 0.1, rtol=1e-9)
        assert_allclose(untangent(elbow, replace(tube, origin=tube.origin + 0.2 * up)), 0.2, rtol=1e-9)
        assert_allclose(untangent(elbow, replace(tube, origin=tube.origin + 0.3 * outward)), 0.3, rtol=1e-9)
        about = Rotation.from_rotvec(0.02 * elbow.frame[0])
        joint = elbow.center + elbow.radius * elbow.frame[0]
        turned = tube.moved(about.as_matrix(), joint - about.apply(joint))
        assert_allclose(untangent(elbow, turned), 0.02, rtol=1e-9)

    def test_is_asked_of_found_pairs_alone(self):
        worse = changed(6, radius=1.05 * PERFECT[6].radius)
        assert_allclose(score(worse, SCENE.labels, SCENE).tangency, 0.05 * PERFECT[6].radius / PERFECT[6].tube_radius)
        labels = np.where(np.isin(SCENE.labels, [2, 3, 4]), -1, SCENE.labels)
        assert np.isnan(score(worse, labels, SCENE).tangency)


class TestLines:
    def test_the_truth_is_perfect_either_way(self):
        turned = [replace(part, start=part.end, end=part.start) for part in LINE.elements[::-1]]
        for elements in (LINE.elements, turned):
            found = line_score(elements, LINE)
            assert (found.precision, found.recall, found.ordered, found.missed) == (1, 1, True, ())
            assert found.worst_radius == found.worst_bend_radius == found.worst_end == 0

    def test_missing_and_wrong_elements(self):
        found = line_score(LINE.elements[1:], LINE)
        assert_allclose([found.precision, found.recall], [1, 11 / 12])
        assert found.missed == (0,)
        far = replace(LINE.elements[0], start=LINE.elements[0].start + 2 * LINE.elements[0].radius)
        assert line_score([far, *LINE.elements[1:]], LINE).missed == (0,)
        found = line_score([], LINE)
        assert np.isnan(found.precision)
        assert found.recall == 0

    def test_order(self):
        a, b, *rest = LINE.elements
        found = line_score([b, a, *rest], LINE)
        assert (found.recall, found.ordered) == (1, False)

    def test_errors(self):
        number = next(k for k, part in enumerate(LINE.elements) if part.kind == "bend")
        bend = LINE.elements[number]
        wrong = replace(bend, bend_radius=1.02 * bend.bend_radius, end=bend.end + 0.25 * bend.radius * np.eye(3)[2])
        elements = [*LINE.elements[:number], wrong, *LINE.elements[number + 1 :]]
        found = line_score(elements, LINE)
        assert_allclose([found.worst_bend_radius, found.worst_end], [0.02, 0.25], rtol=1e-9)

    def test_straight_parts_have_no_bend_radius_of_whatever_kind(self):
        elements = [replace(part, bend_radius=part.bend_radius or None) for part in LINE.elements]
        assert line_score(elements, LINE).recall == 1
