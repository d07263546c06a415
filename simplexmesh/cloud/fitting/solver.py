"""Least squares of exact distances by Levenberg-Marquardt on local charts (Chaperon 2002, 4.2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from simplexmesh.cloud.fitting import _kernels
from simplexmesh.cloud.fitting.taper import Taper
from simplexmesh.cloud.primitives import Circle, Cone, Line, Primitive
from simplexmesh.numerics.circle_fits import circle_residuals

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Equations = tuple[Array, Array, float]
"""Normal matrix (p, p), downhill vector (p,) and the cost."""

CHUNK = 65536
"""Points whose derivatives are held at once."""

KERNEL = {
    "plane": _kernels.PLANE,
    "sphere": _kernels.SPHERE,
    "cylinder": _kernels.CYLINDER,
    "taper": _kernels.TAPER,
    "cone": _kernels.CONE,
    "torus": _kernels.TORUS,
}
"""Kinds with compiled normal equations."""

NO_WEIGHTS = np.zeros(0)
"""All weights are 1."""

START, LEAST, MOST = 1e-3, 1e-9, 1e10
"""Damping of the first step, and its limits: above the last one no step goes down (4.2.1)."""

TOLERANCE = 1e-10
"""Share of the cost that a last step promises to take off."""

BEHIND_APEX = slice(2, 5)
"""The shifts of a cone's apex among its parameters."""


class Fitted(Protocol):
    """What can be fitted: distances, their derivatives in a local chart, and a step in that."""

    def distance(self, points: Array) -> Array: ...  # noqa: D102

    def derivatives(self, points: Array) -> Array: ...  # noqa: D102

    def stepped(self, step: Array) -> Self: ...  # noqa: D102


class Summed(Protocol):
    """What can be fitted and has its own kernel."""

    def normal_equations(self, points: Array, weights: Array | None, loss_scale: float | None) -> Equations: ...  # noqa: D102

    def stepped(self, step: Array) -> Self: ...  # noqa: D102


Model = TypeVar("Model", bound=Fitted | Summed)


def solve(
    primitive: Model,
    points: Array,
    *,
    weights: Array | None = None,
    fixed: Mask | None = None,
    loss_scale: float | None = None,
    iterations: int = 30,
    tolerance: float = TOLERANCE,
) -> tuple[Model, Array]:
    """Return a primitive moved to the least sum of squared distances of points (n, 3), and the normal matrix there.

    Nothing is checked. Parameters (p,) that are `fixed` keep their values. With a `loss_scale` s the sum is that of
    d^2 / (1 + (d / s)^2), of Geman and McClure. The matrix (p, p) is that of the returned primitive's chart, whose
    point is the one nearest to the middle of the points where it has a choice.
    """
    start: Any = primitive
    if fixed is None and _is_free(primitive):
        start = start.centered(points)
    taper = _taper(start, points, fixed)  # its parameters are those of the cone but for the fifth, which is not held
    options = (weights, loss_scale)
    found = _descended(
        taper or start, lambda at: _equations(at, points, *options), fixed, iterations, tolerance, points
    )
    if taper is not None:
        found = found.cone()
    return found, _equations(found, points, *options)[0]


def normal_matrix(primitive: Any, points: Array, weights: Array | None = None) -> Array:
    """Return the normal matrix (p, p) of a primitive's distances of points (n, 3)."""
    return _equations(primitive, points, weights, None)[0]


def linearized(primitive: Any, points: Array) -> tuple[Array, Array]:
    """Return residuals (m,) of points (n, 3) and their derivatives (m, p): of a circle, two for each point."""
    if isinstance(primitive, Circle):
        residual, rows = circle_residuals(points, primitive.center, primitive.normal, primitive.radius)
        rows = np.concatenate([rows[..., 3:5], rows[..., :3] @ primitive.frame.T, rows[..., 5:]], axis=-1)
        return residual.ravel(), rows.reshape(-1, primitive.n_parameters)
    if _is_free(primitive):
        return cast(tuple[Array, Array], primitive._linearized(points))
    return primitive.distance(points), primitive.derivatives(points)


def _is_free(primitive: Any) -> bool:
    """Return whether a primitive moves in the chart of its kind, not in one of fewer parameters."""
    return isinstance(primitive, Primitive) and type(primitive).derivatives is Primitive.derivatives


def _taper(primitive: Any, points: Array, fixed: Mask | None) -> Taper | None:
    """Return a cone by a place near its points, unless its apex is held."""
    if not isinstance(primitive, Cone) or (fixed is not None and fixed[BEHIND_APEX].any()):
        return None
    return Taper.of(primitive, points)


