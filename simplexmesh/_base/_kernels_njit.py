"""The decorator of all kernels: `numba.njit` with one compilation for read-only and writable arrays, and a safe cache.

Neither has a public way in numba. `tests/base/kernel_writes.py` checks that no kernel writes to a read-only array.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import hashlib
import re
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import types
from numba.core.caching import IndexDataCacheFile
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.types.containers import BaseTuple

from simplexmesh._base.interrupts import deferred_interrupts

IMPORTED = re.compile(rb"^from ([\w.]+) import", re.MULTILINE)
"""An import as it is written in kernel files."""

FAST = {"nsz", "arcp", "contract", "reassoc"}  # never 'nnan': NaN means "no data here" and must stay visible

LEAN = {"cache": True, "error_model": "numpy", "_nrt": False, "forceinline": True}
"""Options of small functions called per vertex and candidate: inlined, and without numba's counting of references to
arrays, which costs more than their arithmetic. Such functions cannot allocate or slice arrays."""


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return the kernel decorator, `numba.njit` with these options."""

    def compiled(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(no_cfunc_wrapper=True, **options)(function)  # no kernel is called from C
        if isinstance(kernel, CPUDispatcher):  # NUMBA_DISABLE_JIT leaves functions as they are
            kernel.__class__ = Kernel
            if hasattr(kernel._cache, "_cache_file"):
                file = kernel._cache._cache_file
                file.__class__ = CacheFile
                file._source_stamp = (file._source_stamp, source_hash(function.__module__))
        return kernel

    return compiled


@cache
def source_hash(module: str) -> str:
    """Return a hash of the source of an imported module, and of all of its package that it imports."""
    source = Path(str(sys.modules[module].__file__)).read_bytes()
    package = module.partition(".")[0]
    names = sorted({name.decode() for name in IMPORTED.findall(source)})
    parts = [source_hash(name).encode() for name in names if name.partition(".")[0] == package]
    return hashlib.sha256(b"".join([source, *parts])).hexdigest()


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A compiled function whose read-only arrays are typed as writable, and its numbers as of full width.

    Otherwise numba would compile it anew for each combination, and the arrays of meshes are read-only.
    """

    def compile(self, sig):
        """Return the machine code for a signature; a Ctrl-C, which crashed numba now and then, waits for it."""
        if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            return super().compile(sig)
        with deferred_interrupts() as interrupts:
            try:
                code = super().compile(sig)
            except Exception:
                interrupts.check()
                raise
        interrupts.check()
        return code

    def get_call_template(self, args, kws):
        """Return how a kernel calls this one with these types; one compilation serves all literals and widths."""
        return super().get_call_template(tuple(map(plain, args)), {name: plain(kind) for name, kind in kws.items()})

    def _compile_for_args(self, *args, **kws):
        """Return the machine code for these arguments; numba calls this once per combination of types.

        One thread at a time: Python 3.11 fails to parse in two at once, and numba would look up what two enter here
        twice, at every call.
        """
        given = [numba.typeof(arg) for arg in args]
        wanted = [writable(kind) for kind in given]
        with global_compiler_lock:
            if wanted == given:
                return super()._compile_for_args(*args, **kws)
            code, known = self.compile(tuple(wanted)), self.__dict__.setdefault("known", [])
            if given not in known:
                known.append(given)
                self._insert([kind._code for kind in given], code, objectmode=False)
        return code


def plain(kind):
    """Return the type of a number without its value and width: numba would compile anew for each."""
    kind = types.unliteral(kind)  # type: ignore[attr-defined]
    return types.int64 if kind in types.signed_domain else kind


def writable(kind):
    """Return the type with all its arrays writable, also those within tuples."""
    if isinstance(kind, types.Array) and not kind.mutable:
        return kind.copy(readonly=False)
    if isinstance(kind, BaseTuple) and len(kind):
        return BaseTuple.from_types([writable(part) for part in kind], getattr(kind, "instance_class", None))
    return kind


class CacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """Index and data files of one kernel's compiled specializations; those that name a type since renamed are stale.

    Data files are named after signature and sources: numba's are mixed up by processes that compile at the same time
    (its issues 4807 and 10128), and are used although a file has changed from which the kernel imports.
    """

    def load(self, key):
        """Return a stored specialization, or None."""
        try:
            return super().load(key)
        except (AttributeError, ImportError):
            return None

    def _load_index(self):
        """Return the index, empty if it was written for another source."""
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
