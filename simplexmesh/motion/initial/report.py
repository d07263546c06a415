"""The report of the automatic initialization."""

from __future__ import annotations

from dataclasses import dataclass

OPEN = 0.25


@dataclass(frozen=True)
class StartReport:
    """What the automatic initialization found and decided.

    Attributes
    ----------
    grid : tuple of int
        Shape of the grid that determined the topology.
    cell : float
        Size of its cells, in the unit of the data.
    genus : int
        Genus of the mesh, summed over its components.
    components : int
        Number of components of the mesh.
    tunnels_removed : int
        Tunnels sealed because they are too narrow for the mesh.
    components_dropped : int
        Smaller components left out.
    openness : float
        For points: how far they are from enclosing a solid. 0 if they do, 0.1 to 0.25 for solids scanned from all
        sides but one, more for open surfaces.
    """

    grid: tuple[int, int, int]
    cell: float
    genus: int
    components: int
    tunnels_removed: int = 0
    components_dropped: int = 0
    openness: float = 0.0

    def __str__(self) -> str:
        parts = [f"start of genus {self.genus}", f"{self.components} components" if self.components > 1 else ""]
        parts.append(f"from a grid of {' x '.join(map(str, self.grid))} cells of {self.cell:.3g}")
        parts.append(f"{self.tunnels_removed} small tunnels sealed" if self.tunnels_removed else "")
        parts.append(f"{self.components_dropped} smaller pieces left out" if self.components_dropped else "")
        parts.append("the data is open, the mesh closes it where there are no points" if self.openness > OPEN else "")
        return ", ".join(part for part in parts if part)
