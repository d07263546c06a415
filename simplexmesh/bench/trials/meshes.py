"""Whole meshes: regular ones under refinement (Charton 2014, 4.2.2), irregular and noisy tori, and borders."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.bench.trials.candidates import REGISTRIES, distance, estimates, truth
from simplexmesh.bench.truth.discretized import (
    Discretized,
    cut,
    ellipsoid,
    sawtooth,
    split_square,
    torus,
    uv_cylinder,
    uv_sphere,
)
from simplexmesh.bench.truth.graphs import Graph
from simplexmesh.bench.truth.noise import noisy
from simplexmesh.surface.neighborhoods import rings
from simplexmesh.surface.sampled_surface import SampledSurface

Names = Mapping[str, Sequence[str]]
Row = dict[str, Any]

SIZES = (8, 16, 32, 64, 128)


def refined(surfaces: Sequence[Graph], sizes: Sequence[int] = SIZES) -> Iterator[tuple[Row, Discretized]]:
    """Yield (surface, kind of mesh and size, mesh)."""
    for size in sizes:
        for surface in surfaces:
            yield _row(surface.name, "SplitSquare", size), split_square(surface, size)
            yield _row(surface.name, "Sawtooth", size), sawtooth(surface, size)
        yield _row("sphere", "UV", size), uv_sphere(size, size)
        yield _row("cylinder", "UV", size), uv_cylinder(size, size)


def _row(surface: str, mesh: str, size: int) -> Row:
    return {"surface": surface, "mesh": mesh, "size": size}


def mesh_errors(made: Discretized, names: Names) -> Iterator[Row]:
    """Yield mean and largest error of every method over inner vertices, from exact normals, and how many failed."""
    samples = SampledSurface(made.vertices, made.faces)
    for kind in names:
        normals = made.exact.normals if kind == "curvature" else None
        for name, quantity, values in estimates(kind, names[kind], samples, normals=normals):
            errors = distance(values, truth(quantity, made.exact))[made.inner]
            known = errors[np.isfinite(errors)] if np.isfinite(errors).any() else np.array([np.nan])
            row = {"method": name, "quantity": quantity, "mean error": known.mean(), "max error": known.max()}
            yield row | {"failed": int((~np.isfinite(errors)).sum())}


GRIDS = {"2.5k": (84, 30), "10k": (168, 60), "41k": (340, 120)}
WIDE = 3


class Case(NamedTuple):
    """A mesh on which other programs were measured too; noise is in the unit, normal, in every coordinate."""

    size: str
    irregular: bool = True
    noise: float = 0.0
    unit: str = "edge"
    shape: str = "torus"

    @property
    def title(self) -> str:
        """Title of the column."""
        noise = f", {100 * self.noise:g} %" + (" of diagonal" if self.unit == "diagonal" else "") if self.noise else ""
        shape = "ellipsoid " if self.shape == "ellipsoid" else ""
        return f"{shape}{'' if self.irregular else 'regular '}{self.size}{noise}"


CASES = (
    *(Case(size, irregular=False) for size in GRIDS),
    *(Case(size, noise=noise) for noise in (0.0, 0.01, 0.1) for size in GRIDS),
    Case("10k", noise=0.01, unit="diagonal"),
    *(Case("10k", noise=noise, shape="ellipsoid") for noise in (0.0, 0.1)),
)


def case_errors(case: Case, names: Names) -> Iterator[Row]:
    """Yield relative L2 errors of H and K, mean angles of normals in degrees, and times; also with three rings."""
    form, size = (ellipsoid, (100, 100)) if case.shape == "ellipsoid" else (torus, GRIDS[case.size])
    made = form(*size, irregular=case.irregular)
    mesh = noisy(made.mesh, case.noise, unit=case.unit, rng=1)
    count = len(mesh.vertices)
    for kind, name in [(kind, name) for kind, methods in names.items() for name in methods]:
        method = REGISTRIES[kind][name]
        fixed = method.own_scale or method.needs_faces
        for suffix, around in [("", None)] if fixed else [("", None), (f", {WIDE} rings", rings(WIDE))]:
            fresh = SampledSurface(mesh.vertices, mesh.faces)  # whose rings are not cached: they are part of the time
            start = time.perf_counter()
            found = list(estimates(kind, [name], fresh, around=around))
            spent = 1e6 * (time.perf_counter() - start) / count
            for _, quantity, values in found:
                exact = truth(quantity, made.exact)
                errors = distance(values, exact)
                known = np.isfinite(errors)
                off = mean_angle(errors[known]) if quantity == "N" else relative(values[known], exact[known])
                row = {"case": case.title, "method": name + suffix, "microseconds": spent, "vertices": count}
                yield row | {"failed": int((~known).sum()), "quantity": quantity, "error": off}


def relative(found: Array, exact: Array) -> float:
    """Return the relative L2 error."""
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact)) if len(exact) else np.nan


def mean_angle(chords: Array) -> float:
    """Return the mean angle of unit vectors at these distances, in degrees."""
    return float(np.degrees(2 * np.arcsin(np.clip(chords / 2, 0, 1))).mean()) if len(chords) else np.nan


def border_errors(names: Names) -> Iterator[Row]:
    """Yield relative errors of H (root mean square) on half a torus, inside and at the border, by the noise."""
    ring = torus(*GRIDS["10k"], irregular=True)
    half = cut(ring, ring.vertices[:, 0] > 0)
    size = np.sqrt((half.exact.mean**2).mean())
    for amount in (0.0, 0.01, 0.1):
        mesh = noisy(half.mesh, amount, rng=1)
        for name, quantity, values in estimates(
            "curvature", names["curvature"], SampledSurface(mesh.vertices, mesh.faces)
        ):
            if quantity == "H":
                square, known = ((values - half.exact.mean) / size) ** 2, np.isfinite(values)
                inside, border = (square[part & known] for part in (half.inner, ~half.inner))
                errors = [float(np.sqrt(part.mean())) if len(part) else np.nan for part in (inside, border)]
                row = {"method": name, "noise": amount, "inside": errors[0], "border": errors[1]}
                yield row | {"failed at the border": float((~known[~half.inner]).mean())}
