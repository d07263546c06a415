"""Chapter I, the mesh: connectivity, geometry, duality, shapes."""
