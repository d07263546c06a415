"""Initialization of a reconstruction: the start mesh, the oriented data, the plan, and the known topology."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from simplexmesh import _check
from simplexmesh.data.reading import read_mesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.exchange import is_thin
from simplexmesh.motion.initial.primitives import ENCLOSING, PRIMITIVES, primitive_around
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.outward import turned_outward
from simplexmesh.motion.plan import Plan
from simplexmesh.motion.sampling import closed_samples
from simplexmesh.motion.state import Target
from simplexmesh.motion.subjects import Subject
from simplexmesh.motion.wrap import Samples

FEWEST_WRAPPED = 60
"""Meshes of fewer vertices would collapse when they are wrapped around the data, and have no room for handles."""


@dataclass(frozen=True, eq=False)
class Initialization:
    """The initial state of a reconstruction.

    Attributes
    ----------
    mesh : SimplexMesh
    subject : Subject
        The data, with normals turned outward where the start needs that.
    plan : Plan
        The plan, with the placement that suits the start.
    found : StartReport or None
        The report of the automatic start.
    samples : Samples or None
        Points on the surface and its tunnels, for starts that enclose it.
    """

    mesh: SimplexMesh
    subject: Subject
    plan: Plan
    found: StartReport | None = None
    samples: Samples | None = None

    @property
    def target(self) -> Target:
        """The data that attracts the mesh."""
        known = self.samples.target if self.samples else None
        return self.subject.target if known is None else known


def initialized(
    subject: Subject,
    init: str | SimplexMesh,
    plan: Plan,
    *,
    vertices: int,
    tunnels: float | None,
    placement: str | None,
) -> Initialization:
    """Return the initial state of a reconstruction.

    Parameters
    ----------
    subject : Subject
    init : str or SimplexMesh
        "auto", the name of a primitive, or the start mesh.
    plan : Plan
    vertices, tunnels
        As for `reconstruct`.
    placement : str or None
        The user's choice; with None, it becomes even where the automatic start is thin.

    Returns
    -------
    Initialization
    """
    if isinstance(init, SimplexMesh):
        return Initialization(init, subject, plan)
    if init == "auto":
        start = subject.start(vertices, tunnels)
        if placement is None and subject.encloses and is_thin(start.mesh):
            plan = replace(plan, placement="even")
        return Initialization(start.mesh, subject, plan, found=start.report)
    enclosed = init in ENCLOSING and plan.handles != "none" and vertices >= FEWEST_WRAPPED
    samples = closed_samples(subject, vertices, tunnels) if enclosed else None
    if samples is None and init != "plane":
        subject = turned_outward(subject, enclosed=init in ENCLOSING)
    mesh = primitive_around(subject.points, init, plan.first_vertices, facing=subject.facing)
    return Initialization(mesh, subject, plan, samples=samples)


def given_start(init: str | Path | SimplexMesh) -> str | SimplexMesh:
    """Return the mesh that is given or named by path, or the name of a start to be computed, checked.

    Examples
    --------
    >>> given_start("sphere")
    'sphere'
    """
    if isinstance(init, SimplexMesh) or (isinstance(init, str) and init in ("auto", *PRIMITIVES)):
        return init
    if isinstance(init, Path) or (isinstance(init, str) and Path(init).suffix):
        return read_mesh(init)
    if not isinstance(init, str):
        raise TypeError(f"init must be a name, a path or a SimplexMesh, not {type(init).__name__}")
    _check.choice("init", init, ("auto", *PRIMITIVES))
    return init
