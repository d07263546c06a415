"""Chapter III, the motion: forces, targets, the deformable model, reconstruction."""

from __future__ import annotations

import os

from simplexmesh import _cache

_cache.ensure()

# Read when the first parallel kernel starts its threads: waiting threads sleep. Spinning ones hold the core that the
# thread they wait for needs, so that on a busy machine each call costs the scheduler's time slice, 4 to 8 ms.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
