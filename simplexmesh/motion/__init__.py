"""Chapter III, the motion: the deformable model, its targets and start, topology, density, reconstruction."""
