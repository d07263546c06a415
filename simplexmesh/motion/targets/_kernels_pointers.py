"""Pointers: where an array starts, and room on the stack; for small functions that are called per vertex.

An array that is passed on, or cut into views, is counted as in use: two atomic additions, which cost as much as the
arithmetic on a hundred numbers and more where two threads count on the same array. A pointer is one register. An
array of scratch comes from the heap, which costs as much again.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def start(_typing, array):
    """Return a pointer to the first element of a contiguous array, which must outlive it."""

    def code(context, builder, signature, arguments):
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(array.dtype)(array), code


def _room(kind):
    @intrinsic(prefer_literal=True)
    def room(_typing, count):
        """Return a pointer to room for so many numbers (a constant) on the stack: it ends with the function."""

        def code(context, builder, signature, _arguments):
            return cgutils.alloca_once(builder, context.get_value_type(kind), size=signature.args[0].literal_value)

        return types.CPointer(kind)(count), code

    return room


floats, integers = _room(types.float64), _room(types.int64)


@intrinsic
def fetch(_typing, pointer, at):
    """Have the machine bring ``pointer[at]`` near while it goes on with something else; never fails."""

    def code(context, builder, _signature, args):
        place, number = cgutils.voidptr_t, cgutils.ir.IntType(32)
        kind = cgutils.ir.FunctionType(cgutils.ir.VoidType(), [place, number, number, number])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        address = builder.bitcast(builder.gep(args[0], [args[1]]), place)
        builder.call(function, [address, number(0), number(3), number(1)])
        return context.get_dummy_value()

    return types.void(pointer, types.int64), code
