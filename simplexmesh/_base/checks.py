"""Argument checks: return the argument as a clean array or number, or raise with one sentence that says why."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from simplexmesh._base.arrays import Array, Indices

Kind = TypeVar("Kind")

SMALLEST, LARGEST = 1e-60, 1e60
"""Lengths between these can be raised to the fifth power without overflow or underflow."""


def array(name: str, value: ArrayLike, shape: Sequence[int | None], dtype: DTypeLike = float) -> NDArray[Any]:
    """Return `value` as an array of a shape, in which None is any length, and a type; floats must be finite."""
    out = _numbers(name, value, shape)
    if not np.can_cast(out.dtype, dtype, "same_kind"):
        wanted = "whole numbers" if np.dtype(dtype).kind in "iu" else np.dtype(dtype).name
        raise TypeError(f"{name} must be {wanted}, not {out.dtype}")
    out = out.astype(dtype, copy=False)
    if np.dtype(dtype).kind == "f" and not np.isfinite(out).all():
        bad = np.argwhere(~np.isfinite(out))[0]
        raise ValueError(f"{name} must be finite; {name}{bad.tolist()} is {out[tuple(bad)]}")
    return out


def any_array(name: str, value: Any) -> NDArray[Any]:
    """Return `value` as an array of any shape and type; ragged and masked ones are refused."""
    try:
        out = np.asarray(value)
    except ValueError:
        raise ValueError(f"{name} must be an array, but its rows have different lengths") from None
    if isinstance(value, np.ma.MaskedArray) and (hidden := int(np.count_nonzero(np.ma.getmaskarray(value)))):
        raise ValueError(f"{name} must have no masked values, {hidden:,} of {out.size:,} are")
    return out


def _numbers(name: str, value: ArrayLike, shape: Sequence[int | None]) -> NDArray[Any]:
    """Return `value` as an array of numbers of any type, of the given shape."""
    out = any_array(name, value)
    numbers = out.dtype.kind in "biuf"
    if numbers and out.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, out.shape, strict=True)):
        return out
    wanted = "(" + ", ".join("*" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"
    if not numbers:
        raise TypeError(f"{name} must be numbers of shape {wanted}, not {type(value).__name__} of {out.dtype}")
    raise ValueError(f"{name} must have shape {wanted}, not {out.shape}")


def indices(name: str, value: ArrayLike, shape: Sequence[int | None], count: int) -> Indices:
    """Return `value` as int64 indices below `count`; an empty list is valid, booleans are not (see `selection`)."""
    given = _numbers(name, value, shape)
    if given.dtype == bool:
        raise TypeError(f"{name} must be whole numbers, not bool")
    out = array(name, given, shape, np.int64) if given.size else np.zeros(given.shape, np.int64)
    if (wrong := (out < 0) | (out >= count)).any():
        bad = np.argwhere(wrong)[0]
        raise ValueError(f"{name}{bad.tolist()} is {out[tuple(bad)]}, outside 0..{count - 1}")
    return out


def selection(name: str, value: ArrayLike, count: int) -> Indices:
    """Return a selection among `count` elements, given as indices or as a boolean mask, as (m,) int64 indices."""
    given = _numbers(name, value, (None,))
    if given.dtype == bool:
        return np.flatnonzero(array(name, given, (count,), bool))
    return indices(name, given, (None,), count)


def number(name: str, value: Any, low: float = -math.inf, high: float = math.inf, *, open_low: bool = False) -> float:
    """Return `value` as a finite float between `low` and `high`; `open_low` excludes `low` itself."""
    plain = np.isscalar(value) or getattr(value, "ndim", 1) == 0
    if not plain or isinstance(value, bool | np.bool_ | str | bytes):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}")
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}") from None
    if not math.isfinite(out):
        raise ValueError(f"{name} must be finite, not {out}")
    if not low <= out <= high or (open_low and out == low):
        above = f"above {low:g}" if open_low else f"at least {low:g}"
        between = f"{above} and at most {high:g}" if open_low else f"between {low:g} and {high:g}"
        wanted = above if high == math.inf else between
        raise ValueError(f"{name} must be {wanted}, not {out:g}")
    return out


def angle(name: str, value: Any) -> float:
    """Return an angle in radians, from 0 to pi."""
    out = number(name, value, 0.0)
    if out > math.pi:
        raise ValueError(f"{name} must be in radians, at most {math.pi:g}, not {out:g}: numpy.radians converts degrees")
    return out


def integer(name: str, value: Any, low: int, high: int | None = None) -> int:
    """Return `value` as an int between `low` and `high`, both included."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name} must be a whole number, not {type(value).__name__} {value!r}")
    out = int(value)
    if out < low:
        raise ValueError(f"{name} must be at least {low}, not {out}")
    if high is not None and out > high:
        raise ValueError(f"{name} must be at most {high}, not {out}")
    return out


