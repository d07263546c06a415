"""Chapter III, the motion: forces, targets, the deformable model, reconstruction."""
