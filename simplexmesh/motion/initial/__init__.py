"""The automatic start of the motion: a closed mesh of the right topology, a few cells from the data everywhere."""

from __future__ import annotations
