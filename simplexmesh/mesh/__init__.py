"""Chapter I, the mesh: connectivity, geometry, duality, shapes, editing operators, decimation."""

from simplexmesh import _cache

_cache.ensure()
