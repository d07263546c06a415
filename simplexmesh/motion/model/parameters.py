"""Per-vertex parameters of a motion, checked: numbers or arrays from the caller, or arrays stored on the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.forces import CONSTRAINTS, Force

MOST_RIGID = 1000
"""Largest radius, in edges, over which curvature is averaged."""


def given_or_stored(given: Any, mesh: SimplexMesh, name: str, default: Any) -> Any:
    """Return the caller's value, else the mesh's data array of this name, else the default."""
    return given if given is not None else mesh.data.get(name, default)


def per_vertex(name: str, value: Any, count: int, low: float = -np.inf, high: float = np.inf) -> Array:
    """Return a fresh (count,) array from a number or an array, checked to lie within bounds."""
    if np.ndim(value) == 0:
        return np.full(count, checks.number(name, value, low, high))
    out = checks.array(name, value, (count,), float).astype(float)
    if len(out) and not (low <= out.min() and out.max() <= high):
        wrong = int(np.argmax((out < low) | (out > high)))
        raise ValueError(f"{name} must be between {low:g} and {high:g}; {name}[{wrong}] is {out[wrong]:g}")
    return out


def whole_per_vertex(name: str, value: Any, count: int, low: int, high: int) -> Indices:
    """Return a fresh (count,) array of integers from a number or an array, checked to lie within bounds."""
    out = per_vertex(name, value, count, low, high)
    if (out % 1).any():
        raise TypeError(f"{name} must be a whole number of edges, not {out[np.argmax(out % 1 > 0)]:g}")
    return out.astype(np.int64)


def references(
    mesh: SimplexMesh, constraint: NDArray[np.int8], *, metric: Any, curvature: Any, reference: SimplexMesh | None
) -> tuple[Array, Array, Array]:
    """Return the reference metric parameters (n, 3), simplex angles (n,) and curvatures (n,) of the constraints."""
    n = mesh.n_vertices
    elastic = constraint == CONSTRAINTS.index("shape")
    wanted = given_or_stored(metric, mesh, "metric", None)
    parameters = np.full((n, 3), 1 / 3) if wanted is None else checks.array("metric", wanted, (n, 3)).copy()
    if not np.allclose(parameters.sum(axis=1), 1, atol=1e-6):
        row = int(np.abs(parameters.sum(axis=1) - 1).argmax())
        raise ValueError(f"metric must have rows that sum to 1; row {row} sums to {parameters[row].sum():g}")
    angle = np.zeros(n)
    if reference is not None:
        checks.instance("reference", reference, SimplexMesh)
        if not elastic.any():
            raise ValueError("reference applies to vertices of constraint 'shape', but there are none")
        if not np.array_equal(reference.connectivity.twin, mesh.connectivity.twin):
            raise ValueError("reference must have the same connectivity as mesh")
        angle = np.array(reference.simplex_angle)
        if metric is None:
            parameters[elastic] = reference.metric[elastic]
    elif "reference_angle" in mesh.data:
        angle = checks.array("reference_angle", mesh.data["reference_angle"], (n,)).copy()
    elif elastic.any():
        raise ValueError("constraint 'shape' needs a reference mesh, or data['reference_angle'] on the mesh")
    prescribed = bool((constraint == CONSTRAINTS.index("curvature")).any())
    if prescribed and curvature is None:
        raise ValueError("constraint 'curvature' needs the argument curvature")
    if curvature is not None and not prescribed:
        raise ValueError("curvature applies to vertices of constraint 'curvature', but there are none")
    return parameters, angle, per_vertex("curvature", 0.0 if curvature is None else curvature, n)


def constraint_codes(constraint: str | ArrayLike, count: int) -> NDArray[np.int8]:
    """Return one code per vertex, the index in `CONSTRAINTS`, from a name, an array of names or of codes."""
    names = np.asarray(constraint)
    if names.dtype.kind == "O" and all(isinstance(name, str) for name in names.ravel()):
        names = names.astype(str)
    if names.dtype.kind in "US":
        for name in np.unique(names):
            checks.choice("constraint", str(name), CONSTRAINTS)
        if names.shape not in ((), (count,)):
            raise ValueError(f"constraint must have shape ({count},), not {names.shape}")
        known, place = np.unique(names, return_inverse=True)
        codes = np.array([CONSTRAINTS.index(str(name)) for name in known])[np.broadcast_to(place.ravel(), (count,))]
    else:
        codes = checks.indices("constraint", names, (count,), len(CONSTRAINTS))
    return np.array(codes, dtype=np.int8)


def as_forces(forces: Any) -> tuple[Force, ...]:
    """Return one force or a sequence of forces as a tuple, checked."""
    if callable(forces):
        return (forces,)
    try:
        out = tuple(forces)
    except TypeError:
        raise TypeError(
            f"forces must be a function of a Frame or a sequence of them, not {type(forces).__name__}"
        ) from None
    for k, force in enumerate(out):
        if not callable(force):
            raise TypeError(f"forces must be functions of a Frame; forces[{k}] is a {type(force).__name__}")
    return out
