"""Pointers to array data and stack-allocated arrays, for small functions that are called per vertex.

Passing an array on, or slicing it, updates its reference count: two atomic additions, which cost as much as the
arithmetic on a hundred numbers, and more if two threads share the array. A pointer is one register. Scratch arrays
come from the heap, which is as expensive.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def data_pointer(_typing, array):
    """Return a pointer to the first element of a contiguous array, which must outlive it."""

    def code(context, builder, signature, arguments):
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(array.dtype)(array), code


def _stack_array(kind):
    @intrinsic(prefer_literal=True)
    def stack_array(_typing, count):
        """Return a pointer to `count` elements (a constant) on the stack, valid until the function returns."""

        def code(context, builder, signature, _arguments):
            return cgutils.alloca_once(builder, context.get_value_type(kind), size=signature.args[0].literal_value)

        return types.CPointer(kind)(count), code

    return stack_array


stack_floats, stack_integers = _stack_array(types.float64), _stack_array(types.int64)


@intrinsic
def prefetch(_typing, pointer, at):
    """Prefetch the cache line of ``pointer[at]``; any address is safe."""

    def code(context, builder, _signature, args):
        place, number = cgutils.voidptr_t, cgutils.ir.IntType(32)
        kind = cgutils.ir.FunctionType(cgutils.ir.VoidType(), [place, number, number, number])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        address = builder.bitcast(builder.gep(args[0], [args[1]]), place)
        builder.call(function, [address, number(0), number(3), number(1)])
        return context.get_dummy_value()

    return types.void(pointer, types.int64), code
