"""Parameters of tests that are tried every night only."""

from __future__ import annotations

import pytest


def nightly(*values):
    """The parameters, those that are tuples as several arguments."""
    each = (value if isinstance(value, tuple) else (value,) for value in values)
    return [pytest.param(*arguments, marks=pytest.mark.nightly) for arguments in each]
