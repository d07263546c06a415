"""What every room stands on; importing it prepares the environment in which numba is imported later."""

from simplexmesh._base import cache

cache.ensure()
