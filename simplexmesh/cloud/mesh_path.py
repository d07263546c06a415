"""Paths of files that hold meshes, where others hold parameters."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from simplexmesh.data.io.writing import FORMATS


def mesh_path(path: Path, others: Sequence[str]) -> Path:
    """Return a path that ends as files of meshes do, or say that it must, or as others."""
    meshes = [ending for ending, known in FORMATS.items() if known.of_faces]
    if path.suffix.lower() not in meshes:
        raise ValueError(f"path must end in one of {', '.join(dict.fromkeys([*others, *meshes]))}, not {path.name!r}")
    return path
