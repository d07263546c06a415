"""Triangle meshes cut by planes, by one another, and into smaller triangles."""
