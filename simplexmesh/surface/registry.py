"""Registry entries of the estimators, and what the functions that select among them share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import TopologyError, warn
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.welding import distinct_positions
from simplexmesh.mesh.manifold import matched, to_flip
from simplexmesh.orientation._kernels_consistency import clashing_edges
from simplexmesh.orientation.propagation import LEAST_AGREEMENT, agreement
from simplexmesh.surface.neighborhoods import Ball, Nearest, Neighborhood, Neighborhoods, Rings, rings
from simplexmesh.surface.reasons import EXPLANATIONS, FEW, OPEN
from simplexmesh.surface.sampled_surface import SampledSurface

LEAST_INWARD = 0.02
"""An open surface is reported as inward only if its volume is below minus this share of its area times its diagonal."""


class Estimates(NamedTuple):
    """Result of a curvature estimator, one row per center; rows where `reasons` is not 0 are undefined."""

    k1: Array
    k2: Array
    mean: Array
    gauss: Array
    reasons: NDArray[np.uint8]
    d1: Array | None = None
    normals: Array | None = None
    error: Array | None = None
    scale: Array | None = None


class Normals(NamedTuple):
    """Result of a normal estimator: (c, 3) unit vectors, zero where `reasons` is not 0."""

    normals: Array
    reasons: NDArray[np.uint8]


@dataclass(frozen=True)
class Method:
    """An estimator and what it needs."""

    estimate: Callable[..., Any]  # of samples, neighborhoods, normals and options
    options: Mapping[str, Any] = field(default_factory=dict)  # with their defaults
    fixed: Mapping[str, Any] = field(default_factory=dict)  # arguments that callers cannot change
    normals: str | None = "area"  # default method of the initial normals on meshes; None if it needs none
    orients: bool = False  # needs no initial normals but orients its result by given ones
    needs_faces: bool = False  # reads the ordered ring of triangles, which clouds do not have
    own_scale: bool = False  # chooses its neighborhoods itself


def chosen(
    name: Any, methods: Mapping[str, Method], options: Mapping[str, Any], called: str = "method"
) -> tuple[Method, dict[str, Any]]:
    """Return a method and its options with defaults; `called` is the argument that named it, for messages."""
    method = methods[checks.choice(called, name, sorted(methods))]
    for option in options:
        if option not in method.options:
            known = ", ".join(sorted(method.options)) or "none"
            raise TypeError(f"method {name!r} has no option {option!r}; its options: {known}")
    return method, {**method.fixed, **method.options, **options}


def neighborhoods_for(
    name: str,
    method: Method,
    samples: SampledSurface,
    neighborhood: Neighborhood | None,
    normals: Any,
    vertices: ArrayLike | None,
) -> Neighborhoods:
    """Return the neighborhoods for a method; without members if it chooses its own."""
    if normals is not None and method.normals is None and not method.orients:
        raise TypeError(f"normals must be left out: method {name!r} starts from none")
    if method.own_scale:
        if neighborhood is not None:
            raise TypeError(f"neighborhood must be left out: method {name!r} chooses its own")
        n = len(samples.points)
        centers = np.arange(n) if vertices is None else checks.selection("at", vertices, n)
        offsets = np.zeros(len(centers) + 1, np.int64)
        return Neighborhoods(centers, offsets, np.zeros(0, np.int64), np.zeros(len(centers), bool))
    ignored = isinstance(neighborhood, Rings | Ball | Nearest) and neighborhood != rings(1)
    if ignored and method.needs_faces and samples.is_connected:
        raise TypeError(f"neighborhood must be left out: method {name!r} takes the faces around each vertex")
    return samples.around(rings(1) if neighborhood is None else neighborhood, vertices)


def warn_of_failures(what: str, reasons: NDArray[np.uint8], samples: SampledSurface, around: Neighborhoods) -> None:
    """Warn once how many rows have no estimate and why, with advice if vertices are duplicated."""
    counts = np.bincount(reasons, minlength=len(EXPLANATIONS)).tolist()
    if failed := sum(counts[1:]):
        why = ", ".join(f"{count:,} {said}" for count, said in zip(counts, EXPLANATIONS, strict=True) if said and count)
        advice = _advice_on_duplicates(samples, around.centers[(reasons == FEW) | (reasons == OPEN)])
        warn(f"{what} could not be estimated at {failed:,} of {len(reasons):,} vertices: {why}{advice}")


def warn_of_clashing_faces(samples: SampledSurface, reasons: NDArray[np.uint8], normals: Any) -> None:
    """Warn if triangles or a cloud's own normals disagree on which side is outward, and some row has not failed."""
    if reasons.all() or not (normals is None or isinstance(normals, str)):
        return
    if samples.faces is None:
        own = samples.outward if samples.links is None else None
        if own is not None and (agree := agreement(samples.points, own)) <= LEAST_AGREEMENT:
            warn(
                f"normals of neighboring points contradict each other ({1 - agree:.0%}), and so do signs of curvature: "
                "PointCloud(points) without them gets normals that agree"
            )
        return
    if count := int(clashing_edges(*samples.wedges)):
        edges = f"{count:,} edge{'s' if count > 1 else ''}"
        faces, mates, _ = matched(samples.faces)
        try:
            to_flip(faces, mates)
            advice = "orient them with TriangleMesh(vertices, faces).oriented()"
        except TopologyError:
            advice = "the surface is one-sided, and has no right ones everywhere"
        warn(
            f"triangles disagree on which side is outward across {edges}, so that normals and signs of curvature are "
            f"wrong nearby: {advice}"
        )


def warn_of_inward_faces(samples: SampledSurface, normals: Any) -> None:
    """Warn if triangles seem to be oriented inward as a whole, unless the caller gives normals."""
    if samples.faces is None or not (normals is None or isinstance(normals, str)):
        return
    surface = TriangleMesh(samples.points, samples.faces)
    least = LEAST_INWARD * surface.area * surface.diagonal
    if (volume := surface.volume) < -least or (volume < 0 and surface.is_closed):
        warn(
            "the faces are oriented inward, so that a bump has negative curvature: reverse them with "
            "TriangleMesh(vertices, faces[:, ::-1]), or with --flip of the command"
        )


def _advice_on_duplicates(samples: SampledSurface, unconnected: Indices) -> str:
    """Return advice if vertices lack neighbors because of duplicate vertices, else an empty string."""
    if samples.faces is None or not len(unconnected):
        return ""
    _, position = distinct_positions(samples.points, 0.0)
    copies = int(np.count_nonzero(np.bincount(position)[position[unconnected]] > 1))
    if not copies:
        return ""
    separate = np.bincount(samples.faces.ravel()).max() == 1
    problem = "the triangles share no vertices" if separate else f"{copies:,} of these lie where other vertices do"
    return f"; {problem}, merge them with TriangleMesh(vertices, faces).welded()"
