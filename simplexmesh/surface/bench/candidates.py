"""The methods compared: all that are registered, called through the public functions."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.errors import SimplexMeshWarning
from simplexmesh.surface.curvature import estimate as curvatures
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.methods import Method
from simplexmesh.surface.neighborhoods import Neighborhood, Neighborhoods
from simplexmesh.surface.normals import estimate as normal_estimates
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]

REGISTRIES = {"curvature": curvatures.METHODS, "normals": normal_estimates.METHODS}


class RefusedError(Exception):
    """A method does not accept its input; the message says why."""


def named(wanted: str) -> dict[str, list[str]]:
    """Return the selected methods of each kind.

    Parameters
    ----------
    wanted : str
        "all", or names separated by commas; a name of both kinds selects both.

    Raises
    ------
    ValueError
        An unknown method.

    Examples
    --------
    >>> named("sine,area")
    {'curvature': ['sine'], 'normals': ['area']}
    """
    if wanted == "all":
        return {kind: list(registry) for kind, registry in REGISTRIES.items()}
    names = chosen("methods", wanted, {name for registry in REGISTRIES.values() for name in registry})
    return {kind: [name for name in registry if name in names] for kind, registry in REGISTRIES.items()}


def chosen(option: str, wanted: str, known: Sequence[str] | set[str]) -> list[str]:
    """Return the names in a comma-separated list, or all that are known.

    Raises
    ------
    ValueError
        An unknown name, or none.
    """
    if wanted == "all":
        return list(known)
    names = [name.strip() for name in wanted.split(",") if name.strip()]
    if not names:
        raise ValueError(f"--{option} must name some of {', '.join(sorted(known))}, or be all")
    for name in names:
        if name not in known:
            raise ValueError(f"--{option} must be all or among {', '.join(sorted(known))}, not {name!r}")
    return names


def method(kind: str, name: str) -> Method:
    """Return a registered method."""
    return REGISTRIES[kind][name]


def curvature_of(
    name: str,
    samples: Samples,
    *,
    normals: Array | None = None,
    around: Neighborhood | None = None,
    options: Mapping[str, Any] | None = None,
) -> Curvature:
    """Return the curvature by a method, for the rows of `around` or all vertices, without warnings.

    Normals are only passed to methods that start from them and do not choose their scale.

    Raises
    ------
    RefusedError
        The method does not accept this input.
    """
    registered = method("curvature", name)
    asked = _asked(registered, around) | dict(options or {})
    if normals is not None and registered.normals is not None and not registered.own_scale:
        asked["normals"] = normals
    return _answer(curvatures.curvature, samples, name, asked)


def normals_of(
    name: str, samples: Samples, *, around: Neighborhood | None = None, normals: Array | None = None
) -> Array:
    """Return the normals by a method, NaN where it has none, without warnings.

    `normals` are the initial ones, for methods that use them.

    Raises
    ------
    RefusedError
        The method does not accept this input.
    """
    registered = method("normals", name)
    asked = _asked(registered, around)
    if normals is not None and registered.normals is not None and not registered.own_scale:
        asked["normals"] = normals
    found = _answer(normal_estimates.vertex_normals, samples, name, asked)
    return np.where((found != 0).any(axis=1)[:, None], found, np.nan)


def _asked(registered: Method, around: Neighborhood | None) -> dict[str, Any]:
    """Return the keyword for the neighborhoods, or for the vertices if the method does not take neighborhoods."""
    if around is None:
        return {}
    if registered.own_scale or registered.needs_faces:
        return {"vertices": around.centers} if isinstance(around, Neighborhoods) else {}
    return {"neighborhood": around}


def _answer(function: Callable[..., Any], samples: Samples, name: str, asked: dict[str, Any]) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimplexMeshWarning)
        try:
            return function(samples, name, **asked)
        except (ValueError, TypeError) as problem:
            raise RefusedError(str(problem)) from None
