"""Lazy compilation: machine code is generated only for kernels that are called from Python.

numba optimizes each function and translates it to machine code before it is linked into its callers: with a kernel that
calls three helpers in a parallel loop this is done eight times, and one result is run. Here a function is translated
when its address is requested; until then it is kept as LLVM code, to be linked into callers, which are optimized as a
whole. That halves the time of the first use of everything; the machine code is as fast as before.
"""

# mypy: allow-untyped-defs, disable-error-code="attr-defined"

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import codegen, compiler
from numba.core.codegen import JITCodeLibrary
from numba.core.dispatcher import _FunctionCompiler
from numba.extending import overload
from numba.np import arrayobj

PARALLEL_LOOP = "__numba_parfor"
"""Prefix of the names of the bodies of parallel loops, whose addresses only their kernel uses."""


class LazyLibrary(JITCodeLibrary):  # type: ignore[misc]
    """The code of one function, linked with all it calls; optimized and translated when its address is requested."""

    translated = False
    environment: tuple[Any, ...] = ()

    @property
    def codegen(self):
        """The code generator; before translation this library instead, which stores the environment for later."""
        return self._codegen if self.translated else self

    def set_env(self, name, env):
        """Store the environment until there is machine code."""
        self.environment = (name, env)

    def get_pointer_to_function(self, name):
        """Return the address of a function, translated now at the latest; zero if it is not defined here."""
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
        for _ in range(2):  # once for the helpers, which are optimized when they are in place, once for the whole
            super()._optimize_final_module()
        self._dynamic_globals.clear()  # finalizing collects them again
        super()._finalize_final_module()
        self.translated = True
        if self.environment:
            self._codegen.set_env(*self.environment)

    def _optimize_functions(self, ll_module):
        """Optimize the functions of a module before linking; numba sets up the passes even for declarations."""
        if not hasattr(codegen, "create_pass_builder"):  # before numba 0.62 one set of passes serves all functions
            super()._optimize_functions(ll_module)
            return
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)

    def _optimize_final_module(self):
        """Postpone this to `_translate`."""

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def serialize_using_object_code(self):
        """Return what the disk cache stores: object code, or bitcode before translation."""
        if self.translated:
            return super().serialize_using_object_code()
        self._ensure_finalized()
        return (self.name, "bitcode", self._get_module_for_linking().as_bitcode())


class Flags(compiler.Flags):  # type: ignore[misc]
    """Compiler flags with a fast comparison; numba compares two dictionaries of all options at each operator."""

    __slots__ = ("code",)

    def __hash__(self):
        if not hasattr(self, "code"):
            plain = (item for item in self._values.items() if isinstance(item[1], bool | str))
            self.code = hash(tuple(sorted(plain)))
        return self.code

    def __eq__(self, other):
        return self._values == other._values if isinstance(other, Flags) else super().__eq__(other)


def shapes_differ(source_shape, index_shape):
    """Raise the error of an assignment to a slice of another shape; for kernels only."""
    raise NotImplementedError


@overload(shapes_differ)
def _shapes_differ(source_shape, index_shape):
    def raised(source_shape, index_shape):
        raise ValueError("cannot assign slice from input of different shape")

    return raised


REPLACED = ((compiler, "Flags", Flags), (arrayobj, "raise_with_shape_context", shapes_differ))
"""Attributes of numba replaced while compiling; its own error of slices prints shapes, at 1.5 s of compilation."""


@contextmanager
def lazy(generator: Any) -> Iterator[None]:
    """Compile all functions within this context lazily; the caller holds numba's compiler lock."""
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
    """Compiler of one kernel and of what it calls, with lazy libraries."""

    def _compile_core(self, args, return_type):
        with lazy(self.targetdescr.target_context.codegen()):
            return super()._compile_core(args, return_type)
