"""Weighted means of rows of arrays, by what the arrays hold: numbers, colors, or names that cannot be averaged."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array
from simplexmesh._base.named_arrays import Data, is_color


def blended(data: Data, rows: NDArray[Any], weights: Array) -> dict[str, NDArray[Any]]:
    """Return weighted means of the (n, k) `rows` of named arrays, of their types; whole numbers by majority."""
    return {name: _blend(values)(values[rows], weights) for name, values in data.items()}


def _blend(values: NDArray[Any]) -> Any:
    return _mean if values.dtype.kind == "f" else _light if is_color(values) else _majority


def _mean(values: NDArray[Any], weights: Array) -> NDArray[Any]:
    """Return the weighted means of (n, k, ...) values; NaN where all values are."""
    wide = weights.reshape(weights.shape + (1,) * (values.ndim - 2))
    counted = np.where(np.isnan(values), 0.0, wide)
    total = counted.sum(axis=1)
    with np.errstate(invalid="ignore"):
        means = (counted * np.where(counted > 0, values, 0.0)).sum(axis=1) / total
    return means.astype(values.dtype)


def _light(colors: NDArray[np.uint8], weights: Array) -> NDArray[np.uint8]:
    """Return the mean of (n, k, 3 or 4) colors as light adds up: decoded from sRGB; opacity is averaged as it is."""
    share = colors / 255.0
    s = share[..., :3]
    share[..., :3] = np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1
    mean = _mean(share, weights)
    s = mean[..., :3]
    mean[..., :3] = np.where(s <= 0.0031308, 12.92 * s, 1.055 * np.maximum(s, 0.0) ** (1 / 2.4) - 0.055)
    return np.rint(255 * mean).astype(np.uint8)


def _majority(values: NDArray[Any], weights: Array) -> NDArray[Any]:
    """Return the most frequent by weight of (n, k, ...) values, the first of several."""
    wide = weights.reshape(weights.shape + (1,) * (values.ndim - 2))
    votes = np.stack([(wide * (values == values[:, [j]])).sum(axis=1) for j in range(values.shape[1])], axis=1)
    best = votes.argmax(axis=1)
    return np.take_along_axis(values, best[:, None], axis=1)[:, 0]
