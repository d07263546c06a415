"""Parts in contact: occlusion under constraints."""
