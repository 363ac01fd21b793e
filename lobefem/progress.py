"""Lines of progress that know how far a study is.

A caller passes any function of a string, `print` say. What it is given is a string all the same; one that
shows the time left also asks `share_of` it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["Progress", "announce", "announced", "part", "plain", "said", "share_of"]

Progress = Callable[[str], None]

_hearers: list[Progress] = []


class _Said(str):
    share: float


def said(text: str, share: float) -> str:
    """A line of progress.

    Args:
        text: what goes on.
        share: of the work that is done, 0 to 1.
    """
    line = _Said(text)
    line.share = min(max(share, 0.0), 1.0)
    return line


def share_of(text: str) -> float | None:
    """The share of the work that is done, None where the line does not say."""
    return getattr(text, "share", None)


def part(progress: Progress | None, first: float, last: float) -> Progress | None:
    """The callback for a part of a study, which takes it from one share of the work to another."""
    if progress is None:
        return None

    def report(text: str) -> None:
        progress(said(text, first + (share_of(text) or 0.0) * (last - first)))

    return report


def plain(progress: Progress | None) -> Progress | None:
    """The callback for a part of a study that does not know its share of the work."""
    if progress is None:
        return None
    return lambda text: progress(str(text))


@contextmanager
def announced(progress: Progress) -> Iterator[None]:
    """For this time a line is also told of what no study passes a `progress` down to."""
    _hearers.append(progress)
    try:
        yield
    finally:
        _hearers.remove(progress)


def announce(text: str) -> None:
    """Tell whoever listens what takes its time deep below a study."""
    for progress in _hearers:
        progress(text)
