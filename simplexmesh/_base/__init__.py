"""What every room stands on; importing it prepares the environment in which numba is imported later."""

import os

from simplexmesh._base import cache

cache.ensure()

# Read when the first parallel kernel starts its threads: waiting threads sleep. Spinning ones hold the core that the
# thread they wait for needs, so that on a busy machine each call costs the scheduler's time slice, 4 to 8 ms.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
