"""A process that reads files, or calls a function of the API with a shape, and tells in JSON how each of them ended.

On its standard input are paths, or the names of a shape and a function with a bar between them.
"""

from __future__ import annotations

import json
import resource
import sys
import traceback
import warnings
from pathlib import Path

import simplexmesh as sm
from tests.nightly import doors

ROOM = 1 << 30  # bytes that reading a small file may need beyond what the process has; functions also compile
SENTENCE = 350


def read(path: str) -> object:
    if "|" in path:
        return doors.call(*path.split("|"))
    if path.endswith(".npz"):
        return sm.SAI.load(path)
    if path.endswith(".sml"):
        return sm.ModelLibrary(path).points("ball")
    if path.endswith(".conf"):
        return sm.read_poses(path)
    return sm.read(path)


def complaint(error: BaseException, *, call: bool) -> str:
    """What is wrong with the error of a damaged file or a call; nothing, if it is one sentence of the right kind."""
    text = str(error)
    kinds = (OSError, ValueError, TypeError, sm.DivergedError) if call else (OSError, ValueError)
    if not isinstance(error, kinds) or isinstance(error, UnicodeError):
        return f"{type(error).__name__}: {text[:SENTENCE]}"
    if "\n" in text or not 0 < len(text) < SENTENCE or "0x" in text:
        return f"not one sentence: {text[:1000]}"
    last = traceback.extract_tb(error.__traceback__)[-1]
    if call and not (last.line or "").startswith("raise"):
        return f"{type(error).__name__} in {last.filename}, line {last.lineno}: {text}"
    return ""


def outcome(path: str) -> dict[str, str]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", sm.SimplexMeshWarning)
            return {"read": type(read(path)).__name__}
    except Exception as error:
        wrong = complaint(error, call="|" in path)
        return {"wrong": wrong} if wrong else {"refused": str(error)}


def size() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def main() -> None:
    for path in sys.argv[1:]:  # sound files, with which everything is imported
        found = outcome(path)
        assert "read" in found, found
    resource.setrlimit(resource.RLIMIT_AS, (size() + ROOM * (1 if sys.argv[1:] else 6),) * 2)
    print("ready", flush=True)  # noqa: T201
    for line in sys.stdin:
        print(json.dumps(outcome(line.rstrip("\n"))), flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
