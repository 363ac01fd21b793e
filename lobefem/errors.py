"""Typed errors: what happened, the value, and what to try.

Two families, because a user must do different things about them (and the command line returns
different exit codes): bad input (`InputError`, exit 2) and a computation that failed although its
input was sound (`SolveError`, exit 3).
"""

from __future__ import annotations

from typing import Any

__all__ = [
    "ConvergenceError",
    "EigenError",
    "InputError",
    "LobefemError",
    "MissingDependencyError",
    "SolveError",
]


class LobefemError(Exception):
    """Base of every error that lobefem raises on purpose."""

    exit_code = 1


class InputError(LobefemError, ValueError):
    """An argument, a design file or a mesh that cannot be used; says which value and what to try."""

    exit_code = 2


class MissingDependencyError(LobefemError, ImportError):
    """A part of the installation is missing; says what to install.

    Args:
        message: what is missing, maybe with what to do.
        advice: what to do, where the message does not say it.
    """

    exit_code = 2

    def __init__(self, message: str, advice: str = "") -> None:
        super().__init__(f"{message}; {advice}" if advice else message)
        self.advice = advice


class SolveError(LobefemError, RuntimeError):
    """A computation with sound input failed.

    Args:
        message: what failed, with the figures that matter, and what to try.
        **data: the same figures for a program to read (kept in `data`).

    Attributes:
        state: the last equilibrium that was found before, or None.
    """

    exit_code = 3
    state: Any = None

    def __init__(self, message: str, **data: Any) -> None:
        super().__init__(message)
        self.data = data


class ConvergenceError(SolveError):
    """Newton's method found no equilibrium; `state` holds the last one that it did find, or None."""

    def __init__(self, message: str, *, state: Any = None, **data: Any) -> None:
        super().__init__(message, **data)
        self.state = state


class EigenError(SolveError):
    """The eigensolver returned fewer or worse pairs than were asked for."""
