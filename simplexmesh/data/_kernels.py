"""LZF decompression, for compressed PCD files."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit


@njit(cache=True, error_model="numpy")
def lzf_decompressed(packed: NDArray[np.uint8], size: int) -> tuple[Any, int]:
    """Decompress LZF (M. Lehmann, liblzf 3.6, lzf_d.c).

    Parameters
    ----------
    packed : (m,) array of uint8
        Each control byte starts a literal run of control + 1 bytes if it is below 32, else a back reference of length
        (control >> 5) + 2 (7 means that another byte is added) and distance ((control & 31) << 8) + byte + 1.
    size : int
        Number of bytes after decompression.

    Returns
    -------
    bytes : (size,) array of uint8
    written : int
        How many of them were written: less than `size` if the input is damaged or truncated, -1 if it holds more.
    """
    out = np.zeros(size, np.uint8)
    read = 0
    written = 0
    end = len(packed)
    while read < end:
        control = int(packed[read])
        read += 1
        if control < 32:
            length = control + 1
            if read + length > end:
                return out, written
            if written + length > size:
                return out, -1
            for i in range(length):
                out[written + i] = packed[read + i]
            read += length
        else:
            length = (control >> 5) + 2
            if length == 9:
                if read >= end:
                    return out, written
                length += int(packed[read])
                read += 1
            if read >= end:
                return out, written
            source = written - (((control & 31) << 8) + int(packed[read]) + 1)
            read += 1
            if source < 0 or written + length > size:
                return out, -1
            for i in range(length):
                out[written + i] = out[source + i]
        written += length
    return out, written
