"""Rows of decimal numbers from text."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit

POWERS = 10.0 ** np.arange(23)
"""Exact ones: over or times such, a whole number of 15 digits is the number nearest to what is written."""


@njit(cache=True, error_model="numpy")
def _is_blank(letter):
    """Return whether a letter is one that `bytes.split` takes as a blank."""
    return letter == 32 or 9 <= letter <= 13


@njit(cache=True, error_model="numpy")
def _digits(text, at, value, most):
    """Return a whole number with up to `most` digits from a place appended, and the place after them."""
    end = min(at + most, len(text))
    while at < end and 48 <= text[at] <= 57:
        value, at = 10 * value + np.int64(text[at]) - 48, at + 1
    return value, at


@njit(cache=True, error_model="numpy")
def _decimal(text, begin):
    """Return the decimal number from a place, and the place after it, earlier for one of more than 15 digits."""
    first = begin + int(text[begin] == 45 or text[begin] == 43)
    value, at = _digits(text, first, 0, 15)
    used, scale = at - first, 0
    if at < len(text) and text[at] == 46:
        value, end = _digits(text, at + 1, value, 15 - used)
        scale, used, at = at + 1 - end, used + end - at - 1, end
    if at + 1 < len(text) and (text[at] == 101 or text[at] == 69):
        sign = text[at + 1]
        exponent = at + 1 + int(sign == 45 or sign == 43)
        power, end = _digits(text, exponent, 0, 3)
        scale += -power if sign == 45 else power
        at = end if end > exponent else begin
    if used == 0 or abs(scale) >= len(POWERS):
        return 0.0, begin
    out = value / POWERS[-scale] if scale < 0 else value * POWERS[scale]
    return -out if text[begin] == 45 else out, at


@njit(cache=True, error_model="numpy")
def read_rows(text, numbers, starts, others):
    """Fill the numbers that words are, the first of each row, and (number, begin, end) of other words; count all."""
    count = rows = other = at = 0
    fresh = True
    while at < len(text):
        if _is_blank(text[at]):
            fresh |= text[at] == 10 or text[at] == 13
            at += 1
            continue
        if fresh:
            starts[rows] = count
            rows, fresh = rows + 1, False
        begin = at
        numbers[count], at = _decimal(text, begin)
        if at == begin or (at < len(text) and not _is_blank(text[at])):
            while at < len(text) and not _is_blank(text[at]):
                at += 1
            others[other, 0], others[other, 1], others[other, 2] = count, begin, at
            other += 1
        count += 1
    return count, rows, other
