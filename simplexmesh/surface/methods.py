"""Estimators by name: where each lives and what it needs, so that one door serves them all."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.data.welding import distinct_positions
from simplexmesh.errors import warn
from simplexmesh.surface.neighborhoods import Ball, Nearest, Neighborhood, Neighborhoods, Rings, rings
from simplexmesh.surface.reasons import FEW, OPEN, SAID
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


class Estimates(NamedTuple):
    """What a curvature estimator found, one row a center; rows where `reasons` is not 0 hold nothing of use."""

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
    """What a normal estimator found: (c, 3) unit vectors, zero where `reasons` is not 0."""

    normals: Array
    reasons: NDArray[np.uint8]


class Estimator(Protocol):
    """The function `estimate` of each estimator's file."""

    def __call__(self, samples: Samples, around: Neighborhoods, normals: Any, **options: Any) -> Any:
        """Return what was found around each center."""
        ...


@dataclass(frozen=True)
class Method:
    """An estimator and what it needs.

    Attributes
    ----------
    module : str
        Where its function `estimate` lives.
    options : mapping
        Names it understands beyond those all methods share, each with its default.
    fixed : mapping
        What its name says already to a function that serves several methods; no caller can change that.
    normals : str or None
        The normals it starts from on meshes where the caller names none; None: it needs none.
    turned : bool
        It needs none, and yet turns its answer to the side where given ones look.
    needs_faces : bool
        It reads the ordered ring of triangles, which clouds do not have.
    own_scale : bool
        It chooses its neighborhoods itself.
    """

    module: str
    options: Mapping[str, Any] = field(default_factory=dict)
    fixed: Mapping[str, Any] = field(default_factory=dict)
    normals: str | None = "area"
    turned: bool = False
    needs_faces: bool = False
    own_scale: bool = False

    @property
    def estimate(self) -> Estimator:
        """The estimator's function, loaded when first needed."""
        found: Estimator = importlib.import_module(f"simplexmesh.surface.{self.module}").estimate
        return found


def chosen(
    name: Any, methods: Mapping[str, Method], options: Mapping[str, Any], called: str = "method"
) -> tuple[Method, dict[str, Any]]:
    """Return the method of that name with its options, defaults filled in; `called` as callers call it.

    Raises
    ------
    ValueError
        There is no such method.
    TypeError
        It does not understand an option.
    """
    method = methods[_check.choice(called, name, sorted(methods))]
    for option in options:
        if option not in method.options:
            known = ", ".join(sorted(method.options)) or "none"
            raise TypeError(f"method {name!r} has no option {option!r}; its options: {known}")
    return method, {**method.fixed, **method.options, **options}


def around_of(
    name: str,
    method: Method,
    samples: Samples,
    neighborhood: Neighborhood | None,
    normals: Any,
    vertices: ArrayLike | None,
) -> Neighborhoods:
    """Return the neighborhoods a method sees; those that choose their own get the centers alone.

    Raises
    ------
    TypeError
        Normals or neighborhoods were given that the method would not look at.
    """
    if normals is not None and method.normals is None and not method.turned:
        raise TypeError(f"normals must be left out: method {name!r} starts from none")
    if method.own_scale:
        if neighborhood is not None:
            raise TypeError(f"neighborhood must be left out: method {name!r} chooses its own")
        n = len(samples.points)
        centers = np.arange(n) if vertices is None else _check.selection("vertices", vertices, n)
        none = np.zeros(len(centers) + 1, np.int64)
        return Neighborhoods(centers, none, np.zeros(0, np.int64), np.zeros(len(centers), bool))
    other = isinstance(neighborhood, Rings | Ball | Nearest) and neighborhood != rings(1)
    if other and method.needs_faces and samples.is_connected:
        raise TypeError(f"neighborhood must be left out: method {name!r} takes the faces around each vertex")
    return samples.around(rings(1) if neighborhood is None else neighborhood, vertices)


def warn_of_failures(what: str, reasons: NDArray[np.uint8], samples: Samples, around: Neighborhoods) -> None:
    """Say once how many rows have no estimate, why, and what to do where corners are stored apart."""
    counts = np.bincount(reasons, minlength=len(SAID))
    if failed := int(counts[1:].sum()):
        why = ", ".join(f"{counts[code]:,} {SAID[code]}" for code in range(1, len(SAID)) if counts[code])
        alone = around.centers[(reasons == FEW) | (reasons == OPEN)]
        warn(f"{what} could not be estimated at {failed:,} of {len(reasons):,} vertices: {why}{_apart(samples, alone)}")


def _apart(samples: Samples, alone: NDArray[np.int64]) -> str:
    """Return what to say where vertices lack neighbors because others lie at the same place; nothing elsewhere."""
    if samples.faces is None or not len(alone):
        return ""
    _, place = distinct_positions(samples.points, 0.0)
    copies = int(np.count_nonzero(np.bincount(place)[place[alone]] > 1))
    if not copies:
        return ""
    soup = np.bincount(samples.faces.ravel()).max() == 1
    said = "the triangles share no vertices" if soup else f"{copies:,} of these lie where other vertices do"
    return f"; {said}, merge them with TriangleMesh(vertices, faces).welded()"