def integers(name: str, values: Sequence[Any], low: int, high: int | None = None) -> list[int]:
    """Return whole numbers between `low` and `high`, given one by one or as one sequence or array."""
    if len(values) == 1 and (isinstance(values[0], list | tuple | range) or np.ndim(values[0]) == 1):
        values = list(values[0])
    return [integer(name, value, low, high) for value in values]


def flag(name: str, value: Any) -> bool:
    """Return `value` as a bool."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be true or false, not {type(value).__name__} {value!r}")
    return bool(value)


def choice(name: str, value: Any, options: Sequence[str]) -> str:
    """Return `value` if it is one of `options`; the error lists them and suggests the most similar one."""
    if not isinstance(value, str) or value not in options:
        meant = closest_word(value, options)
        hint = f": did you mean {meant!r}?" if meant else ""
        raise ValueError(f"{name} must be one of {', '.join(map(repr, options))}, not {value!r}{hint}")
    return str(value)


def closest_word(word: Any, words: Sequence[str]) -> str | None:
    """Return the only one of `words` that starts with `word` (3 letters at least, in any case), else a similar one."""
    import difflib

    if not isinstance(word, str):
        return None
    plain = {_plain(each): each for each in reversed(words)}
    begun = [each for each in plain if len(_plain(word)) > 2 and each.startswith(_plain(word))]
    found = begun if len(begun) == 1 else difflib.get_close_matches(_plain(word), plain, 1)
    return plain[found[0]] if found else None


def _plain(word: str) -> str:
    """Return a word in lower case without separators."""
    return word[:1].lower() + word[1:].lower().translate({ord(mark): None for mark in "-_ "})


def affine(name: str, value: ArrayLike) -> Array:
    """Return an invertible (4, 4) affine transform of any scale, checked."""
    T = array(name, value, (4, 4))
    scale = np.abs(T[:3, :3]).max()
    if not np.array_equal(T[3], [0, 0, 0, 1]):
        raise ValueError(f"{name} must have the last row (0, 0, 0, 1), not {tuple(T[3].tolist())}")
    if not scale > 0 or abs(np.linalg.det(T[:3, :3] / scale)) < 1e-30:
        raise ValueError(f"{name} must be invertible, its linear part is singular")
    return T


def generator(name: str, value: Any) -> np.random.Generator:
    """Return a random generator: `value` itself, or one seeded by it; None for an arbitrary seed."""
    try:
        return np.random.default_rng(value)
    except TypeError:
        raise TypeError(f"{name} must be a Generator or a whole number, not {type(value).__name__} {value!r}") from None
    except ValueError:
        raise ValueError(f"{name} must be a Generator or a whole number of at least 0, not {value!r}") from None


def path(name: str, value: Any) -> Path:
    """Return `value`, a string or path, as a Path with the home directory expanded."""
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name} must be a string or a Path, not {type(value).__name__}")
    return Path(value).expanduser()


def instance(name: str, value: Any, kind: type[Kind]) -> Kind:
    """Return `value` if it is an instance of `kind`."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} must be a {kind.__name__}, not {type_name(value)}")
    return value


def type_name(value: Any) -> str:
    """Return the name of an object's type, or what it says instead, with its library if this is another one."""
    library = type(value).__module__.partition(".")[0]
    own = library in ("builtins", "numpy", "simplexmesh")
    return getattr(value, "_named", type(value).__name__) if own else f"{library}.{type(value).__name__}"


def size(name: str, bounds: Array) -> None:
    """Refuse (2, 3) bounds so small, so large or so far from the origin that products of areas overflow or vanish."""
    extent, far = float((bounds[1] / 2 - bounds[0] / 2).max()), float(np.abs(bounds).max())
    if far > LARGEST or 0.0 < extent < SMALLEST:
        found = f"reach to {far:.3g}" if far > LARGEST else f"be {2 * extent:.3g} long"
        limits = f"within {SMALLEST:g} and {LARGEST:g} in its unit of length"
        raise ValueError(f"{name} must be {limits}, not {found}: choose another unit")


def frozen_state(state: dict[str, Any]) -> dict[str, Any]:
    """Return the state of an unpickled or copied object with its arrays read-only again."""
    for value in state.values():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    if "data" in state:
        state["data"] = MappingProxyType(frozen_state(dict(state["data"])))
    return state


def frozen(values: ArrayLike, dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return a read-only C-contiguous copy; the caller's array is neither frozen nor shared."""
    out = np.array(values, dtype=dtype, order="C", copy=True)
    out.setflags(write=False)
    return out
