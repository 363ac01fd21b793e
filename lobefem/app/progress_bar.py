"""Progress of a run on stderr: a bar and the time left on a terminal, plain lines elsewhere."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from lobefem.log import logger
from lobefem.progress import Progress, announced, share_of
from lobefem.terminal import console, is_terminal

__all__ = ["Clock", "reporting"]

EVERY = 10.0  # [s] from plain line to plain line

# the time left is not told from less than three seconds, or from little of the work in less than a minute
_LEAST, _LITTLE, _LONG = 3.0, 0.03, 60.0


class Clock:
    """The time left of a study, or of its present part, from the shares of its work that were done.

    Args:
        now: tells the time [s].
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._begin: tuple[float, float] | None = None
        self.share: float | None = None
        self._end: float | None = None

    def tell(self, share: float | None) -> None:
        """Show that a share of the work is done; one below the last begins another part."""
        now = self._now()
        if share is None or self.share is None or share < self.share:
            self._begin, self._end = (None if share is None else (now, share)), None
        elif self._begin is not None and share > self._begin[1]:
            then, first = self._begin
            took, done = now - then, share - first
            if took >= _LEAST and (done >= _LITTLE or took >= _LONG):
                left = took * (1 - share) / done
                if self._end is not None:  # parts are not equally long, and the clock must not jump
                    left = (left + max(self._end - now, 0.0)) / 2
                self._end = now + left
        self.share = share

    def left(self) -> str:
        """As 'about 2:05 left', "" while nothing is known."""
        if self._end is None or self.share == 1.0:
            return ""
        seconds = max(round(self._end - self._now()), 0)
        hours, minutes = seconds // 3600, seconds // 60 % 60
        clock = f"{hours}:{minutes:02}:{seconds % 60:02}" if hours else f"{minutes}:{seconds % 60:02}"
        return f"about {clock} left"


@contextmanager
def reporting(
    is_root: bool, stop: Any, *, quiet: bool = False, verbose: bool = False
) -> Iterator[Progress | None]:
    """A context with the `progress` callback of a run; None where nothing is to be shown.

    Args:
        is_root: whether this is rank 0, which alone speaks.
        stop: what ends the run early (`lobefem.app.process.Stop`); it takes the bar away.
        quiet: show nothing.
        verbose: show every line of the log.
    """
    if quiet or not is_root:
        yield None
        return
    shown: Any = _Bar() if is_terminal(sys.stderr) else _Lines(silent=verbose)
    handler = _Log(shown.say)
    level = logger.level
    if verbose:
        logger.setLevel(logging.INFO)
        logger.addHandler(handler)
    stop.hush = shown.close
    try:
        with announced(shown):
            yield shown
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
        stop.hush = lambda: None
        shown.close()


class _Log(logging.Handler):
    """The log's lines, passed on."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__(logging.INFO)
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        self._say(self.format(record))


class _Lines:
    """Progress as plain lines, one every ten seconds."""

    def __init__(self, silent: bool) -> None:
        self._clock, self._silent, self._begin = Clock(), silent, time.monotonic()
        self._last = self._begin

    def __call__(self, text: str) -> None:
        self._clock.tell(share_of(text))
        now = time.monotonic()
        if self._silent or now < self._last + EVERY:
            return
        self._last = now
        share = self._clock.share
        done = () if share is None else (f"{share:.0%} done", self._clock.left())
        told = ", ".join(part for part in (text, *done) if part)
        self.say(f"lobefem: [{now - self._begin:.0f} s] {told}")

    @staticmethod
    def say(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    def close(self) -> None:
        pass


class _Bar:
    """Progress as a line that moves."""

    def __init__(self) -> None:
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        self._clock = Clock()
        bar = BarColumn(bar_width=12)
        left = TextColumn("{task.fields[clock]}", markup=False)
        text = TextColumn("{task.description}", markup=False)
        self._progress = Progress(
            SpinnerColumn("line"), bar, left, text, console=console(sys.stderr), transient=True
        )
        self._task = self._progress.add_task("setting up", total=None, clock=_Left(self._clock))
        self._progress.start()

    def __call__(self, text: str) -> None:
        share = share_of(text)
        self._clock.tell(share)
        known: dict[str, Any] = {"total": None} if share is None else {"total": 1.0, "completed": share}
        self._progress.update(self._task, description=str(text), **known)

    def say(self, line: str) -> None:
        self._progress.console.print(line, markup=False, highlight=False)

    def close(self) -> None:
        self._progress.stop()


class _Left:
    """A clock's time left, when it is drawn."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def __format__(self, spec: str) -> str:
        share = self._clock.share
        return "" if share is None else f"{share:4.0%} {self._clock.left()}"
