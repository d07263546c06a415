"""Points of surveys, by libraries that are optional: LAS and LAZ, E57."""
