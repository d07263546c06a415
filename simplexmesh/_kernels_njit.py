"""The decorator of all kernels: one compilation for read-only and writable arrays, and a race-free disk cache.

numba compiles a function again for every combination of read-only and writable arrays it is called with, although the
machine code is the same; here all arrays of a call from Python are typed as writable, and so are those passed on to
other kernels. (`tests/kernel_writes.py` checks that no kernel writes to a read-only input.)

numba's disk cache numbers its files in order of arrival, so two processes that compile one kernel at the same time for
different types give both results the same name; the index then maps one signature to the other's code permanently,
which causes errors, wrong numbers or crashes (numba issues 4807 and 10128). Here a file's name is a hash of its
signature, and the index refers to a file only once it is complete.

Nor does numba's cache see that a file has changed from which a kernel imports others, or constants, which are compiled
in: after an upgrade old and new code would be mixed. Here a kernel's sources are all of the package it imports.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from numba.core import types
from numba.core.caching import IndexDataCacheFile
from numba.core.registry import CPUDispatcher
from numba.core.types.containers import BaseTuple

LAZY = numba.version_info.short < (0, 69)
"""Whether kernels are compiled lazily, which relies on internals of numba: with the versions it is tested with only.

With later ones everything computes the same, but the first use takes twice as long.
"""

if LAZY:
    from simplexmesh._kernels_lazy import LazyCompiler

IMPORTED = re.compile(rb"^from ([\w.]+) import", re.MULTILINE)
"""An import as it is written in kernel files."""


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return the kernel decorator, `numba.njit` with these options.

    Examples
    --------
    >>> import numpy as np
    >>> total = njit()(lambda x: x.sum())
    >>> x = np.arange(4.0)
    >>> x.flags.writeable = False
    >>> total(x), total(x.copy()), len(total.signatures)
    (6.0, 6.0, 1)
    """

    def compiled(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(no_cfunc_wrapper=True, **options)(function)  # no kernel is called from C
        if isinstance(kernel, CPUDispatcher):  # NUMBA_DISABLE_JIT leaves functions as they are
            adopted(kernel, Kernel).options = options
        return kernel

    return compiled


def adopted(dispatcher: Any, kind: type) -> Any:
    """Return numba's dispatcher as an instance of `kind`, compiled lazily if possible and cached in a `CacheFile`."""
    dispatcher.__class__ = kind
    if LAZY:
        dispatcher._compiler.__class__ = LazyCompiler
    if hasattr(dispatcher._cache, "_cache_file"):
        file = dispatcher._cache._cache_file
        file.__class__ = CacheFile
        file._source_stamp = (file._source_stamp, source_hash(dispatcher.py_func.__module__))
    return dispatcher


@cache
def source_hash(module: str) -> str:
    """Return a hash of the source of an imported module, and of all of its package that it imports."""
    source = Path(str(sys.modules[module].__file__)).read_bytes()
    package = module.partition(".")[0]
    names = sorted({name.decode() for name in IMPORTED.findall(source)})
    parts = [source_hash(name).encode() for name in names if name.partition(".")[0] == package]
    return hashlib.sha256(b"".join([source, *parts])).hexdigest()


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A compiled function whose read-only array arguments are typed as writable."""

    options: dict[str, Any]

    @cached_property
    def callee(self):
        """The variant that other kernels call, without a Python wrapper; None for kernels inlined, or not lazy."""
        if "inline" in self.options or not LAZY:
            return None
        own = self.py_func
        twin = FunctionType(own.__code__, own.__globals__, own.__name__, own.__defaults__, own.__closure__)
        twin.__module__ = own.__module__
        twin.__qualname__ = f"{own.__qualname__}_callee"  # the disk cache knows kernels by name, not by flags
        inner = numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **self.options)(twin)
        return adopted(inner, CPUDispatcher)

    def get_call_template(self, args, kws):
        """Return the signature for a call from another kernel; numba asks while it compiles that one."""
        if self.callee is None:
            return super().get_call_template(args, kws)
        return self.callee.get_call_template(args, kws)

    def get_overload(self, sig):
        """Return what identifies the code for a call from another kernel."""
        return super().get_overload(sig) if self.callee is None else self.callee.get_overload(sig)

    def _compile_for_args(self, *args, **kws):
        """Return the machine code for these arguments; numba calls this once per combination of types."""
        given = [arg._numba_type_ if hasattr(arg, "_numba_type_") else numba.typeof(arg) for arg in args]
        wanted = [writable(kind) for kind in given]
        if wanted == given:
            return super()._compile_for_args(*args, **kws)
        code = self.compile(tuple(wanted))
        self._insert([kind._code for kind in given], code, objectmode=False)
        return code


def writable(kind):
    """Return the type with all its arrays writable, also those within tuples."""
    if isinstance(kind, types.Array) and not kind.mutable:
        return kind.copy(readonly=False)
    if isinstance(kind, BaseTuple) and len(kind):
        return BaseTuple.from_types([writable(part) for part in kind], getattr(kind, "instance_class", None))
    return kind


class CacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """Index and data files of one kernel's compiled specializations."""

    def load(self, key):
        """Return a stored specialization; None if there is none, or if it names a type since renamed or moved."""
        try:
            return super().load(key)
        except (AttributeError, ImportError):
            return None

    def _load_index(self):
        """Return the index, empty if it was written for another source or names a type since renamed or moved."""
        try:
            return super()._load_index()
        except (AttributeError, ImportError):
            return {}

    def save(self, key, data):
        """Store a compiled specialization: the data file first, then its entry in the index."""
        stem = self._index_name.removesuffix("nbi")
        if Path(self._index_path).exists() and not self._load_index():  # all files are of an older source
            for old in Path(self._cache_path).glob(f"{stem}*.nbc"):
                with suppress(OSError):
                    old.unlink()
        content = hashlib.sha256(repr((key, self._source_stamp)).encode()).hexdigest()[:16]
        self._save_data(f"{stem}{content}.nbc", data)
        self._save_index({**self._load_index(), key: f"{stem}{content}.nbc"})
