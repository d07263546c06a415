"""`simplexmesh demo`: organs of a frog."""

EXAMPLE = "x"


def command() -> None:
    """X."""
