"""Chapter I, the mesh: connectivity, geometry, duality, shapes, checks; operators, decimation, triangles."""
