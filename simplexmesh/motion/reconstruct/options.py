"""The choices of the user of `reconstruct`, checked, with their defaults, and the stages of motion that follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simplexmesh._base import checks
from simplexmesh.data.io.reading import read_mesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density.refinement import THRESHOLDS
from simplexmesh.motion.model.parameters import MOST_RIGID
from simplexmesh.motion.model.state import Stage, mean_edge
from simplexmesh.motion.reconstruct.inputs import START_SHARE, Input
from simplexmesh.motion.start.primitives import ENCLOSING, PRIMITIVES

FEWEST_VERTICES, MOST_VERTICES = 20, 20_000_000
"""More vertices would take tens of gigabytes, and the process would be killed."""

FEWEST_START = 720
"""Vertices of a start that finds holes, for which a smaller model takes up to eight tenths of its own."""

REFINEMENTS = ("none", "auto", *THRESHOLDS)

Choice = str | Sequence[Any] | Callable[[Any], bool]


@dataclass(frozen=True)
class Options:
    """The parameters of `reconstruct`, checked; by default primitives change in every way, meshes given in none."""

    init: Any  # a mesh that was named by path has been read
    vertices: int
    components: str  # "largest" for a start that is given
    tunnels: float | None
    iterations: int
    rigidity: int
    adaptation: float | None
    placement: str | None  # "closed": adaptive but for thin bodies, and holes: their boundary strays among coarse faces
    holes: Choice | None  # "open": in open surfaces only
    handles: Choice | None
    refine: str | None  # "open": if holes were opened, which takes vertices
    creases: str = "auto"

    def __post_init__(self) -> None:
        placement, adaptation, init = self.placement, self.adaptation, checked_init(self.init)
        if adaptation is None:
            adaptation = 0.0 if placement == "even" else 0.05
        adaptation = checks.number("adaptation", adaptation, 0.0, 0.25)
        primitive = "auto" if init in PRIMITIVES else "none"
        if placement is None:
            placement = "even" if isinstance(init, SimplexMesh) or not adaptation else "closed"
        else:
            checks.choice("placement", placement, ("adaptive", "even"))
        by_default = "open" if init == "auto" else primitive
        refine = by_default if self.refine is None else checks.choice("refine", self.refine, REFINEMENTS)
        holes = _choice("holes", self.holes, by_default)
        wraps = init in ENCLOSING and isinstance(holes, str)
        handles = _choice("handles", self.handles, "auto" if wraps else "none")
        if not wraps and (callable(handles) or (handles == "auto" and init != "auto")):
            raise ValueError(
                "handles are found from init='sphere' or 'ellipsoid' with holes='auto' or 'none' only; "
                "elsewhere give pairs of faces"
            )
        checked = {
            "init": init,
            "vertices": checks.integer("vertices", self.vertices, FEWEST_VERTICES, MOST_VERTICES),
            "components": checks.choice("components", self.components, ("auto", "largest", "all")),
            "tunnels": None if self.tunnels is None else checks.number("tunnels", self.tunnels, 0.0),
            "iterations": checks.integer("iterations", self.iterations, 0),
            "rigidity": checks.integer("rigidity", self.rigidity, 0, MOST_RIGID),
            "adaptation": adaptation,
            "placement": placement,
            "holes": holes,
            "handles": handles,
            "refine": refine,
            "creases": checks.choice("creases", self.creases, ("auto", "none")),
        }
        seals = init == "auto" or (init in ENCLOSING and not isinstance(handles, list) and handles != "none")
        if self.tunnels is not None and not seals:
            raise ValueError("tunnels needs init='auto', or a sphere whose handles are found; other starts keep theirs")
        if self.components == "all" and init != "auto":
            raise ValueError("components='all' needs init='auto'; a given start keeps its components")
        if init != "auto":
            checked["components"] = "largest"
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def is_plain(self) -> bool:
        """Whether nothing is asked for but a number of vertices, which components, and that there be no holes."""
        plain = Options(
            init="auto", vertices=self.vertices, components=self.components, tunnels=None, iterations=500, rigidity=1,
            adaptation=None, placement=None, holes="none" if self.holes == "none" else None, handles=None, refine=None,
        )  # fmt: skip
        return self == plain

    @property
    def first_vertices(self) -> int:
        """Number of vertices of the start; refinement adds the others."""
        if self.refine in ("none", "open"):
            return self.vertices
        return max(int(START_SHARE * self.vertices), min(int(0.8 * self.vertices), FEWEST_START))


def checked_init(init: Any) -> str | SimplexMesh:
    """Return the mesh that is given or named by path, or the name of a start to be computed."""
    if isinstance(init, SimplexMesh) or (isinstance(init, str) and init in ("auto", *PRIMITIVES)):
        return init
    if isinstance(init, Path) or (isinstance(init, str) and Path(init).suffix):
        return read_mesh(init)
    if not isinstance(init, str):
        raise TypeError(f"init must be a name, a path or a SimplexMesh, not {checks.type_name(init)}")
    return checks.choice("init", init, ("auto", *PRIMITIVES))


def _choice(name: str, given: Choice | None, default: str) -> Choice:
    """Return the choice of holes or handles, checked; sequences as lists, since arrays do not compare with names."""
    if given is None:
        return default
    if isinstance(given, str):
        return checks.choice(name, given, ("auto", "none"))
    if callable(given):
        return given
    if not hasattr(given, "__len__"):
        raise TypeError(f"{name} must be 'auto', 'none', a function or a sequence, not {type(given).__name__}")
    return list(given)


def stages_from(start: SimplexMesh, data: Input, options: Options, *, cell: float | None) -> list[Stage]:
    """Return ever lighter stages: three from a start found on a grid of this cell size, five from farther away."""
    radius = 0.5 * data.diagonal
    edge, rigidity, iterations = mean_edge(start), options.rigidity, options.iterations
    last = max(2 * data.resolution, edge)
    if cell is not None:
        error = max(data.resolution, cell, min(1.2 * edge, 1.5 * data.resolution))  # few vertices are farther off
        near = 1.25 * error if data.layered else max(3 * data.resolution, 2 * edge)
        reach = min(near, 0.2 * radius)
        return [
            Stage(max(2, rigidity), reach, 40, beta=0.2),
            Stage(rigidity, reach, iterations, beta=0.4, adaptation=options.adaptation or 0.0),
            Stage(rigidity, min(last, reach), iterations // 2, beta=0.4),
        ]
    return [
        Stage(max(20, rigidity), 2.0 * radius, 150, alpha=0.5, beta=0.03),
        Stage(max(10, rigidity), 0.8 * radius, 60, alpha=0.5, beta=0.05),
        Stage(max(6, rigidity), 0.4 * radius, 100, beta=0.1),
        Stage(rigidity, 0.16 * radius, iterations, beta=0.3, adaptation=options.adaptation or 0.0),
        Stage(rigidity, last, iterations // 2, beta=0.4),
    ]
