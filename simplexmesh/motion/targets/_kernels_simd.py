"""SIMD vectors of eight doubles with arithmetic, comparisons and bit masks, for use inside kernels.

Whether the compiler vectorizes a loop over eight numbers is unpredictable; operations on these always are, in as many
registers as the machine needs.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import operator

from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

WIDTH = 8
ir = cgutils.ir
_LLVM_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class _Vector(types.Type):  # type: ignore[misc]
    """A vector of eight float64."""


_VECTOR = _Vector("Vector8")


@register_model(_Vector)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc]
    """The LLVM vector itself, in memory and in registers."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, _LLVM_VECTOR)


def _broadcast(builder, number):
    """Return a vector with one number in all lanes."""
    one = builder.insert_element(ir.Constant(_LLVM_VECTOR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))


def _define_operator(symbol, name):
    """Define `symbol` for two vectors, and for a vector and a number in either order."""

    @infer_global(symbol)
    class Template(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args, kws):
            if len(args) == 2 and _VECTOR in args and all(a in (_VECTOR, types.float64) for a in args):
                return signature(_VECTOR, *args)
            return None

    for kinds in ((_VECTOR, _VECTOR), (_VECTOR, types.float64), (types.float64, _VECTOR)):

        @lower_builtin(symbol, *kinds)
        def code(_context, builder, sig, args):
            sides = [a if kind == _VECTOR else _broadcast(builder, a) for a, kind in zip(args, sig.args, strict=True)]
            return getattr(builder, name)(*sides)


for _symbol, _name in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul")):
    _define_operator(_symbol, _name)


def _address(builder, pointer, at):
    return builder.bitcast(builder.gep(pointer, [at]), _LLVM_VECTOR.as_pointer())


@intrinsic
def load(_typing, pointer, at):
    """Return the eight numbers from ``pointer[at]`` on."""

    def code(_context, builder, _signature, args):
        return builder.load(_address(builder, *args), align=8)

    return _VECTOR(pointer, types.int64), code


@intrinsic
def store(_typing, pointer, at, lanes):
    """Store eight numbers from ``pointer[at]`` on."""

    def code(context, builder, _signature, args):
        builder.store(args[2], _address(builder, *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(pointer, types.int64, _VECTOR), code


@intrinsic
def maximum(_typing, first, second):
    """Return the lane-wise maximum; the second operand where the comparison is unordered."""

    def code(_context, builder, sig, args):
        one, two = (a if k == _VECTOR else _broadcast(builder, a) for a, k in zip(args, sig.args, strict=True))
        return builder.select(builder.fcmp_ordered(">", one, two), one, two)

    return _VECTOR(first, second), code


def _mask(builder, bits):
    return builder.zext(builder.bitcast(bits, ir.IntType(WIDTH)), ir.IntType(64))


@intrinsic
def less_equal(_typing, lanes, limit):
    """Return the bit mask of the lanes less than or equal to `limit`; bit k is lane k. False for NaN."""

    def code(_context, builder, _signature, args):
        return _mask(builder, builder.fcmp_ordered("<=", args[0], _broadcast(builder, args[1])))

    return types.int64(lanes, types.float64), code


@intrinsic
def less(_typing, lanes, limit):
    """Return the bit mask of the lanes less than `limit`."""

    def code(_context, builder, _signature, args):
        return _mask(builder, builder.fcmp_ordered("<", args[0], _broadcast(builder, args[1])))

    return types.int64(lanes, types.float64), code


def _bit_intrinsic(name, *more):
    @intrinsic
    def bit_intrinsic(_typing, mask):
        """Return the result of an LLVM intrinsic on a bit mask."""

        def code(_context, builder, _signature, args):
            kind = ir.IntType(64)
            function = cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(kind, [kind, *(m.type for m in more)]), name
            )
            return builder.call(function, [args[0], *more])

        return types.int64(types.int64), code

    return bit_intrinsic


trailing_zeros = _bit_intrinsic("llvm.cttz.i64", ir.Constant(ir.IntType(1), 0))  # the first lane; 64 if none is set
population_count = _bit_intrinsic("llvm.ctpop.i64")
