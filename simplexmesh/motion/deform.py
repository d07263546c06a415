"""The deformable model: a mesh that moves under internal constraints, data and forces of the user's own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.errors import DivergedError
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion import _kernels, _kernels_adapt, _kernels_averages, _kernels_rim
from simplexmesh.motion.adapt import FLAT, adapt
from simplexmesh.motion.forces import CONSTRAINTS, Force, Frame, constraint_codes, pushed, several
from simplexmesh.motion.parameters import carried, per_vertex, references, whole_per_vertex
from simplexmesh.motion.rim import Memory, Rim
from simplexmesh.motion.shore import Shore
from simplexmesh.motion.state import State, Target
from simplexmesh.motion.targets.door import ask, reach_above_zero, read_only

Array = NDArray[np.float64]


LONGEST_STEP = 10.0
"""A vertex that moves by more than so many diagonals of the first mesh in one iteration has diverged."""


class DeformableModel:
    """A simplex mesh in motion (Delingette 1994, chapters 4 and 5, equations 4.42, 5.2 and 5.3).

    One iteration moves every vertex by ``(1 - damping) (P - P_previous) + alpha (P* - P) + beta gap n``: inertia, the
    internal constraint, and the data seen along the normal. Three safeguards hold: the height of P* above its
    neighbors is at most the (root mean square) distance to them, a step at most half of that, and a vertex whose
    normal is reversed against its neighbors' is not pushed along it.

    Parameters
    ----------
    mesh : SimplexMesh
        Where to start. Its arrays `metric`, `rigidity`, `constraint` and `reference_angle` are the defaults here.
    target : Target, optional
        What draws the mesh; see `simplexmesh.targets`. Without one only the internal force and `forces` act.
    rigidity : int or (n,) array of int
        How many edges far the constraints `angle` and `mean_curvature` average, 1 (fine) to about 10 (stiff).
    alpha, beta : float or (n,) array of float
        Weight of the internal force (0 to 0.5) and of the data (0 to 1).
    damping : float or (n,) array of float
        1 is no inertia; must be above 0.
    reach : float, optional
        Data farther away than this does not draw, in the mesh's unit; infinity for no limit. Default: 20 % of the
        mesh's diagonal.
    constraint : str or (n,) array of str, optional
        One of `simplexmesh.motion.forces.CONSTRAINTS`; default `mean_curvature`.
    metric : (n, 3) array of float, optional
        Reference metric parameters, rows summing to 1; default 1/3 each, which spaces vertices evenly.
    curvature : float or (n,) array of float, optional
        The mean curvature wanted by the constraint `curvature`, positive on a sphere.
    reference : SimplexMesh, optional
        The shape remembered by the constraint `shape`: same connectivity, any place and size.
    adaptation : float
        Every 10 iterations the metric parameters follow curvature with this strength, 0 (never) to 0.25.
    seeking : float
        Weight, 0 to 1, with which vertices on holes are drawn to the border of the data, where the target knows one.
    forces : callable or sequence of callables
        Each maps a `Frame` to displacements (n, 3), added in every iteration.

    Raises
    ------
    ValueError, TypeError
        For an argument of the wrong shape, type or range, and a mesh of a size beyond what areas can be multiplied in.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ball = sm.sphere(6)
    >>> rough = ball.moved(ball.vertices + 0.02 * np.random.default_rng(0).normal(size=ball.vertices.shape))
    >>> model = DeformableModel(rough, rigidity=4)
    >>> for state in model.run(100):
    ...     pass
    >>> bool(model.mesh.mean_curvature.std() < 0.1 * rough.mean_curvature.std())
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
        adaptation: float = 0.0,
        seeking: float = 0.8,
        forces: Force | Sequence[Force] = (),
    ) -> None:
        if not isinstance(mesh, SimplexMesh):
            raise TypeError(f"mesh must be a SimplexMesh, not {type(mesh).__name__}")
        _check.size("mesh", mesh.bounds)
        if target is not None and not callable(getattr(target, "gap", None)):
            raise TypeError(f"target must have a method gap(vertices, normals, reach), not {type(target).__name__}")
        n = mesh.n_vertices
        self.target = target
        self.forces = several(forces)
        self.iteration = 0
        self._start = mesh
        self._neighbors = mesh.connectivity.neighbors
        self._rim = Rim.of(mesh.connectivity)
        self._shore = Shore.of(target, mesh, _check.number("seeking", seeking, 0.0, 1.0))
        self.rigidity = whole_per_vertex("rigidity", carried(rigidity, mesh, "rigidity", 1), n, 0, 1000)
        self.alpha = per_vertex("alpha", alpha, n, 0.0, 0.5)
        self.beta = per_vertex("beta", beta, n, 0.0, 1.0)
        self.damping = per_vertex("damping", damping, n, 1e-3, 1.0)
        diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
        self._longest2 = (LONGEST_STEP * max(diagonal, np.finfo(float).tiny)) ** 2
        self.reach = 0.2 * diagonal if reach is None else reach_above_zero(reach)
        self.adaptation = _check.number("adaptation", adaptation, 0.0, 1.0)
        self.constraint = constraint_codes(carried(constraint, mesh, "constraint", "mean_curvature"), n)
        self.constraint.setflags(write=False)
        self.metric, self._reference_angle, self._prescribed = references(
            mesh, self.constraint, metric=metric, curvature=curvature, reference=reference
        )
        self._buffers(mesh.vertices)
        if self._rim:
            kept = mesh if reference is None else reference
            self._memory = Memory(self._rim.vertices, kept.vertices, self._neighbors)

    def _buffers(self, vertices: Array) -> None:
        n = len(vertices)
        self._vertices, self._previous, self._next = vertices.copy(), vertices.copy(), vertices.copy()
        self._normals = np.zeros((n, 3))
        self._inverse_radius, self._curvature, self._moves, self._energy = (np.zeros(n) for _ in range(4))
        self._area, self._moment, self._steep = np.zeros(n), np.zeros(n), np.zeros(n, np.int8)
        self._scratch = np.zeros((2, n))
        self._no_gap = np.full(n, np.nan)
        self._counted: NDArray[np.int8] | None = None

    @property
    def mesh(self) -> SimplexMesh:
        """The mesh as it is now, its reference metric parameters among its data."""
        return self._start.moved(self._vertices).with_data(metric=self.metric)

    def run(self, iterations: int, *, every: int = 1, tolerance: float = 0.0) -> Iterator[State]:
        """Move, yielding a state every so many iterations, so that any loop can watch, draw or stop.

        Parameters
        ----------
        iterations : int
            How many at most.
        every : int
            Yield once in so many iterations (and at the last).
        tolerance : float
            Stop once no vertex moves by more than this in an iteration, in the mesh's unit; 0 never stops early.

        Returns
        -------
        iterator of State
            Nothing moves until it is asked for its first state.

        Raises
        ------
        DivergedError
            When a vertex flies off, by 10 times the size of the first mesh or out of the finite numbers; the error
            carries the last good mesh.
        """
        iterations = _check.integer("iterations", iterations, 0)
        every = _check.integer("every", every, 1)
        tolerance = _check.number("tolerance", tolerance, 0.0)
        return self._states(iterations, every, tolerance)

    def _states(self, iterations: int, every: int, tolerance: float) -> Iterator[State]:
        for k in range(1, iterations + 1):
            gaps = self.step()
            move = float(np.sqrt(self._moves.max()))
            resting = move <= tolerance and tolerance > 0
            if k % every == 0 or k == iterations or resting:
                yield State.of(self.iteration, self._energy, gaps, move)
            if resting:
                return

    def step(self) -> Array:
        """Do one iteration and return the gaps it saw, (n,), NaN where no data was within reach.

        Raises
        ------
        DivergedError
            When a vertex flies off; the step is not taken.
        """
        frame = (self._inverse_radius, self._curvature, self._area, self._steep)
        _kernels.frames(self._vertices, self._neighbors, self._normals, *frame)
        metric, following = self._adapted(), self._next
        gaps = self._no_gap if self.target is None else ask(self.target, self._vertices, self._normals, self.reach)
        extra = self._pushed() if self.forces else None
        self._internal(metric, gaps, extra, following)
        if self._rim:
            self._on_rims(self._rim, gaps, extra, following)
        if not self._moves.max() <= self._longest2:
            raise self._diverged(gaps)
        # all at once, so that an interrupt leaves the model before this step or after it
        self._next, self._previous, self._vertices, self.metric, self.iteration = (
            *(self._previous, self._vertices, following),
            *(metric, self.iteration + 1),
        )
        return gaps

    def _pushed(self) -> Array:
        """Return the sum of the user's forces as displacements."""
        n, normals, curvature = self._neighbors, read_only(self._normals), read_only(self._curvature)
        frame = Frame(read_only(self._vertices), normals, n, curvature, self.iteration)
        return pushed(self.forces, frame)

    def _on_rims(self, rim: Rim, gaps: Array, extra: Array | None, out: Array) -> None:
        """Replace the next positions of the vertices on holes: the contour's force in place of the surface's."""
        goals = rim.targets(self._vertices, self.constraint, self._memory)
        extra = self._shore.added(extra, self._vertices, rim, self.reach)
        _kernels_rim.rim_step(
            *(self._vertices, self._previous, self._neighbors, self._normals, rim.vertices, goals, extra, gaps),
            *(self.alpha, self.beta, self.damping, out, self._moves, self._energy),
        )

    def _smoothed(self, values: Array, passes: NDArray[np.int64], *, angles: bool = False) -> Array:
        """Return `values` after as many one-ring averaging passes as each vertex asks for."""
        most = int(passes.max(initial=0))
        uniform = int(passes.min()) == most
        out = values if uniform else values.copy()
        for k in range(1, most + 1):
            into = self._scratch[k % 2]
            if angles:
                _kernels_averages.angle_averages(values, self._neighbors, self._inverse_radius, into)
            else:
                _kernels_averages.averages(values, self._neighbors, into)
            values = into
            if uniform:
                out = into
            else:
                np.copyto(out, into, where=passes == k)
        return out

    def _mean_curvature(self) -> Array:
        """Return the mean of H over Q^s, each vertex weighing as much as its neighbors' triangle.

        Weights are free as long as they are positive (thesis, section 4.3). Equal ones let a few tiny, strongly bent
        triangles blow up large ones beside them.
        """
        _kernels_averages.moments(self._curvature, self._area, self._moment)
        moment = self._smoothed(self._moment, self.rigidity)
        np.copyto(self._moment, moment)
        area = self._smoothed(self._area, self.rigidity)
        _kernels_averages.quotients(self._moment, area, self._moment)
        return self._moment

    def _internal(self, metric: Array, gaps: Array, extra: Array | None, out: Array) -> None:
        """Fill the next positions of all vertices under the surface's force, by the plain kernel where it suffices."""
        given = (
            *(self._vertices, self._previous, self._neighbors, metric),
            *(self._normals, self._inverse_radius, self._steep),
        )
        weights = (gaps, self.alpha, self.beta, self.damping, out, self._moves, self._energy)
        if self._counted is not self.constraint:
            self._counted, self._kinds = self.constraint, np.bincount(self.constraint, minlength=len(CONSTRAINTS))
        kinds = self._kinds
        curvature_code = CONSTRAINTS.index("mean_curvature")
        wanted = self._mean_curvature() if kinds[curvature_code] else self._prescribed
        if kinds[curvature_code] == len(gaps) and extra is None:
            _kernels.curvature_step(*given, wanted, *weights)
            return
        if kinds[CONSTRAINTS.index("curvature")]:
            wanted = np.where(self.constraint == CONSTRAINTS.index("curvature"), self._prescribed, wanted)
        angle = self._reference_angle
        if kinds[CONSTRAINTS.index("angle")]:
            angle = np.zeros(len(gaps))
            _kernels.angles(self._vertices, self._neighbors, self._normals, self._inverse_radius, angle)
            average = self._smoothed(angle, self.rigidity, angles=True)
            angle = np.where(self.constraint == CONSTRAINTS.index("angle"), average, self._reference_angle)
        extra = np.zeros_like(self._vertices) if extra is None else extra
        _kernels.constrained_step(*given, self.constraint, wanted, angle, extra, *weights)

    def _adapted(self) -> Array:
        """Return the metric parameters of this iteration: every tenth time, new ones in the spare array."""
        if not (self.adaptation and self.iteration and self.iteration % 10 == 0):
            return self.metric
        bend, spare = self._moment, np.empty_like(self.metric)
        edge = float(np.linalg.norm(self._vertices[self._neighbors[:, 0]] - self._vertices, axis=1).mean())
        _kernels_adapt.curvedness(self._vertices, self._normals, self._neighbors, edge, bend)
        smooth = self._smoothed(bend, np.full(len(bend), 2))
        adapt(self.metric, smooth, self._neighbors, self.adaptation, spare, least=FLAT / max(edge, 1e-300))
        return spare

    def _diverged(self, gaps: Array) -> DivergedError:
        """Return what to say about the first vertex that flew off, and whose doing it was if that is known."""
        wrong = int(np.argmax(~(self._moves <= self._longest2)))
        said = f"vertex {wrong} flew off at iteration {self.iteration + 1}"
        if abs(gaps[wrong]) > self._longest2**0.5:
            said += f": {type(self.target).__name__}.gap answered {gaps[wrong]:g} there"
        return DivergedError(said, self.mesh)
