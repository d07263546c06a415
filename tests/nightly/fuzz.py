"""Damaged files, and processes that read them: what kills one of them, hangs, or is not refused in one sentence."""

from __future__ import annotations

import json
import os
import re
import select
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NUMBERS = [
    *(b"-1", b"0", b"1", b"3", b"255", b"65536", b"2147483647", b"2147483648", b"4294967295", b"1000000000000"),
    *(b"9223372036854775807", b"-9223372036854775808", b"99999999999999999999999", b"nan", b"inf", b"-inf", b"1e308"),
    *(b"1e-320", b"", b"x", b"0.5", b"-7"),
]
HEAD = 3000  # bytes in which headers mostly lie
ROOT = Path(__file__).parents[2]


def mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with one to three kinds of damage, mostly near its beginning."""
    for _ in range(int(rng.integers(1, 4))):
        content = KINDS[int(rng.integers(len(KINDS)))](content, rng)
    return content


def _place(content: bytes, rng: np.random.Generator) -> int:
    return int(rng.integers(max(1, min(len(content), HEAD) if rng.random() < 0.7 else len(content))))


def _flipped(content: bytes, rng: np.random.Generator) -> bytes:
    out = bytearray(content or b"\0")
    for _ in range(int(rng.integers(1, 9))):
        out[_place(content, rng)] = int(rng.choice([0, 1, 0x7F, 0x80, 0xFF, int(rng.integers(256))]))
    return bytes(out)


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: _place(content, rng)]


def _without_a_piece(content: bytes, rng: np.random.Generator) -> bytes:
    at = _place(content, rng)
    return content[:at] + content[at + int(rng.integers(1, 200)) :]


def _with_a_piece_twice(content: bytes, rng: np.random.Generator) -> bytes:
    at, to = _place(content, rng), _place(content, rng)
    return content[:to] + content[at : at + int(rng.integers(1, 200))] + content[to:]


def _other_number(content: bytes, rng: np.random.Generator) -> bytes:
    """Replace a number written in the text at the beginning."""
    found = list(re.finditer(rb"(?<![\w.])-?\d[\d.]*", content[:HEAD]))
    if not found:
        return _flipped(content, rng)
    place = found[int(rng.integers(len(found)))]
    return content[: place.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + content[place.end() :]


def _other_integer(content: bytes, rng: np.random.Generator) -> bytes:
    """Overwrite four or eight bytes by a large, small or negative integer."""
    at, width = _place(content, rng), int(rng.choice([4, 8]))
    value = int(rng.choice([-1, 0, 1, 2**31 - 1, -(2**31), 2**24, 40_000_000]))
    return content[:at] + value.to_bytes(width, "little", signed=True) + content[at + width :]


def _words_swapped(content: bytes, rng: np.random.Generator) -> bytes:
    words = re.split(rb"(\s+)", content[:HEAD])
    a, b = rng.integers(len(words), size=2)
    words[a], words[b] = words[b], words[a]
    return b"".join(words) + content[HEAD:]


KINDS: list[Callable[[bytes, np.random.Generator], bytes]] = [
    *(_flipped, _cut, _without_a_piece, _with_a_piece_twice),
    *(_other_number, _other_number, _other_number, _other_integer, _words_swapped),
]


@dataclass
class Reader:
    """A process that reads files one after the other, started anew after one that ended or stopped it."""

    sound: list[str]  # files with which it is started
    log: Path
    seconds: float = 20.0

    def __post_init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def wrong(self, path: Path | str) -> str:
        """Return what went wrong with a file or a call; nothing if it succeeded, or was refused in one sentence."""
        process = self._process or self._started()
        printed = self.log.stat().st_size
        process.stdin.write(f"{path}\n")
        process.stdin.flush()
        line = self._line(self.seconds)
        if not line:
            code = process.poll()
            self.stop()
            return f"no answer within {self.seconds:g} s" if code is None else f"ended the process with {code}"
        answer = json.loads(line)
        told = self.log.read_bytes()[printed:].decode("latin-1")
        return answer.get("wrong", "") or (f"printed {told[-300:]!r}" if "Traceback" in told else "")

    def stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process.stdin.close()
            self._process.stdout.close()
            self._process = None

    def _started(self) -> subprocess.Popen[str]:
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "tests.nightly.reader", *self.sound],
                cwd=ROOT,
                env=os.environ | {"PYTHONPATH": str(ROOT)},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                bufsize=1,
            )
        assert self._line(300.0) == "ready\n", self.log.read_text()[-3000:]
        return self._process

    def _line(self, seconds: float) -> str:
        ready, _, _ = select.select([self._process.stdout], [], [], seconds)
        if not ready:
            return ""
        line = self._process.stdout.readline()
        if not line:
            self._process.wait()
        return line


@contextmanager
def reader(folder: Path, sound: Iterable[Path], seconds: float = 20.0) -> Iterator[Reader]:
    log = folder / "printed.log"
    log.touch()
    out = Reader([str(path) for path in sound], log, seconds)
    try:
        yield out
    finally:
        out.stop()


def damage(path: Path, folder: Path, count: int, process: Reader, seed: int = 0) -> list[tuple[int, str]]:
    """Return the numbers of the mutations of a file that went wrong, and how; those files are kept."""
    found = []
    content = path.read_bytes()
    for number in range(count):
        rng = np.random.default_rng([seed, number, len(content)])
        copy = folder / f"{path.stem}-{number}{''.join(path.suffixes)}"
        copy.write_bytes(mutated(content, rng))
        if wrong := process.wrong(copy):
            found.append((number, wrong))
        else:
            copy.unlink()
    return found