def _equations(primitive: Any, points: Array, weights: Array | None, loss_scale: float | None) -> Equations:
    """Return the normal equations of the distances; without a kernel a chunk at a time."""
    if hasattr(primitive, "normal_equations"):
        return cast(Equations, primitive.normal_equations(points, weights, loss_scale))
    if isinstance(primitive, Line):
        return _line_equations(primitive, points, weights, loss_scale)
    if _is_free(primitive) and primitive.kind in KERNEL:
        return _by_kernel(primitive, KERNEL[primitive.kind], points, weights, loss_scale)
    if isinstance(primitive, Circle) and loss_scale is None:  # distances in its plane and from that
        parts = [_by_kernel(primitive, KERNEL[kind], points, weights, None) for kind in ("cylinder", "plane")]
        return tuple(a + b for a, b in zip(*parts, strict=True))
    total: Any = None
    for start in range(0, len(points), CHUNK):
        at = slice(start, start + CHUNK)
        residual, rows = linearized(primitive, points[at])
        weight = None if weights is None else weights[at]
        part = _normal_equations(residual, rows, weight, loss_scale, len(points[at]))
        total = part if total is None else tuple(a + b for a, b in zip(total, part, strict=True))
    return cast(Equations, total)


def _line_equations(line: Line, points: Array, weights: Array | None, loss_scale: float | None) -> Equations:
    """Return the normal equations of the places across a line, which a tilt shifts by the place along it."""
    local = (points - line.point) @ line.frame.T
    square = local[:, 0] ** 2 + local[:, 1] ** 2
    given = np.ones(len(points)) if weights is None else weights
    less = np.ones(len(points)) if loss_scale is None else 1 / (1 + square / loss_scale**2)
    rows = np.column_stack([-local[:, 2], -np.ones(len(points))])
    heavy = rows * (given * less**2)[:, None]
    matrix: Array = np.kron(heavy.T @ rows, np.eye(2)).astype(float)
    return matrix, -(heavy.T @ local[:, :2]).ravel(), float((given * less) @ square)


def _by_kernel(
    primitive: Primitive, kernel: int, points: Array, weights: Array | None, loss_scale: float | None
) -> Equations:
    """Return the normal equations of distances from a profile, in the chart of a kind."""
    origin, _ = primitive._pose
    moves, p = np.full(5, -1), primitive.n_parameters
    moves[list(primitive._moves)] = range(len(primitive._moves))
    matrix, downhill = np.zeros((p, p)), np.zeros(p)
    cost = _kernels.normal_equations(
        kernel,
        moves,
        origin,
        primitive.frame,
        np.array(primitive._shape),
        np.ascontiguousarray(points),
        NO_WEIGHTS if weights is None else weights,
        np.inf if loss_scale is None else loss_scale,
        matrix,
        downhill,
    )
    return matrix, downhill, cost


def _normal_equations(
    residual: Array, rows: Array, weight: Array | None, loss_scale: float | None, n: int
) -> Equations:
    """Return the normal equations of residuals (m,) of n points and their derivatives (m, p)."""
    if weight is None and loss_scale is None:
        return rows.T @ rows, -(rows.T @ residual), float(residual @ residual)
    square = (residual.reshape(n, -1) ** 2).sum(axis=1)
    given = np.ones(n) if weight is None else weight
    less = np.ones(n) if loss_scale is None else 1 / (1 + square / loss_scale**2)
    heavy = rows * np.repeat(given * less**2, len(residual) // n)[:, None]
    return heavy.T @ rows, -(heavy.T @ residual), float((given * less) @ square)


def _descended(
    start: Any,
    equations: Callable[[Any], Equations],
    fixed: Mask | None,
    iterations: int,
    tolerance: float,
    points: Array,
) -> Any:
    """Return where damped Gauss-Newton steps lead; steps to what is no primitive are refused as those that go up."""
    rounding = len(points) * (np.finfo(float).eps * float(np.abs(points).max())) ** 2
    here, (matrix, downhill, cost) = start, equations(start)
    damping = START
    for _ in range(iterations):
        step = _step(matrix, downhill, damping, fixed)
        if step @ downhill <= tolerance * cost + rounding or damping > MOST:
            break
        try:
            there = here.stepped(step)
        except ValueError:
            damping *= 10
            continue
        trial = equations(there)
        if trial[2] < cost:
            here, (matrix, downhill, cost) = there, trial
            damping = max(damping / 10, LEAST)
        else:
            damping *= 10
    return here


def _step(matrix: Array, downhill: Array, damping: float, fixed: Mask | None) -> Array:
    """Return the solution of the normal equations with a diagonal that is larger by the damping (Marquardt 1963)."""
    scale = np.sqrt(np.diagonal(matrix))
    free = scale > 0 if fixed is None else (scale > 0) & ~fixed
    step = np.zeros(len(downhill))
    scale = scale[free]
    unit = matrix[np.ix_(free, free)] / np.outer(scale, scale)
    unit.flat[:: len(scale) + 1] += damping
    step[free] = np.linalg.solve(unit, downhill[free] / scale) / scale
    return step
