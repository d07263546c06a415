"""What the automatic start found and decided."""

from __future__ import annotations

from dataclasses import dataclass

OPEN = 0.25


@dataclass(frozen=True)
class StartReport:
    """What the automatic start found and decided.

    Attributes
    ----------
    grid : tuple of int
        Cells of the grid that decided the topology.
    cell : float
        Their size, in the unit of the data.
    genus : int
        Of the mesh, over all its components.
    components : int
        Of the mesh.
    tunnels_removed : int
        Sealed because they are too small for the mesh.
    components_dropped : int
        Smaller pieces left out.
    openness : float
        For points: how far they are from enclosing a body, 0 when they do, 0.1 to 0.25 for bodies scanned from all
        sides but one, above that for surfaces with little behind them.
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
