"""Compilation without work that nobody needs: machine code is made only for kernels that are called from Python.

numba optimizes each function, and makes machine code of it, before another compiles it in: a kernel that calls three
helpers, in a parallel loop, is optimized and translated eight times, of which one is run. Here a function is translated
when its address is asked for; until then it waits, as it was written, for the callers that take it in and are optimized
as a whole. That halves the time of the first use of everything; what is compiled is as fast as before.
"""

# mypy: allow-untyped-defs, disable-error-code="attr-defined"

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import codegen, compiler, types
from numba.core.codegen import JITCodeLibrary
from numba.core.dispatcher import _FunctionCompiler
from numba.extending import overload
from numba.np import arrayobj

PARALLEL_LOOP = "__numba_parfor"
"""How numba names the bodies of parallel loops, which are called by address from no place but their kernel."""


class LazyLibrary(JITCodeLibrary):  # type: ignore[misc]
    """The code of one function, linked with all it calls; optimized and translated when its address is asked for."""

    translated = False
    environment: tuple[Any, ...] = ()

    @property
    def codegen(self):
        """The code generator, or what takes its place while there is no machine code that needs an environment."""
        return self._codegen if self.translated else self

    def set_env(self, name, env):
        """Keep the environment until there is machine code."""
        self.environment = (name, env)

    def get_pointer_to_function(self, name):
        """Return the address of machine code, zero if the library has no function of this name."""
        self._ensure_finalized()
        if not self.translated:
            if self.name.startswith(PARALLEL_LOOP) or not self._defines(name):
                return 0
            self._translate()
        return super().get_pointer_to_function(name)

    def _defines(self, name):
        try:
            return not self._final_module.get_function(name).is_declaration
        except NameError:
            return False

    def _translate(self):
        super()._optimize_final_module()
        self._dynamic_globals.clear()  # they are found again
        super()._finalize_final_module()
        self.translated = True
        if self.environment:
            self._codegen.set_env(*self.environment)

    def _optimize_functions(self, ll_module):
        """Optimize the functions of a module before it is linked; numba sets up the passes for declarations too."""
        if not hasattr(codegen, "create_pass_builder"):  # before numba 0.62 one set of passes serves all functions
            super()._optimize_functions(ll_module)
            return
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)

    def _optimize_final_module(self):
        """Do nothing yet."""

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def serialize_using_object_code(self):
        """Return what the cache on disk keeps."""
        if self.translated:
            return super().serialize_using_object_code()
        self._ensure_finalized()
        return (self.name, "bitcode", self._get_module_for_linking().as_bitcode())


class Flags(compiler.Flags):  # type: ignore[misc]
    """Compiler flags that are compared quickly: numba does so at each operator, by two dictionaries of all options."""

    __slots__ = ("code",)

    def __hash__(self):
        if not hasattr(self, "code"):
            plain = (item for item in self._values.items() if isinstance(item[1], bool | str))
            self.code = hash(tuple(sorted(plain)))
        return self.code

    def __eq__(self, other):
        return self._values == other._values if isinstance(other, Flags) else super().__eq__(other)


def shapes_differ(source_shape, index_shape):
    """Raise the error of an assignment to a slice of another shape, in kernels."""
    raise NotImplementedError


@overload(shapes_differ)
def _shapes_differ(source_shape, index_shape):
    def raised(source_shape, index_shape):
        raise ValueError("cannot assign slice from input of different shape")

    return raised


REPLACED = ((compiler, "Flags", Flags), (arrayobj, "raise_with_shape_context", shapes_differ))
"""What numba uses meanwhile: its own error of slices prints the shapes, which takes a second and a half to compile."""


@contextmanager
def lazy(generator: Any) -> Iterator[None]:
    """Let all functions that are compiled within be lazy; the caller holds numba's compiler lock."""
    replaced = [*REPLACED, (generator, "_library_class", LazyLibrary)]
    before = [(place, name, getattr(place, name)) for place, name, _ in replaced if hasattr(place, name)]
    try:
        for place, name, value in replaced:
            setattr(place, name, value)
        yield
    finally:
        for place, name, value in before:
            setattr(place, name, value)


class LazyCompiler(_FunctionCompiler):  # type: ignore[misc]
    """Compiles one kernel, and what it calls, lazily."""

    def _compile_core(self, args, return_type):
        with lazy(self.targetdescr.target_context.codegen()):
            return super()._compile_core(args, return_type)


def passed(kind):
    """Return the type as which a number is passed from kernel to kernel: one for all integers, literal or not.

    Examples
    --------
    >>> from numba import types
    >>> passed(types.int32), passed(types.literal(2)), passed(types.literal(True)), passed(types.float32)
    (int64, int64, bool, float32)
    """
    kind = types.unliteral(kind) if isinstance(kind, types.IntegerLiteral | types.BooleanLiteral) else kind
    return types.int64 if isinstance(kind, types.Integer) and kind.bitwidth < 64 else kind
