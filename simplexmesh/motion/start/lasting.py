"""The genus of the solid that an indicator bounds, and the level to cut it at: where it lasts.

It changes from level to level only where a wall or a gap is hardly thicker than the noise or the spacing of points:
there holes open and bridges grow one after the other. If at one genus the levels in a row are twice as many as at any
other, it is that of the solid; else the points do not tell it for sure, though most likely the one that lasts longest.
"""

from __future__ import annotations

from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._base.arrays import Array, Mask
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.motion.start.topology import euler, genus, pieces, thinned, within, without_cavities

NEARBY = 0.05
"""Levels up to which, the jump being 1, the genus at 0 must stay the same to be believed as it is."""

FARTHEST, STEP = 0.3, 0.025
"""Levels looked at where it does not."""

DEEPEST = -0.125
"""Least level at which a field is cut, a quarter of what it is outside: less fills all bores. Nor is it cut above 0,
where thin walls fall to pieces."""

LAYERS = 6.0
"""Of cells that a level may add: of thin walls it adds 3 to 5, lids of open data move by 40."""

LASTING = 2.0
"""Ratio of the levels in a row at the genus that lasts longest and at any other; few of either say nothing."""


class Lasting(NamedTuple):
    """The genus that lasts, the level where a field is cut, and (m, 3) places, in cells, of handles that do not last.

    Of one that lasts at 0 or can be had there are no places, else the level is 0, and they are where handles come or
    go next to it.
    """

    genus: int
    level: float
    places: Array


def lasting_genus(field: NDArray[Any], components: str = "largest", smallest: float = 0.0) -> Lasting:
    """Return the genus of the solid in a field that lasts over most levels in a row, and the level to cut it at."""
    box = box_around(field > -FARTHEST)
    assert box is not None  # the mean at the points is 0
    around = box_slices(*box, field.shape, margin=1)

    def solid_at(level: float) -> Mask:
        return without_cavities(pieces(field[around] > level, components, smallest)[0])

    def genus_at(level: float) -> int:
        solid = solid_at(level)
        return int(solid.any()) - euler(solid) if components == "largest" else genus(solid)

    nearby = {genus_at(level) for level in (-NEARBY, 0.0, NEARBY)}
    if len(nearby) == 1:
        return Lasting(nearby.pop(), 0.0, np.zeros((0, 3)))
    count = round(FARTHEST / STEP)
    levels = [STEP * k for k in range(-count, count + 1)]
    runs = [(number, list(run)) for number, run in groupby(levels, key=genus_at)]
    best, longest = max(runs, key=lambda run: (len(run[1]), -min(map(abs, run[1]))))
    others = max((len(run) for number, run in runs if number != best), default=0)
    level = min(longest, key=abs)
    lasts = len(longest) >= max(LASTING * others, 2 * NEARBY / STEP)
    if lasts and DEEPEST <= level <= 0 and (within(solid_at(0.0), LAYERS) >= solid_at(level)).all():
        return Lasting(best, level, np.zeros((0, 3)))
    kept = solid_at(NEARBY)
    label, found = ndimage.label(thinned(solid_at(-NEARBY), kept) & ~kept, np.ones((3, 3, 3)))
    centers = ndimage.center_of_mass(label > 0, label, np.arange(found) + 1)
    return Lasting(best, 0.0, np.reshape(centers, (-1, 3)) + [side.start for side in around])
