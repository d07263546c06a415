"""Distinguish label volumes (region numbers) from intensity volumes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_LABELS = 64
_LARGEST_LABEL = 1 << 31
_SLAB = 1 << 22


def looks_like_labels(values: NDArray[Any], most: int = MOST_LABELS) -> bool:
    """Whether samples look like labels: few distinct whole numbers in coherent regions; see `Volume.is_labels`."""
    found = few_whole_numbers(values, most)
    return found is not None and (len(found) <= 2 or _form_regions(values, max(found, key=lambda label: found[label])))


def _form_regions(values: NDArray[Any], background: int) -> bool:
    """Whether more than half of the pairs adjacent along i, those within the background excluded, are equal."""
    equal = pairs = 0
    for slab in slabs(values):
        a, b = slab[:-1], slab[1:]
        outside = (a != background) | (b != background)
        pairs += int(np.count_nonzero(outside))
        equal += int(np.count_nonzero((a == b) & outside))
    return 2 * equal > pairs


def slabs(values: NDArray[Any]) -> Iterator[NDArray[Any]]:
    """Yield slabs along the last axis, of up to 4 million samples, so that temporaries stay small."""
    thickness = max(1, _SLAB // (values.shape[0] * values.shape[1]))
    for k in range(0, values.shape[2], thickness):
        yield values[:, :, k : k + thickness]


def few_whole_numbers(values: NDArray[Any], most: int = MOST_LABELS) -> dict[int, int] | None:
    """Return the count of each value, or None if one is not a whole number or there are more than `most`."""
    found: dict[int, int] = {}
    for slab in slabs(values):
        if slab.dtype.kind == "f" and (slab != np.rint(slab)).any():
            return None
        if slab.dtype.kind == "f" and np.abs(slab).max() > _LARGEST_LABEL:
            return None
        for value, count in _counts(slab.ravel(order="K")):
            found[value] = found.get(value, 0) + count
        if len(found) > most:
            return None
    return found


def _counts(flat: NDArray[Any]) -> list[tuple[int, int]]:
    low = int(flat.min())
    if int(flat.max()) - low < 1 << 16:
        counts = np.bincount(flat.astype(np.int64) - low)
        present = np.flatnonzero(counts)
        return [(int(p) + low, int(counts[p])) for p in present]
    unique, counts = np.unique(flat, return_counts=True)
    return [(int(u), int(c)) for u, c in zip(unique, counts, strict=True)]
