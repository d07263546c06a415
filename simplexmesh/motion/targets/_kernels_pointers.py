"""Where an array starts, as a pointer: small functions that are called per vertex take it instead of the array.

An array that is passed on, or cut into views, is counted as in use: two atomic additions, which cost as much as the
arithmetic on a hundred numbers and more where two threads count on the same array. A pointer is one register.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

from numba import types
from numba.extending import intrinsic


@intrinsic
def start(_typing, array):
    """Return a pointer to the first element of a contiguous array, which must outlive it."""

    def code(context, builder, signature, arguments):
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(array.dtype)(array), code
