"""The level at which an indicator bounds a solid whose genus lasts.

The genus changes little from level to level, but where a wall or a gap is hardly thicker than the noise or the spacing
of points: there holes open and bridges grow one after the other. If at one genus the levels in a row are twice as many
as at any other, it is that of the solid; else the points do not tell it.
"""

from __future__ import annotations

from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._base.arrays import Array, Mask
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.motion.start.topology import genus, pieces, thinned, without_cavities

NEARBY = 0.05
"""Levels up to which, the jump being 1, the genus at 0 must stay the same to be believed as it is."""

FARTHEST, STEP = 0.3, 0.025
"""Levels looked at where it does not."""

LASTING = 2.0
"""Ratio of the levels in a row at the genus that lasts longest and at any other; few of either say nothing."""


def lasting_level(field: NDArray[Any], components: str = "largest", smallest: float = 0.0) -> tuple[float, Array]:
    """Return the level nearest to 0 at which the genus of the solid in a field lasts, and places of doubt, in cells.

    The places (m, 3) are where handles come and go next to level 0, if no genus lasts; otherwise there are none.
    """
    box = box_around(field > -FARTHEST)
    assert box is not None  # the mean at the points is 0
    around = box_slices(*box, field.shape, margin=1)

    def solid_at(level: float) -> Mask:
        return without_cavities(pieces(field[around] > level, components, smallest)[0])

    def genus_at(level: float) -> int:
        return genus(solid_at(level))

    if len({genus_at(level) for level in (-NEARBY, 0.0, NEARBY)}) == 1:
        return 0.0, np.zeros((0, 3))
    count = round(FARTHEST / STEP)
    levels = (STEP * np.arange(-count, count + 1)).tolist()
    runs = [(number, list(run)) for number, run in groupby(levels, key=genus_at)]
    best, longest = max(runs, key=lambda run: len(run[1]))
    others = max((len(run) for number, run in runs if number != best), default=0)
    if len(longest) >= max(LASTING * others, 2 * NEARBY / STEP):
        return min(longest, key=abs), np.zeros((0, 3))
    kept = solid_at(NEARBY)
    label, found = ndimage.label(thinned(solid_at(-NEARBY), kept) & ~kept, np.ones((3, 3, 3)))
    centers = ndimage.center_of_mass(label > 0, label, np.arange(found) + 1)
    return 0.0, np.reshape(centers, (-1, 3)) + [side.start for side in around]
