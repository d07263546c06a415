"""Why a vertex has no estimate: codes for kernels, explanations for users."""

from __future__ import annotations

FOUND, FEW, DEGENERATE, OPEN = range(4)

EXPLANATIONS = (
    "",
    "with too few neighbors",
    "with neighbors that coincide or do not span a plane, or without a normal",
    "on a border or without a ring of faces",
)
