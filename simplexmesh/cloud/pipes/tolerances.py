"""What counts as one on pipes: lengths in radii of the pipe, angles, shares of the radius."""

import numpy as np

FEWEST = 100
"""Points from which a cylinder is told (Chaperon 2002, 6.1.2)."""

BAND = 0.3
"""Distance from the surface, or the axis, within which points may be of a pipe before it is refined."""

LOOSE = 0.1
"""Root mean square of such distances of what is traced, and scale of the first loss."""

FACING = 0.7
"""Cosine of the angle between the normals of a pipe and of its points: those of walls differ more."""

NEAR = 3.0
"""Distance from a pick or an axis of what is looked at: what is near the surface, and its neighbors."""

SHORT = 1.5
"""Length from which a piece of pipe has a direction of its own."""

MEETING = 0.5
"""Distance between axes that meet."""

PARALLEL = np.radians(3)
"""Angle between axes that are one: welds are straight within 1 or 2 degrees (Chaperon 2002, 3.1.3)."""

TRIED = 40
"""Radii that are tried for a bend, in equal ratios."""

SLIGHT = np.radians(10)
"""Angle between directions traced or fitted to little, or between normals, that may be one."""

SEEN = 0.2
"""Share of the points that are usual on a pipe from which a part of it is seen."""

ALIKE = 0.08
"""Share by which the radii of two parts may differ that are one pipe."""
