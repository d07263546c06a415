"""Sharp edges of surfaces: normals without noise, jumps of the normal, edges cleaned up, lines and their nodes."""
