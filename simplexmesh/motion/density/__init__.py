"""Where vertices are needed: refinement and redistribution."""
