"""Eight numbers side by side: arithmetic that the machine does on all of them at once, and masks of eight bits.

Whether a loop over eight numbers becomes vector arithmetic is up to the compiler's mood; these always do, in as many
registers as the machine needs for them. They exist inside kernels only.
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
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class _Lanes(types.Type):  # type: ignore[misc]
    """Eight float64."""


_LANES = _Lanes("Lanes")


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    """In memory and in registers the vector itself."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, _VECTOR)


def _spread(builder, number):
    """Return a vector with one number in all lanes."""
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))


def _operate(symbol, name):
    """Let `symbol` work on lanes and lanes, lanes and a number, a number and lanes."""

    @infer_global(symbol)
    class Template(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args, kws):
            if len(args) == 2 and _LANES in args and all(a in (_LANES, types.float64) for a in args):
                return signature(_LANES, *args)
            return None

    for kinds in ((_LANES, _LANES), (_LANES, types.float64), (types.float64, _LANES)):

        @lower_builtin(symbol, *kinds)
        def code(_context, builder, sig, args):
            sides = [a if kind == _LANES else _spread(builder, a) for a, kind in zip(args, sig.args, strict=True)]
            return getattr(builder, name)(*sides)


for _symbol, _name in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul")):
    _operate(_symbol, _name)


def _place(builder, pointer, at):
    return builder.bitcast(builder.gep(pointer, [at]), _VECTOR.as_pointer())


@intrinsic
def eight(_typing, pointer, at):
    """Return the eight numbers from ``pointer[at]`` on."""

    def code(_context, builder, _signature, args):
        return builder.load(_place(builder, *args), align=8)

    return _LANES(pointer, types.int64), code


@intrinsic
def put(_typing, pointer, at, lanes):
    """Store eight numbers from ``pointer[at]`` on."""

    def code(context, builder, _signature, args):
        builder.store(args[2], _place(builder, *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(pointer, types.int64, _LANES), code


@intrinsic
def larger(_typing, first, second):
    """Return, lane by lane, the first number if it is the larger one, else the second."""

    def code(_context, builder, sig, args):
        one, two = (a if k == _LANES else _spread(builder, a) for a, k in zip(args, sig.args, strict=True))
        return builder.select(builder.fcmp_ordered(">", one, two), one, two)

    return _LANES(first, second), code


def _mask(builder, bits):
    return builder.zext(builder.bitcast(bits, ir.IntType(WIDTH)), ir.IntType(64))


@intrinsic
def no_more(_typing, lanes, limit):
    """Return the mask of the numbers that are `limit` or less; bit k is lane k. NaN never is."""

    def code(_context, builder, _signature, args):
        return _mask(builder, builder.fcmp_ordered("<=", args[0], _spread(builder, args[1])))

    return types.int64(lanes, types.float64), code


@intrinsic
def less(_typing, lanes, limit):
    """Return the mask of the numbers that are less than `limit`."""

    def code(_context, builder, _signature, args):
        return _mask(builder, builder.fcmp_ordered("<", args[0], _spread(builder, args[1])))

    return types.int64(lanes, types.float64), code


def _counted(name, *more):
    @intrinsic
    def counted(_typing, mask):
        """Return a number that belongs to a mask of bits."""

        def code(_context, builder, _signature, args):
            kind = ir.IntType(64)
            function = cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(kind, [kind, *(m.type for m in more)]), name
            )
            return builder.call(function, [args[0], *more])

        return types.int64(types.int64), code

    return counted


lowest = _counted("llvm.cttz.i64", ir.Constant(ir.IntType(1), 0))  # which lane comes first; 64 where none is set
bits = _counted("llvm.ctpop.i64")
