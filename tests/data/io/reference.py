"""Naive references of the kernels of data, written from the descriptions of the formats."""

from __future__ import annotations


def lzf_decompressed(packed: bytes) -> bytes:
    """LZF after the comment in lzf_d.c: literal runs, and copies of what is already there."""
    out = bytearray()
    packed = bytearray(packed)
    while packed:
        control = packed.pop(0)
        if control < 1 << 5:
            for _ in range(control + 1):
                out.append(packed.pop(0))
        else:
            length = control >> 5
            if length == 7:
                length += packed.pop(0)
            distance = ((control & 0x1F) << 8) + packed.pop(0) + 1
            for _ in range(length + 2):
                out.append(out[-distance])
    return bytes(out)


def lzf_compressed(content: bytes) -> bytes:
    """Greedy LZF: the longest earlier match of three bytes or more, else literals in runs of at most 32."""
    out = bytearray()
    run = bytearray()
    at = 0
    while at < len(content):
        best, where = 0, 0
        for start in range(max(0, at - 8192), at):
            length = 0
            while length < 264 and at + length < len(content) and content[start + length] == content[at + length]:
                length += 1
            if length > best:
                best, where = length, start
        if best >= 3:
            _flush(out, run)
            distance = at - where - 1
            size = best - 2
            if size < 7:
                out.append((size << 5) | (distance >> 8))
            else:
                out += bytes([(7 << 5) | (distance >> 8), size - 7])
            out.append(distance & 0xFF)
            at += best
        else:
            run.append(content[at])
            at += 1
    _flush(out, run)
    return bytes(out)


def _flush(out: bytearray, run: bytearray) -> None:
    while run:
        piece = run[:32]
        del run[:32]
        out.append(len(piece) - 1)
        out += piece
