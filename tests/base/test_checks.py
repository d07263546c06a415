"""Checks of arguments say in one sentence what is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh._base import checks, vectors


class TestArray:
    def test_returns_what_was_wanted(self):
        out = checks.array("points", [[0, 1, 2]], (None, 3))
        assert out.dtype == np.float64
        assert out.tolist() == [[0.0, 1.0, 2.0]]

    @pytest.mark.parametrize(
        ("value", "shape", "dtype", "error", "message"),
        [
            (np.zeros(3), (None, 3), float, ValueError, "points must have shape (*, 3), not (3,)"),
            (np.zeros((5, 3)), (4, 3), float, ValueError, "points must have shape (4, 3), not (5, 3)"),
            (np.zeros((2, 2)), (4,), float, ValueError, "points must have shape (4,), not (2, 2)"),
            ([[0, 0, np.nan]], (None, 3), float, ValueError, "points must be finite; points[0, 2] is nan"),
            ([[0, np.inf, 0]], (None, 3), float, ValueError, "points must be finite; points[0, 1] is inf"),
            (np.zeros((2, 3)), (None, 3), int, TypeError, "points must be whole numbers, not float64"),
            ("dragon", (None, 3), float, TypeError, "points must be numbers of shape (*, 3), not str of <U6"),
            (None, (None, 3), float, TypeError, "points must be numbers of shape (*, 3), not NoneType of object"),
            (
                [[1j, 0, 0]],
                (None, 3),
                float,
                TypeError,
                "points must be numbers of shape (*, 3), not list of complex128",
            ),
        ],
    )
    def test_says_what_is_wrong(self, value, shape, dtype, error, message):
        with pytest.raises(error) as caught:
            checks.array("points", value, shape, dtype)
        assert str(caught.value) == message


@pytest.mark.parametrize(
    ("value", "message"),
    [([[0, 1, 99]], "faces[0, 2] is 99, outside 0..2"), ([[0, -1, 1]], "faces[0, 1] is -1, outside 0..2")],
)
def test_indices_say_which_is_outside(value, message):
    with pytest.raises(ValueError, match=r".") as caught:
        checks.indices("faces", value, (None, 3), 3)
    assert str(caught.value) == message


class TestNumber:
    @pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int64(2), np.array(2.0)])
    def test_takes_every_kind_of_number(self, value):
        assert checks.number("level", value, 0) == 2.0

    @pytest.mark.parametrize(
        ("value", "bounds", "error", "message"),
        [
            ("2", {}, TypeError, "level must be a number, not str"),
            (None, {}, TypeError, "level must be a number, not NoneType"),
            (True, {}, TypeError, "level must be a number, not bool"),
            ([1.0], {}, TypeError, "level must be a number, not list"),
            (np.nan, {}, ValueError, "level must be finite, not nan"),
            (-1, {"low": 0}, ValueError, "level must be at least 0, not -1"),
            (0, {"low": 0, "open_low": True}, ValueError, "level must be above 0, not 0"),
            (2, {"low": 0, "high": 1}, ValueError, "level must be between 0 and 1, not 2"),
            (0, {"low": 0, "high": 1, "open_low": True}, ValueError, "level must be above 0 and at most 1, not 0"),
        ],
    )
    def test_says_what_is_wrong(self, value, bounds, error, message):
        with pytest.raises(error) as caught:
            checks.number("level", value, **bounds)
        assert str(caught.value) == message


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        (2, ValueError, "vertices must be at least 4, not 2"),
        (11, ValueError, "vertices must be at most 10, not 11"),
        (5.0, TypeError, "vertices must be a whole number, not float 5.0"),
        (True, TypeError, "vertices must be a whole number, not bool True"),
        ("5", TypeError, "vertices must be a whole number, not str '5'"),
    ],
)
def test_integers_say_what_is_wrong(value, error, message):
    with pytest.raises(error) as caught:
        checks.integer("vertices", value, 4, 10)
    assert str(caught.value) == message


@pytest.mark.parametrize("values", [(4, 7), ([4, 7],), ((4, np.int64(7)),), (range(4, 10, 3),), (np.array([4, 7]),)])
def test_integers_come_one_by_one_or_as_one_sequence(values):
    assert checks.integers("line", values, 0) == [4, 7]
    assert checks.integers("line", (), 0) == checks.integers("line", ([],), 0) == []


@pytest.mark.parametrize("values", [({4},), ("47",), (np.array(4.0),), ([[4]],), ([True],), ([4, -1],)])
def test_other_things_are_no_integers(values):
    with pytest.raises((TypeError, ValueError), match=r"^line must be "):
        checks.integers("line", values, 0)


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        (1.5, TypeError, "rng must be a Generator or a whole number, not float 1.5"),
        (-1, ValueError, "rng must be a Generator or a whole number of at least 0, not -1"),
    ],
)
def test_generators_say_what_is_wrong(value, error, message):
    with pytest.raises(error) as caught:
        checks.generator("rng", value)
    assert str(caught.value) == message


def test_generators_of_one_seed_are_alike_and_a_generator_is_itself():
    rng = checks.generator("rng", 3)
    assert checks.generator("rng", rng) is rng
    assert rng.random() == checks.generator("rng", 3).random()


def test_choices_are_words():
    with pytest.raises(ValueError, match=r"^init must be one of 'auto', 'sphere', not array\(\[0., 0., 0.\]\)$"):
        checks.choice("init", np.zeros(3), ["auto", "sphere"])


def test_choices_are_listed():
    with pytest.raises(ValueError, match=r"^init must be one of 'auto', 'sphere', not 'cube'$"):
        checks.choice("init", "cube", ["auto", "sphere"])


def test_frozen_arrays_are_copies():
    mine = np.zeros(3)
    out = checks.frozen(mine)
    mine[0] = 1
    assert out[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        out[0] = 1


class TestVectors:
    def test_agree_with_numpy(self):
        a, b = np.random.default_rng(0).normal(size=(2, 5, 4, 3))
        np.testing.assert_allclose(vectors.cross(a, b), np.cross(a, b), atol=1e-14)
        np.testing.assert_allclose(vectors.dot(a, b), (a * b).sum(-1), atol=1e-14)
        np.testing.assert_allclose(vectors.norm(a), np.linalg.norm(a, axis=-1), rtol=1e-14)
        np.testing.assert_allclose(vectors.norm(vectors.normalized(a)), 1, rtol=1e-14)


@pytest.mark.parametrize("value", [0, 1, np.pi])
def test_angles_are_in_radians(value):
    assert checks.angle("angle", value) == value
    with pytest.raises(ValueError, match=r"^angle must be in radians, at most 3.14159, not 45: numpy.radians converts"):
        checks.angle("angle", 45)
    with pytest.raises(ValueError, match=r"^angle must be at least 0, not -1$"):
        checks.angle("angle", -1)


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_transforms_are_affine_in_any_unit(scale):
    T = np.diag([scale, -2 * scale, scale, 1.0])
    T[:3, 3] = 5, 6, 7
    assert checks.affine("T", T).tolist() == T.tolist()
    flat, tilted = T * [[1], [1], [0], [1]], T + np.eye(4)[::-1]
    with pytest.raises(ValueError, match=r"^T must be invertible, its linear part is singular$"):
        checks.affine("T", flat)
    with pytest.raises(ValueError, match=r"^T must have the last row \(0, 0, 0, 1\), not \(1.0, 0.0, 0.0, 1.0\)$"):
        checks.affine("T", tilted)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: checks.flag("weighted", "no"), "weighted must be true or false, not str 'no'"),
        (lambda: checks.path("path", 3), "path must be a string or a Path, not int"),
        (lambda: checks.instance("mesh", 3, dict), "mesh must be a dict, not int"),
        (lambda: checks.any_array("edge", [[0, 1], [2]]), "edge must be an array, but its rows have different lengths"),
        (lambda: checks.selection("faces", [False, True], 3), "faces must have shape (3,), not (2,)"),
        (
            lambda: checks.choice("init", "spere", ["auto", "sphere"]),
            "init must be one of 'auto', 'sphere', not 'spere': did you mean 'sphere'?",
        ),
        (
            lambda: checks.size("data", np.array([[0.0, 0.0, 0.0], [1e160, 1.0, 1.0]])),
            "data must be within 1e-60 and 1e+60 in its unit of length, not reach to 1e+160: choose another unit",
        ),
    ],
)
def test_other_arguments_say_what_is_wrong(call, message):
    with pytest.raises((ValueError, TypeError)) as caught:
        call()
    assert str(caught.value) == message


def test_words_are_completed():
    assert checks.closest_word("Sal", ["mean", "saliency", "all"]) == "saliency"
    assert checks.closest_word("cube", ["auto", "sphere"]) is None
    assert checks.selection("faces", [False, True, True], 3).tolist() == [1, 2]


def test_sizes_whose_powers_are_no_numbers_are_refused():
    for most in (0.0, 1e-60, 1e60):
        checks.size("data", np.array([[-most, -most / 2, 0.0], [most, most, most]]))
    with pytest.raises(ValueError, match=r"^data must be within 1e-60 and 1e\+60 .*, not be 2e-61 long: choose"):
        checks.size("data", np.array([[-1e-61, 0.0, 0.0], [1e-61, 0.0, 0.0]]))
    with pytest.raises(ValueError, match=r"not reach to 1.1e\+60: choose another unit$"):
        checks.size("data", np.array([[-1.1e60, 0.0, 0.0], [1.0, 0.0, 0.0]]))


def test_states_that_were_pickled_are_read_only_again():
    plain = {"points": np.zeros(3), "unit": "mm"}
    assert checks.frozen_state(plain) is plain
    assert not plain["points"].flags.writeable
    state = checks.frozen_state({"data": {"a": np.zeros(2)}})
    assert not state["data"]["a"].flags.writeable
    with pytest.raises(TypeError):
        state["data"]["b"] = 1
