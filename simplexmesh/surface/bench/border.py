"""Errors of curvature at the border of a mesh, and inside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from simplexmesh.surface.bench.candidates import RefusedError, curvature_of
from simplexmesh.surface.samples import Samples
from simplexmesh.surface.truth.discretized import cut, torus
from simplexmesh.surface.truth.noise import noisy

NOISE = (0.0, 0.01, 0.1)
"""Standard deviations, in mean edges."""

GRID = (168, 60)


def border_table(names: Sequence[str], rng: int = 0) -> Iterator[dict[str, Any]]:
    """Yield for each method and noise the relative error of H on half an irregular torus, inside and at the border.

    Root mean squares over that of the exact H. Vertices without an estimate are left out; their share at the border is
    given.
    """
    ring = torus(*GRID, irregular=True, rng=rng)
    half = cut(ring, ring.vertices[:, 0] > 0)
    size = float(np.sqrt((half.exact.mean**2).mean()))
    for amount in NOISE:
        mesh = noisy(half.mesh, amount, rng=rng + 1)
        for name in names:
            try:
                found = curvature_of(name, Samples(mesh.vertices, mesh.faces))
            except RefusedError:
                continue
            off = (found.mean - half.exact.mean) / size
            inside, border = off[half.inner & ~found.failed], off[~half.inner & ~found.failed]
            yield {
                "method": name,
                "noise": amount,
                "inside": float(np.sqrt((inside**2).mean())) if len(inside) else np.nan,
                "border": float(np.sqrt((border**2).mean())) if len(border) else np.nan,
                "failed at the border": float(found.failed[~half.inner].mean()),
            }
