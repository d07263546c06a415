"""Chapter II, the data: volumes, point clouds, triangle meshes, and their file formats."""

from simplexmesh import _cache

_cache.ensure()
