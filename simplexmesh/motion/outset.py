"""What a reconstruction sets out with: a mesh, the data, a plan, and what is known of the data's topology."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from simplexmesh import _check
from simplexmesh.data.reading import read_mesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.initial.primitives import ENCLOSING, PRIMITIVES, primitive_around
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.outward import turned_outward
from simplexmesh.motion.placing import thin
from simplexmesh.motion.plan import Plan
from simplexmesh.motion.sampling import closed_samples
from simplexmesh.motion.state import Target
from simplexmesh.motion.subjects import Subject
from simplexmesh.motion.wrap import Samples


@dataclass(frozen=True, eq=False)
class Outset:
    """Where the motion begins.

    Attributes
    ----------
    mesh : SimplexMesh
    subject : Subject
        The data, turned outward where the start asks for that.
    plan : Plan
        What is to be done on the way, as the start leaves it.
    found : StartReport or None
        What the automatic start decided.
    samples : Samples or None
        The data's surface and its tunnels, for starts from outside of it.
    """

    mesh: SimplexMesh
    subject: Subject
    plan: Plan
    found: StartReport | None = None
    samples: Samples | None = None

    @property
    def target(self) -> Target:
        """What the mesh is drawn to."""
        known = self.samples.target if self.samples else None
        return self.subject.target if known is None else known


def outset(
    subject: Subject,
    init: str | SimplexMesh,
    plan: Plan,
    *,
    vertices: int,
    tunnels: float | None,
    placement: str | None,
) -> Outset:
    """Return what a reconstruction sets out with.

    Parameters
    ----------
    subject : Subject
    init : str or SimplexMesh
        "auto", the name of a primitive, or the start itself.
    plan : Plan
    vertices, tunnels
        As for `reconstruct`.
    placement : str or None
        As it was asked for; None: even where the start found is thin.

    Returns
    -------
    Outset
    """
    if isinstance(init, SimplexMesh):
        return Outset(init, subject, plan)
    if init == "auto":
        start = subject.start(vertices, tunnels)
        if placement is None and subject.encloses and thin(start.mesh):
            plan = replace(plan, placement="even")
        return Outset(start.mesh, subject, plan, found=start.report)
    enclosed = init in ENCLOSING and plan.handles != "none"
    samples = closed_samples(subject, vertices, tunnels) if enclosed else None
    if samples is None and init != "plane":
        subject = turned_outward(subject, enclosed=init in ENCLOSING)
    mesh = primitive_around(subject.points, init, plan.first_vertices, facing=subject.facing)
    return Outset(mesh, subject, plan, samples=samples)


def given_start(init: str | Path | SimplexMesh) -> str | SimplexMesh:
    """Return the mesh that `init` is or names, or the name of a start yet to be made.

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
