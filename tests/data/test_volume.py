"""Volumes: samples, physical space, labels, resampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from simplexmesh.data.box import box_around, box_slices
from simplexmesh.data.volume import Volume

positive = st.floats(0.01, 100)
near = st.floats(-1000, 1000)


@st.composite
def placed(draw):
    """Volumes anywhere: anisotropic, turned, shifted, left-handed too."""
    shape = draw(st.tuples(*[st.integers(2, 6)] * 3))
    direction = Rotation.from_euler("xyz", draw(st.tuples(near, near, near))).as_matrix()
    if draw(st.booleans()):
        direction = direction[:, ::-1]
    spacing = draw(st.tuples(positive, positive, positive))
    return Volume(np.arange(np.prod(shape)).reshape(shape), spacing, draw(st.tuples(near, near, near)), direction)


class TestSpace:
    @given(placed(), st.integers(0, 2))
    def test_one_index_further_is_one_spacing_along_its_axis(self, volume, axis):
        step = volume.to_world(np.eye(3)[axis]) - volume.to_world([0, 0, 0])
        assert_allclose(step, volume.spacing[axis] * volume.direction[:, axis], atol=1e-9)
        assert_array_equal(volume.to_world([0, 0, 0]), volume.origin)

    @given(placed(), st.lists(st.tuples(near, near, near), min_size=1, max_size=5))
    def test_there_and_back(self, volume, ijk):
        assert_allclose(volume.to_index(volume.to_world(ijk)), ijk, atol=1e-6)

    @given(placed())
    def test_matrix_says_the_same(self, volume):
        ijk = np.array([1.0, 2.5, -3.0])
        assert_allclose((volume.T_world_index @ [*ijk, 1])[:3], volume.to_world(ijk), atol=1e-9)

    @given(placed())
    def test_bounds_hold_every_sample_and_no_more(self, volume):
        ijk = np.stack(np.meshgrid(*map(np.arange, volume.shape), indexing="ij"), axis=-1).reshape(-1, 3)
        xyz = volume.to_world(ijk)
        assert_allclose(volume.bounds, [xyz.min(axis=0), xyz.max(axis=0)], atol=1e-9)
        assert_allclose(volume.diagonal, np.linalg.norm(xyz[-1] - xyz[0]))

    def test_stacks_of_any_shape(self):
        assert Volume(np.zeros((2, 2, 2))).to_world(np.zeros((4, 5, 3))).shape == (4, 5, 3)


class TestSamples:
    @pytest.mark.parametrize("kind", ["u1", "i1", "<i2", ">u2", "i4", "i8", "<f4", ">f4", "f8"])
    def test_type_and_values_stay(self, kind):
        values = np.arange(24).reshape(2, 3, 4).astype(kind)
        volume = Volume(values)
        assert_array_equal(volume.values, values)
        assert volume.values.dtype == np.dtype(kind).newbyteorder("=")
        assert volume.range == (0, 23)

    def test_types_without_arithmetic_become_the_nearest_with(self):
        assert Volume(np.ones((2, 2, 2), bool)).values.dtype == np.uint8
        assert Volume(np.ones((2, 2, 2), np.float16)).values.dtype == np.float32

    def test_read_only_samples_are_not_copied(self):
        values = np.zeros((3, 4, 5), order="F")
        values.setflags(write=False)
        assert np.shares_memory(Volume(values).values, values)

    def test_the_callers_array_is_neither_shared_nor_frozen(self):
        values = np.zeros((3, 4, 5), order="F")
        volume = Volume(values)
        values[0, 0, 0] = 1
        assert volume.values[0, 0, 0] == 0
        with pytest.raises(ValueError, match="read-only"):
            volume.values[0, 0, 0] = 1

    def test_its_place_in_space_cannot_be_changed_from_outside(self):
        values, direction, origin, spacing = np.zeros((3, 3, 3)), np.eye(3), np.ones(3), np.ones(3)
        for volume in (Volume(values), Volume(values, spacing, origin, direction)):
            for name in ("spacing", "origin", "direction"):
                with pytest.raises(ValueError, match="read-only"):
                    getattr(volume, name)[0] = 5
        direction[0, 0] = origin[0] = spacing[0] = 5
        assert volume.direction[0, 0] == volume.origin[0] == volume.spacing[0] == 1


class TestLabels:
    def test_two_values_are_labels(self):
        mask = np.random.default_rng(0).random((9, 9, 9)) > 0.5
        assert Volume(mask).is_labels
        assert Volume(mask.astype(float)).labels() == (0, 1)

    def test_regions_are_labels_whatever_their_numbers(self):
        blocks = np.kron(np.array([0, 3, 1009, -5, 77, 2, 11, 12]).reshape(2, 2, 2), np.ones((5, 5, 5), int))
        volume = Volume(blocks)
        assert volume.is_labels
        assert volume.labels() == (-5, 0, 2, 3, 11, 12, 77, 1009)

    @pytest.mark.parametrize(
        "values",
        [
            np.random.default_rng(1).integers(0, 20, (12, 12, 12)),  # few values, but noise
            np.pad(np.random.default_rng(1).integers(0, 20, (9, 9, 9)), 9),  # the same in a large background
            np.kron(np.arange(125).reshape(5, 5, 5), np.ones((4, 4, 4), int)),  # regions, but too many
            np.kron(np.arange(8).reshape(2, 2, 2), np.ones((4, 4, 4))) + 0.5,  # not whole
            np.full((3, 3, 3), 1e300) * np.array([1, 1, 2]),
        ],
    )
    def test_intensities_are_not(self, values):
        volume = Volume(values)
        assert not volume.is_labels
        with pytest.raises(ValueError, match="volume holds intensities, not labels"):
            volume.labels()

    def test_mask(self):
        blocks = np.kron(np.arange(8).reshape(2, 2, 2), np.ones((5, 5, 5), int))
        volume = Volume(blocks, spacing=(1, 2, 3), origin=(5, 5, 5))
        mask = volume.mask(3)
        assert_array_equal(mask.values, blocks == 3)
        assert_array_equal(mask.T_world_index, volume.T_world_index)
        with pytest.raises(ValueError, match=r"label must be present in the volume, 9 is not; present are \[0, 1, 2"):
            volume.mask(9)

    def test_regions_too_many_to_be_detected_as_labels_have_masks(self):
        blocks = np.kron(np.arange(125).reshape(5, 5, 5), np.ones((4, 4, 4), int))
        assert Volume(blocks).mask(7).values.sum() == 64

    def test_labels_of_other_volumes_are_refused_with_the_reason(self):
        noise = np.random.default_rng(0)
        for values in (noise.random((5, 5, 5)), noise.integers(0, 999, (9, 9, 9)), noise.integers(0, 9, (9, 9, 9))):
            message = r"^volume holds intensities \(.* to .*\), not labels; give level \(--level\), not label 3$"
            with pytest.raises(ValueError, match=message):
                Volume(values).mask(3)
        with pytest.raises(ValueError, match=r"volume has the value 0 everywhere, label 3 is not in it$"):
            Volume(np.zeros((5, 5, 5))).mask(3)


class TestFilters:
    @pytest.mark.parametrize(
        ("kind", "wanted"),
        [("f8", "f8"), (">f8", "f8"), ("f4", "f4"), ("f2", "f4"), ("i2", "f4"), ("u1", "f4"), ("i8", "f4")],
    )
    def test_smoothed_and_resampled_volumes_have_single_precision_or_double_as_before(self, kind, wanted):
        volume = Volume(np.arange(64).reshape(4, 4, 4).astype(kind))
        assert volume.smoothed(1.0).values.dtype == volume.resampled(2.0).values.dtype == np.dtype(wanted)

    def test_smoothing_keeps_a_ramp_inside_and_is_isotropic_in_space(self):
        spacing = np.array([0.5, 1.0, 2.0])
        values = np.zeros((61, 31, 17))
        values[30, 15, 8] = 1
        blob = Volume(values, spacing).smoothed(2.0)
        assert blob.values.sum() == pytest.approx(1, abs=1e-3)
        xyz = blob.to_world(np.argwhere(values >= 0)) - blob.to_world([30, 15, 8])
        spread = np.sqrt((blob.values.reshape(-1)[:, None] * xyz**2).sum(axis=0))
        assert_allclose(spread, 2.0, rtol=0.02)

    @given(placed(), st.floats(0.3, 3))
    def test_resampling_a_linear_function_in_space_gives_it_back(self, volume, factor):
        slope = np.array([0.3, -0.2, 0.1])
        ijk = np.stack(np.meshgrid(*map(np.arange, volume.shape), indexing="ij"), axis=-1)
        ramp = Volume(volume.to_world(ijk) @ slope, volume.spacing, volume.origin, volume.direction)
        out = ramp.resampled(ramp.spacing * min(factor, 1))
        jkl = np.stack(np.meshgrid(*map(np.arange, out.shape), indexing="ij"), axis=-1)
        inside = (
            (ramp.to_index(out.to_world(jkl)) >= 0) & (ramp.to_index(out.to_world(jkl)) <= np.array(ramp.shape) - 1)
        ).all(-1)
        assert_allclose(out.values[inside], (out.to_world(jkl) @ slope)[inside], atol=1e-6 * ramp.diagonal)
        assert_allclose(out.spacing, ramp.spacing * min(factor, 1))

    def test_resampling_keeps_the_center_and_covers_the_rest(self):
        volume = Volume(np.random.default_rng(2).random((20, 11, 30)), (1, 2, 0.7), (3, 4, 5))
        coarse = volume.resampled(3.1)
        assert_allclose(coarse.bounds.mean(axis=0), volume.bounds.mean(axis=0))
        assert (coarse.bounds[0] <= volume.bounds[0] + 1e-9).all()
        assert (coarse.bounds[1] >= volume.bounds[1] - 1e-9).all()

    def test_coarser_grids_hold_no_aliases(self):
        stripes = Volume(np.tile(np.arange(40) % 2, (40, 40, 1)).astype(float))
        assert np.ptp(stripes.resampled(3.3).values[:, :, 2:-2]) < 0.02


class TestRefusals:
    @pytest.mark.parametrize(
        ("arguments", "error", "message"),
        [
            ({"values": np.zeros((3, 3))}, ValueError, r"values must have shape \(nx, ny, nz\), not \(3, 3\)"),
            ({"values": np.zeros((3, 3, 1))}, ValueError, "values must have at least 2 samples along each axis"),
            ({"values": np.zeros((0, 3, 3))}, ValueError, "values must have at least 2 samples along each axis"),
            (
                {"values": np.zeros((2, 2, 2), complex)},
                TypeError,
                r"values must be real numbers .*, not ndarray of complex",
            ),
            ({"values": "volume"}, TypeError, r"values must be real numbers .*, not str"),
            ({"spacing": (1, 0, 1)}, ValueError, "spacing must be positive along every axis"),
            ({"spacing": -1}, ValueError, "spacing must be positive along every axis"),
            ({"spacing": "fine"}, TypeError, "spacing must be a number, not str"),
            ({"spacing": (1, [1, 1])}, ValueError, "spacing must be an array, but its rows have different lengths"),
            ({"spacing": (1, 1)}, ValueError, r"spacing must have shape \(3,\), not \(2,\)"),
            ({"origin": (0, np.nan, 0)}, ValueError, "origin must be finite"),
            ({"direction": np.ones((3, 3))}, ValueError, "direction must have perpendicular columns of length one"),
            ({"direction": 2 * np.eye(3)}, ValueError, "direction must have perpendicular columns of length one"),
        ],
    )
    def test_one_sentence(self, arguments, error, message):
        with pytest.raises(error, match=message):
            Volume(**{"values": np.zeros((2, 2, 2)), **arguments})

    def test_samples_that_are_no_numbers_are_counted(self):
        values = np.zeros((4, 4, 4), np.float32)
        values[0, 0, 0], values[1, 2, 3], values[3, 3, 3] = np.nan, np.inf, -np.inf
        with pytest.raises(ValueError, match="values must be finite; 3 of 64 are NaN or infinite"):
            Volume(values)


class TestBox:
    @given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 5), st.integers(0, 6)), min_size=1), st.integers(0, 3))
    def test_holds_all_and_touches_on_every_side(self, places, margin):
        inside = np.zeros((5, 6, 7), bool)
        inside[tuple(np.array(places).T)] = True
        first, end = box_around(inside)
        part = inside[box_slices(first, end, inside.shape)]
        assert part.sum() == inside.sum()
        for axis in range(3):
            assert np.take(part, [0, -1], axis).any(axis=tuple({0, 1, 2} - {axis})).all()
        wider = box_slices(first, end, inside.shape, margin=margin)
        assert [s.start for s in wider] == np.maximum(first - margin, 0).tolist()
        assert [s.stop for s in wider] == np.minimum(end + margin, inside.shape).tolist()

    def test_of_nothing(self):
        assert box_around(np.zeros((3, 3, 3), bool)) is None


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda v: v.to_world([1, 2]), ValueError, r"^ijk must have shape \(3,\), not \(2,\)$"),
        (lambda v: v.resampled(1e-9), ValueError, r"^spacing must give at most 1e\+11 samples, not"),
        (lambda v: v.resampled(1e-300), ValueError, r"^spacing must give at most 1e\+11 samples, not"),
        (lambda v: v.to_index(1.0), ValueError, "^xyz must have shape"),
        (lambda v: v.to_index("abc"), TypeError, "^xyz must be numbers"),
        (lambda v: v.to_index([[0, 0, np.nan]]), ValueError, "^xyz must be finite"),
        (lambda v: v.mask([1, 2]), TypeError, "^label must be a number, not list"),
        (lambda v: v.smoothed(1e9), ValueError, "^sigma must be between 0 and "),
    ],
)
def test_invalid_positions_labels_and_widths_are_refused(call, error, message):
    with pytest.raises(error, match=message):
        call(Volume(np.arange(24.0).reshape(2, 3, 4)))


def test_a_grid_wider_than_the_volume_still_has_its_ends():
    out = Volume(np.ones((3, 4, 5))).resampled(1e9)
    assert out.shape == (2, 2, 2)
    assert_allclose(out.values, 1.0)
