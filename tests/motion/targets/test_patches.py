"""Patches of surfels and the blending of their heights, against plain sums over surfels."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from simplexmesh.motion.targets.surfels import _kernels_patches as kernels
from simplexmesh.motion.targets.surfels.surfels import MAX_SUPPORT_RATIO, assembled

RNG = np.random.default_rng(0)
COUNT = 40


def surfels():
    """Surfels near two sheets, in part turned over or far from tangential; their supports and neighbors."""
    table = np.zeros((COUNT, 12))
    table[:, :2] = RNG.uniform(-1, 1, (COUNT, 2))
    table[:, 2] = 0.4 * (np.arange(COUNT) % 4 == 0) + 0.02 * RNG.normal(size=COUNT)
    table[:, 3:6] = [0, 0, 1] + 0.4 * RNG.normal(size=(COUNT, 3))
    table[:, 3:6] *= RNG.choice([-1, 1], (COUNT, 1)) / np.linalg.norm(table[:, 3:6], axis=1)[:, None]
    table[:, 6:] = RNG.normal(size=(COUNT, 6))
    neighbors = cKDTree(table[:, :3]).query(table[:, :3], k=8)[1][:, 1:].astype(np.int32)
    neighbors[::5, 3] = np.arange(COUNT)[::5]  # fewer neighbors: filled up with the surfel itself
    return table, RNG.uniform(0.4, 0.9, COUNT), neighbors


TABLE, SUPPORT, NEIGHBORS = surfels()
POINTS, NORMALS = TABLE[:, :3], TABLE[:, 3:6]
FORMS = TABLE[:, [6, 9, 10, 9, 7, 11, 10, 11, 8]].reshape(-1, 3, 3)


def agreement(i, j, oriented):
    """The cosine between normals of one sheet, less than 60 degrees apart, whose line is tangential, else 0."""
    cosine, line = NORMALS[i] @ NORMALS[j], POINTS[j] - POINTS[i]
    if (cosine if oriented else abs(cosine)) < 0.5 or abs(NORMALS[i] @ line) > 0.6 * np.linalg.norm(line):
        return 0.0
    return cosine


def lanes(i, oriented):
    """A surfel and its neighbors, with the agreement of each."""
    return [(i, 1.0)] + [(j, agreement(i, j, oriented) if j != i else 0.0) for j in NEIGHBORS[i]]


def height(j, place, along=(0.0, 0.0, 0.0)):
    """Height above a surfel, its slope along a direction, and half its second derivative."""
    d, along = place - POINTS[j], np.array(along)
    return np.array([NORMALS[j] @ d - d @ FORMS[j] @ d / 2, NORMALS[j] @ along - along @ FORMS[j] @ d,
                     -along @ FORMS[j] @ along / 2])  # fmt: skip


def packed(oriented):
    patches = np.zeros((COUNT, 14, kernels.LANES), np.float32)
    kernels.pack_patches(len(TABLE), TABLE, SUPPORT, NEIGHBORS, oriented, patches)
    return patches


def test_the_surfels_drawn_are_of_every_kind():
    found = np.array([agreement(i, j, False) for i in range(COUNT) for j in NEIGHBORS[i] if j != i])
    assert min((found == 0).sum(), (found > 0).sum(), (found < 0).sum()) > 20


def test_supports_are_limited_by_those_of_neighbors():
    found = assembled(TABLE, np.zeros(COUNT), np.zeros(COUNT), oriented=True)
    wide = 1.5 * np.linalg.norm(found.points[found.neighbors[:, :3]] - found.points[:, None], axis=2).max(axis=1)
    assert_allclose(found.heads[:, 6], np.minimum(wide, MAX_SUPPORT_RATIO * wide[found.neighbors].min(axis=1)))
    assert 0 < (found.heads[:, 6] < 0.99 * wide).sum() < COUNT


@pytest.mark.parametrize("oriented", [False, True])
def test_patches_hold_neighbors_relative_to_a_surfel(oriented):
    patches = packed(oriented)
    for i in range(COUNT):
        for k, (j, agree) in enumerate(lanes(i, oriented)):
            expected = [*(POINTS[j] - POINTS[i]) / SUPPORT[i], (SUPPORT[i] / SUPPORT[j]) ** 2, *NORMALS[j] * agree,
                        *TABLE[j, 6:] * SUPPORT[i] * agree, abs(agree)]  # fmt: skip
            assert_allclose(patches[i, :, k], expected, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("oriented", [False, True])
def test_heights_are_blended_by_distance(oriented):
    patches = packed(oriented)
    for i in range(COUNT):
        place, along = RNG.normal(size=(2, 3)).astype(np.float32) * np.float32(0.4)
        at, unit = POINTS[i] + SUPPORT[i] * place, SUPPORT[i] ** np.array([-1.0, 0, 1])
        expected, total, closer, least, nearest = np.zeros(3), 0.0, 0, np.inf, 0
        within = 0
        for k, (j, agree) in enumerate(lanes(i, oriented)):
            far = np.linalg.norm(at - POINTS[j])
            weight = max(1 - (far / SUPPORT[j]) ** 2, 0) ** 2
            expected += weight * agree * height(j, at, along) * unit
            total += weight * abs(agree)
            closer += agree != 0 and far < np.linalg.norm(place) * SUPPORT[i] * 0.9999
            within += far < 0.5 * SUPPORT[i]
            if agree and far < least:
                least, nearest = far, k
            single = kernels.single_height(patches, i, k, tuple(place), tuple(along))
            assert_allclose(single, agree * height(j, at, along) * unit, rtol=1e-4, atol=1e-5)
        found = kernels.blended_height(patches, i, tuple(place), tuple(along))
        assert_allclose(found, [*expected, total, closer], rtol=1e-4, atol=1e-5)
        assert kernels.closest_lane(patches, i, tuple(place)) == nearest
        assert kernels.count_closer(patches, i, tuple(place), np.float32(0.25)) == within


@pytest.mark.parametrize("oriented", [False, True])
def test_surfels_are_averaged_as_height_functions(oriented):
    out = np.zeros_like(TABLE)
    kernels.blend_all(len(TABLE), TABLE, SUPPORT, NEIGHBORS, oriented, out)
    moved = 0
    for i in range(COUNT):
        value, slope, form, total = 0.0, np.zeros(3), np.zeros(6), 0.0
        for j, agree in lanes(i, oriented):
            d = POINTS[i] - POINTS[j]
            weight = max(1 - d @ d / SUPPORT[j] ** 2, 0) ** 2 * agree
            value += weight * height(j, POINTS[i])[0]
            slope += weight * (NORMALS[j] - FORMS[j] @ d)
            form += weight * TABLE[j, 6:]
            total += abs(weight)
        size = np.linalg.norm(slope)
        if size <= 0.3 * total:
            assert_array_equal(out[i], TABLE[i])
            continue
        moved += 1
        normal = slope / size
        assert_allclose(out[i], [*POINTS[i] - value / size * normal, *normal, *form / size], rtol=1e-9, atol=1e-12)
    assert moved > COUNT // 2
