"""The start found in data, and the report on it."""

from __future__ import annotations

from dataclasses import dataclass

from simplexmesh._base.arrays import Mask
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.orientation.poisson import Indicator

FAR = 0.04
"""In diagonals of the data: beyond any noise."""

MOST_OPEN = 0.25
"""Openness from which points are of an open surface: half a sphere has 0.3, solids that lack a side have less."""


@dataclass(frozen=True)
class StartReport:
    """What the automatic initialization found and decided.

    Attributes
    ----------
    grid : tuple of int
        Shape of the grid that determined the topology.
    cell : float
        Size of its cells, in the unit of the data.
    genus, components : int
        Of the mesh, the genus summed over its components.
    tunnels_removed : int
        Tunnels sealed because they are too narrow for the mesh.
    components_dropped : int
        Smaller components left out.
    share_dropped : float
        Of a volume of which all pieces are wanted: the share of the samples inside on those too small for a mesh.
    openness : float
        For points and triangles: the share of the mesh's area that is farther from all of them than 4 % of their
        diagonal, where parts that face opposite ways, as the lids of a tube, count twice. 0 if they enclose a solid,
        up to 0.25 for solids scanned from all sides but one, more for open surfaces.
    doubled : float
        For points without normals: the share of the mesh's area where its two sides have only the points of one noisy
        sheet; half of it counts as open too. Sides of a solid that are closer than three times the noise look alike.
    doubtful : tuple of (x, y, z)
        For points: where handles may be of noise or lack, in walls and gaps hardly thicker than noise or spacing.
        Empty if the genus is that of most levels in a row of the field that bounds the solid.
    """

    grid: tuple[int, int, int]
    cell: float
    genus: int
    components: int
    tunnels_removed: int = 0
    components_dropped: int = 0
    share_dropped: float = 0.0
    openness: float = 0.0
    doubled: float = 0.0
    doubtful: tuple[tuple[float, ...], ...] = ()

    @property
    def is_open(self) -> bool:
        """Whether the data is an open surface: more than a quarter of a closed mesh has no data of its own."""
        return self.openness + self.doubled / 2 > MOST_OPEN

    def __str__(self) -> str:
        parts = [f"start of genus {self.genus}", f"{self.components} components" if self.components > 1 else ""]
        parts.append(f"from a grid of {' x '.join(map(str, self.grid))} cells of {self.cell:.3g}")
        parts.append(f"{self.tunnels_removed} small tunnels sealed" if self.tunnels_removed else "")
        share = f" ({100 * self.share_dropped:.3g} % of the samples)" if self.share_dropped else ""
        parts.append(f"{self.components_dropped} smaller pieces left out{share}" if self.components_dropped else "")
        parts.append("the data is an open surface" if self.is_open else "")
        return ", ".join(part for part in parts if part)


@dataclass(frozen=True, eq=False)
class Start:
    """A closed initial mesh and its report; of points the indicator, of a volume the samples left out."""

    mesh: SimplexMesh
    report: StartReport
    indicator: Indicator | None = None
    left_out: Mask | None = None
