"""How kernels are compiled: once for read-only and writable arrays, and safely where processes start together.

numba compiles a function again for every mixture of read-only and writable arrays it is called with, which differ in
nothing the machine sees; here the arrays of a call from Python are all taken for writable, and so are those of the
kernels called from there. (That none writes to what it was lent is checked by the tests, in `tests/kernel_writes.py`.)

numba's cache on disk numbers its files in the order they come, so two processes that compile one kernel at the same
time for different types give both results the same name; the index then calls one by the other's types for ever after,
which is an error, wrong numbers or a dead process (numba issues 4807 and 10128). Here a file's name tells what it
holds, and the index names it once it is whole.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba.core import types
from numba.core.caching import IndexDataCacheFile
from numba.core.registry import CPUDispatcher
from numba.core.types.containers import BaseTuple


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return numba's decorator with these options, for kernels.

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
        kernel = numba.njit(no_cfunc_wrapper=True, **options)(function)  # none is passed on by its address
        if isinstance(kernel, CPUDispatcher):  # NUMBA_DISABLE_JIT leaves functions as they are
            kernel.__class__ = Kernel
            if hasattr(kernel._cache, "_cache_file"):
                kernel._cache._cache_file.__class__ = Files
        return kernel

    return compiled


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A compiled function that takes read-only arrays for writable ones."""

    def _compile_for_args(self, *args, **kws):
        """Return the code for these arguments; numba asks once per mixture of types."""
        given = [arg._numba_type_ if hasattr(arg, "_numba_type_") else numba.typeof(arg) for arg in args]
        wanted = [writable(kind) for kind in given]
        if wanted == given:
            return super()._compile_for_args(*args, **kws)
        code = self.compile(tuple(wanted))
        self._insert([kind._code for kind in given], code, objectmode=False)
        return code


def writable(kind):
    """Return the type with its arrays writable; they may be parts of tuples."""
    if isinstance(kind, types.Array) and not kind.mutable:
        return kind.copy(readonly=False)
    if isinstance(kind, BaseTuple) and len(kind):
        return BaseTuple.from_types([writable(part) for part in kind], getattr(kind, "instance_class", None))
    return kind


class Files(IndexDataCacheFile):  # type: ignore[misc]
    """The files of one kernel's compiled forms."""

    def save(self, key, data):
        """Keep a compiled form: first its file, then its line in the index."""
        stem = self._index_name.removesuffix("nbi")
        if Path(self._index_path).exists() and not self._load_index():  # it and all files are of other source
            for old in Path(self._cache_path).glob(f"{stem}*.nbc"):
                with suppress(OSError):
                    old.unlink()
        content = hashlib.sha256(repr((key, self._source_stamp)).encode()).hexdigest()[:16]
        self._save_data(f"{stem}{content}.nbc", data)
        self._save_index({**self._load_index(), key: f"{stem}{content}.nbc"})
