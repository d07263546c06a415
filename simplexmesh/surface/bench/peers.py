"""Fifth test: tori and ellipsoids, regular and irregular, clean and noisy, on which other programs were measured."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.bench.candidates import RefusedError, curvature_of, method, normals_of
from simplexmesh.surface.neighborhoods import Neighborhood, rings
from simplexmesh.surface.samples import Samples
from simplexmesh.surface.truth import discretized
from simplexmesh.surface.truth.discretized import Discretized
from simplexmesh.surface.truth.noise import noisy

Array = NDArray[np.float64]

GRIDS = {"2.5k": (84, 30), "10k": (168, 60), "41k": (340, 120)}
WIDE = 3


class Case(NamedTuple):
    """One column of the table: a mesh, and noise with its unit."""

    size: str
    irregular: bool = True
    noise: float = 0.0
    unit: str = "edge"
    shape: str = "torus"

    @property
    def title(self) -> str:
        """Title of the column."""
        kind = "irregular" if self.irregular else "regular"
        unit = "an edge" if self.unit == "edge" else "the diagonal"
        noise = f"{100 * self.noise:g} % of {unit}" if self.noise else "clean"
        return f"{self.shape} {kind} {self.size}, {noise}"


CASES = (
    *(Case(size, irregular=False) for size in GRIDS),
    *(Case(size, noise=noise) for noise in (0.0, 0.01, 0.1) for size in GRIDS),
    Case("10k", noise=0.01, unit="diagonal"),
    *(Case("10k", noise=noise, shape="ellipsoid") for noise in (0.0, 0.1)),
)


def case_errors(case: Case, names: Mapping[str, Sequence[str]], rng: int = 0) -> Iterator[dict[str, object]]:
    """Yield each method's relative L2 error of H and K, or mean angle of normals in degrees, and its time.

    Methods run with their defaults, and those that accept any neighborhood also with three rings.
    """
    made = _generated(case, rng)
    mesh = noisy(made.mesh, case.noise, unit=case.unit, rng=rng + 1)
    samples = Samples(mesh.vertices, mesh.faces)
    for name, spent, curved in _timed("curvature", names, curvature_of, samples):
        line = {"case": case.title, "method": name, "microseconds": spent}
        line |= {"vertices": len(mesh.vertices), "failed": int(curved.failed.sum())}
        yield line | {"quantity": "H", "error": relative(curved.mean, made.exact.mean)}
        yield line | {"quantity": "K", "error": relative(curved.gauss, made.exact.gauss)}
    for name, spent, directions in _timed("normals", names, normals_of, samples):
        chord = np.linalg.norm(directions - made.exact.normals, axis=1)
        angle = np.degrees(2 * np.arcsin(np.clip(chord / 2, 0, 1)))
        line = {"case": case.title, "method": name, "microseconds": spent, "vertices": len(angle)}
        failed = int(np.isnan(angle).sum())
        yield line | {"failed": failed, "quantity": "N", "error": float(np.nanmean(angle))}


def _timed(
    kind: str, names: Mapping[str, Sequence[str]], call: Callable[..., Any], samples: Samples
) -> Iterator[tuple[str, float, Any]]:
    """Yield the name, the microseconds per vertex and the result of each method that accepts the surface."""
    for name in names[kind]:
        for suffix, around in _neighborhoods(kind, name):
            fresh = Samples(samples.points, samples.faces)  # whose rings are not cached: they are part of the time
            start = time.perf_counter()
            try:
                found = call(name, fresh, around=around)
            except RefusedError:
                continue
            yield name + suffix, 1e6 * (time.perf_counter() - start) / len(samples.points), found


def relative(found: Array, truth: Array) -> float:
    """Return the relative L2 error |found - truth| / |truth| where there is an estimate.

    Examples
    --------
    >>> relative(np.array([1.1, np.nan]), np.array([1.0, 5.0]))
    0.10000000000000009
    """
    known = np.isfinite(found)
    return float(np.linalg.norm((found - truth)[known]) / np.linalg.norm(truth[known]))


def _generated(case: Case, rng: int) -> Discretized:
    around, tube = GRIDS[case.size]
    if case.shape == "ellipsoid":
        return discretized.ellipsoid(100, 100, irregular=case.irregular, rng=rng)
    return discretized.torus(around, tube, irregular=case.irregular, rng=rng)


def _neighborhoods(kind: str, name: str) -> list[tuple[str, Neighborhood | None]]:
    registered = method(kind, name)
    fixed = registered.own_scale or registered.needs_faces
    return [("", None)] if fixed else [("", None), (f", {WIDE} rings", rings(WIDE))]
