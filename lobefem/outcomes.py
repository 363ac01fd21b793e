"""Words in results that several rooms use: kinds of modes, and verdicts that are no number."""

from __future__ import annotations

__all__ = ["RIGID", "UNDECIDED", "UNKNOWN"]

UNDECIDED = "undecided"  # the verdict where tension-field film's bounds lie on both sides of zero

RIGID = "rigid rotation"  # the kind of a mode that is one, of the whole balloon, which supports leave free

# the outcome of a release that ends in balance, but whose lowest eigenvalue could not be computed
UNKNOWN = "at rest, stability unknown"
