"""Chapter IV, the recognition: shape signatures, registration, libraries of models, contact."""
