"""Fields on surfaces: saliency, salient points, surface types, regions, level lines."""
