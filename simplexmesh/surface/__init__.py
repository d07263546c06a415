"""Chapter V, the surface: normals, curvature, saliency, regions and landmarks, measured on unprocessed scans."""
