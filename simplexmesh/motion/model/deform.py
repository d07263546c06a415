"""The deformable model: a simplex mesh that moves under internal, data and user-supplied forces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import DivergedError
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.contours import numbered
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model import _kernels_step
from simplexmesh.motion.model._kernels_step import (
    ANGLE,
    CURVATURE,
    FREE,
    MEAN_CURVATURE,
    ORIENTATION,
    SHAPE,
    Forces,
    Frames,
    Moving,
    Step,
    Wanted,
)
from simplexmesh.motion.model.averages import FLAT, Averages, adapted_metric, curvedness
from simplexmesh.motion.model.conditions import CONTINUITIES, Condition, conditions_on
from simplexmesh.motion.model.contours import BorderAttraction, Contours, wide_border
from simplexmesh.motion.model.forces import CONSTRAINTS, Force, Frame, total_displacement
from simplexmesh.motion.model.parameters import (
    MOST_RIGID,
    as_forces,
    constraint_codes,
    given_or_stored,
    per_vertex,
    references,
    whole_per_vertex,
)
from simplexmesh.motion.model.state import Confines, Release, State, mean_edge, warn_of_end
from simplexmesh.motion.targets.protocol import Target, check_target, checked_reach, read_only, target_gaps

MAX_STEP = 10.0
"""In diagonals of the first mesh: a vertex that moves farther in one iteration has diverged."""


class DeformableModel:
    """A deformable simplex mesh (Delingette 1994, chapters 4 and 5, equations 4.42, 5.2 and 5.3).

    One iteration moves every vertex by ``(1 - damping) (P - P_previous) + alpha (P* - P) + beta gap n``: inertia, the
    internal force, and the data force along the normal. Safeguards hold: the height of P* above its neighbors is at
    most the root mean square distance to them, and a step at most half of that; a vertex whose normal is opposed to its
    neighbors' gets no data force, and with the part without data around it no curvature, so that it unfolds or
    contracts until it finds data; no vertex leaves the start and the data (a target's `bounds`) by 5 % of their
    diagonal or two edges, unless `forces` move it or contours are pinned.

    Parameters
    ----------
    mesh : SimplexMesh
        The start. Its data arrays `metric`, `rigidity`, `constraint` and `reference_angle` are defaults here. The
        curvature of vertices on creases, marked by its data array `crease`, is in no average; `free` is their default.
    target : Target, optional
        The data that attracts the mesh; see `simplexmesh.targets`. Without it only the internal force and `forces` act.
    rigidity : int or (n,) array of int
        Radius, in edges, over which the constraints `angle` and `mean_curvature` average: 1 (fine) to about 10 (stiff).
    alpha, beta : float or (n,) array of float
        Weights of the internal force (0 to 0.5) and of the data force (0 to 1).
    damping : float or (n,) array of float
        0.001 to 1; with 1 there is no inertia.
    reach : float, optional
        Data farther than this, in the mesh's unit, has no effect; may be infinite. Default: 20 % of the diagonal.
    constraint : str or (n,) array of str, optional
        One of `simplexmesh.motion.model.forces.CONSTRAINTS`; default `mean_curvature`.
    metric : (n, 3) array of float, optional
        Reference metric parameters, rows summing to 1; default 1/3 each, which spaces vertices evenly.
    curvature : float or (n,) array of float, optional
        The mean curvature prescribed by the constraint `curvature`, positive on a sphere.
    reference : SimplexMesh, optional
        The shape that the constraint `shape` restores: same connectivity, any position and scale.
    velocity : (n, 3) array of float, optional
        The step of each vertex before the first, as `velocity` of another model that this one continues. Default: 0.
    adaptation : float
        Strength, 0 (never) to 1, of adapting metric parameters to curvature every 10 iterations; 0.25 is strong.
    seeking : float
        Weight, 0 to 1, with which vertices on holes are attracted to the border of the data, if the target has one.
    forces : callable or sequence of callables
        Functions from a `Frame` to displacements (n, 3), added in every iteration.
    contours : Condition or sequence of Condition
        What `pinned`, `crease` and `smooth` prescribe of contours. Those without a name become `contour_1` and so on of
        `mesh`.

    Raises
    ------
    ValueError, TypeError
        For an argument of the wrong shape, type or range, two units, and a mesh so large or small that areas over- or
        underflow.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ball = sm.sphere(6)
    >>> rough = ball.moved(ball.vertices + 0.02 * np.random.default_rng(0).normal(size=ball.vertices.shape))
    >>> model = DeformableModel(rough, rigidity=4)
    >>> for state in model.run(100):
    ...     pass
    >>> bool(model.mesh.sphere_curvature.std() < 0.1 * rough.sphere_curvature.std())
    True
    """

    def __init__(
        self,
        mesh: SimplexMesh,
        target: Target | None = None,
        *,
        rigidity: int | ArrayLike | None = None,
        alpha: float | ArrayLike = 0.4,
        beta: float | ArrayLike = 0.2,
        damping: float | ArrayLike = 0.6,
        reach: float | None = None,
        constraint: str | ArrayLike | None = None,
        metric: ArrayLike | None = None,
        curvature: float | ArrayLike | None = None,
        reference: SimplexMesh | None = None,
        velocity: ArrayLike | None = None,
        adaptation: float = 0.0,
        seeking: float = 0.8,
        forces: Force | Sequence[Force] = (),
        contours: Condition | Sequence[Condition] = (),
    ) -> None:
        checks.instance("mesh", mesh, SimplexMesh)
        checks.size("mesh", mesh.bounds)
        if target is not None:
            check_target(target)
            common_unit("mesh and target", (mesh, target))
        n = mesh.n_vertices
        self.target = target
        self.forces = as_forces(forces)
        self.iteration = 0
        self._neighbors = mesh.connectivity.neighbors
        seeking = checks.number("seeking", seeking, 0.0, 1.0)
        self.rigidity = whole_per_vertex("rigidity", given_or_stored(rigidity, mesh, "rigidity", 1), n, 0, MOST_RIGID)
        self.alpha = per_vertex("alpha", alpha, n, 0.0, 0.5)
        self.beta = per_vertex("beta", beta, n, 0.0, 1.0)
        self.damping = per_vertex("damping", damping, n, 1e-3, 1.0)
        diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
        self._max_move2 = (MAX_STEP * max(diagonal, np.finfo(float).tiny)) ** 2
        self.reach = 0.2 * diagonal if reach is None else checked_reach(reach)
        self.adaptation = checks.number("adaptation", adaptation, 0.0, 1.0)
        self.constraint = constraint_codes(given_or_stored(constraint, mesh, "constraint", "mean_curvature"), n)
        creased = mesh.data.get("crease")
        self._creased = None if creased is None else np.asarray(creased, bool)
        if creased is not None and constraint is None and "constraint" not in mesh.data:
            self.constraint[self._creased] = FREE
        conditions = conditions_on(mesh, contours)
        self._start = numbered(mesh, "contour", (condition.line for condition in conditions))
        for condition in conditions:
            if condition.continuity is not None:
                self.constraint[condition.line.vertices] = CONSTRAINTS.index(CONTINUITIES[condition.continuity])
        self.constraint.setflags(write=False)
        self.metric, self._reference_angle, self._prescribed = references(
            mesh, self.constraint, metric=metric, curvature=curvature, reference=reference
        )
        self._allocate(mesh.vertices, 0.0 if velocity is None else checks.array("velocity", velocity, (n, 3)))
        self._release, self._confines = Release(n), Confines(mesh.vertices, self._neighbors, target)
        self._contours: Contours | None = None
        self._pinned = any(condition.pinned for condition in conditions)
        if mesh.n_holes or conditions:
            border = wide_border(target if mesh.n_holes and seeking else None, mean_edge(mesh))
            attraction = BorderAttraction(border, seeking)
            self._contours = Contours(mesh, mesh if reference is None else reference, attraction, conditions)

    def _allocate(self, vertices: Array, velocity: Array | float) -> None:
        n = len(vertices)
        self._vertices, self._previous, self._next = vertices.copy(), vertices - velocity, vertices.copy()
        self._frames = Frames(np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n, np.int8))
        self._averages = Averages(self._frames, self._neighbors)
        self._moves, self._energy = np.zeros(n), np.zeros(n)
        self._no_gap = np.full(n, np.nan)
        self._counted_constraint: NDArray[np.int8] | None = None

    @property
    def mesh(self) -> SimplexMesh:
        """The present mesh, with its reference metric parameters as data array `metric`."""
        return self._start.moved(self._vertices).with_data(metric=self.metric)

    @property
    def velocity(self) -> Array:
        """(n, 3) the last step of each vertex; as an array of a mesh it goes through edits."""
        return self._vertices - self._previous

    def run(self, iterations: int, *, every: int = 1, tolerance: float = 0.0, warnings: bool = True) -> Iterator[State]:
        """Iterate, yielding the state regularly, so that a loop can monitor, draw or stop the motion.

        Parameters
        ----------
        iterations : int
            Maximum number.
        every : int
            Number of iterations per state; the last iteration yields one in any case.
        tolerance : float
            Stop once no vertex moves farther than this in an iteration, in the mesh's unit; 0 never stops early.
        warnings : bool
            Whether to warn at the end of a mesh that is folded, or of which a quarter, or a part far from the rest, has
            no data within reach.

        Returns
        -------
        iterator of State
            Lazy: nothing moves before the first state is requested.

        Raises
        ------
        DivergedError
            When a vertex moves by more than 10 diagonals of the first mesh, to a position that is not finite, or away
            from the start and the data; the error carries the last valid mesh.

        Warns
        -----
        SimplexMeshWarning
            For a mesh that is not at its goal at the end; see `warnings`.
        """
        iterations = checks.integer("iterations", iterations, 0)
        every = checks.integer("every", every, 1)
        tolerance = checks.number("tolerance", tolerance, 0.0)
        return self._states(iterations, every, tolerance, warnings=checks.flag("warnings", warnings))

    def _states(self, iterations: int, every: int, tolerance: float, *, warnings: bool) -> Iterator[State]:
        for k in range(1, iterations + 1):
            gaps = self.step()
            move = float(np.sqrt(self._moves.max()))
            at_rest = move <= tolerance and tolerance > 0
            if k % every == 0 or k == iterations or at_rest:
                yield State.of(self.iteration, self._energy, gaps, move, self._release.mask)
            if at_rest:
                break
        if warnings and iterations and self.target is not None:
            warn_of_end(self.mesh, gaps, self._release.mask, self.reach)

    def step(self) -> Array:
        """Do one iteration and return the gaps (n,) that it used, NaN where no data was within reach.

        Raises
        ------
        DivergedError
            As for `run`; the step is not taken.
        """
        _kernels_step.frames(len(self._vertices), self._vertices, self._neighbors, *self._frames)
        if self._creased is not None:
            self._frames.area[self._creased] = 0.0
        if self._contours is not None:
            self._contours.prescribe(self._vertices, self._frames)
        metric, following, normals = self._adapted_metric(), self._next, self._frames.normals
        gaps = self._no_gap
        if self.target is not None:
            gaps = target_gaps(self.target, self._vertices, normals, self.reach)
            self._release.update(normals, self._neighbors, gaps, (self.alpha == 0) & (self.beta == 0))
        extra = self._user_displacement() if self.forces else None
        moving = Moving(self._vertices, self._previous, self._neighbors, metric)
        forces, out = Forces(self.alpha, self.beta, self.damping, gaps), Step(following, self._moves, self._energy)
        self._step_surface(moving, extra, forces, out)
        if self._contours is not None:
            self._contours.step(moving, normals, self.constraint, extra, self.reach, forces, out)
        if self._confines.target is not self.target:
            self._confines = Confines(self._start.vertices, self._neighbors, self.target)
            self._release = Release(len(following))
        most = float(self._moves.max())
        stray = self._confines.stray(following, most**0.5)
        stray = -1 if self.forces or self._pinned else stray
        if stray >= 0 or not most <= self._max_move2:
            raise self._diverged(gaps, stray)
        # one assignment, so that an interrupt leaves the model either before this step or after it
        self._next, self._previous, self._vertices, self.metric, self.iteration = (
            *(self._previous, self._vertices, following),
            *(metric, self.iteration + 1),
        )
        return gaps

    def _user_displacement(self) -> Array:
        """Return the displacements (n, 3) of the user's forces."""
        vertices, normals, curvature = map(read_only, (self._vertices, self._frames.normals, self._frames.curvature))
        return total_displacement(self.forces, Frame(vertices, normals, self._neighbors, curvature, self.iteration))

    def _step_surface(self, moving: Moving, extra: Array | None, forces: Forces, out: Step) -> None:
        """Fill the next step under the surface's internal force, by the fast kernel where it suffices."""
        if self._counted_constraint is not self.constraint:
            self._counted_constraint = self.constraint
            self._constraint_counts = np.bincount(self.constraint, minlength=len(CONSTRAINTS))
        counts, code, released = self._constraint_counts, self.constraint, self._release.mask
        wanted = self._averages.mean_curvature(self.rigidity) if counts[MEAN_CURVATURE] else self._prescribed
        if counts[MEAN_CURVATURE] == len(code) and extra is None:
            wanted[released] = 0.0
            _kernels_step.curvature_step(len(wanted), wanted, moving, self._frames, forces, out)
            return
        if counts[CURVATURE]:
            wanted = np.where(code == CURVATURE, self._prescribed, wanted)
        angle = self._reference_angle
        if counts[ANGLE]:
            angle, frames = np.zeros(len(code)), self._frames
            _kernels_step.angles(
                len(self._vertices), self._vertices, self._neighbors, frames.normals, frames.inverse_radius, angle
            )
            angle = np.where(code == ANGLE, self._averages.of(angle, self.rigidity, angles=True), self._reference_angle)
        code = np.where(released & (code != FREE) & (code != SHAPE), np.int8(ORIENTATION), code)
        extra = np.zeros_like(self._vertices) if extra is None else extra
        _kernels_step.constrained_step(len(code), code, moving, self._frames, Wanted(wanted, angle, extra), forces, out)

    def _adapted_metric(self) -> Array:
        """Return the metric parameters of this iteration: the present ones, or every tenth time a new array."""
        if not (self.adaptation and self.iteration and self.iteration % 10 == 0):
            return self.metric
        edge = float(norm(self._vertices[self._neighbors[:, 0]] - self._vertices).mean())
        bend = curvedness(self._vertices, self._frames.normals, self._neighbors, shortest=edge)
        smooth, least = self._averages.of(bend, np.full(len(bend), 2)), FLAT / max(edge, 1e-300)
        return adapted_metric(self.metric, smooth, self._neighbors, strength=self.adaptation, least=least)

    def _diverged(self, gaps: Array, stray: int) -> DivergedError:
        """Return an error that names the first diverged vertex, and the target's answer there if that was the cause."""
        wrong = stray if stray >= 0 else int(np.argmax(~(self._moves <= self._max_move2)))
        message = f"vertex {wrong} diverged at iteration {self.iteration + 1}"
        if abs(gaps[wrong]) > self._max_move2**0.5:
            message += f": {type(self.target).__name__}.gap returned {gaps[wrong]:g} there"
        elif stray >= 0:
            message += ": it left the box around the start and the data"
        return DivergedError(message, self.mesh)
