"""What is said of a run on its way: plain lines, a bar, and the time left."""

import io
import sys

import pytest

from lobefem.app import cli, progress_bar
from lobefem.app.process import Stop
from lobefem.app.progress_bar import Clock
from lobefem.log import logger
from lobefem.progress import announce, part, plain, said, share_of


@pytest.mark.serial
def test_a_line_knows_how_far_a_study_is():
    assert share_of("no idea") is None
    line = said("half", 0.5)
    assert (line, share_of(line)) == ("half", 0.5)
    assert share_of(said("beyond", 1.5)) == 1.0
    lines = []
    second = part(lines.append, 0.5, 1.0)
    second("begins")
    second(said("goes on", 0.5))
    assert [(str(line), share_of(line)) for line in lines] == [("begins", 0.5), ("goes on", 0.75)]
    assert part(None, 0, 1) is None
    plain(lines.append)(said("no share", 1.0))
    assert (lines[-1], share_of(lines[-1])) == ("no share", None)
    assert plain(None) is None


@pytest.mark.serial
def test_the_time_left_is_in_proportion_to_what_was_done_in_this_run():
    now = 0.0
    clock = Clock(lambda: now)
    clock.tell(None)
    assert clock.left() == ""
    clock.tell(0.4)  # a run that goes on begins here
    now = 60.0
    clock.tell(0.5)
    assert clock.left() == "about 5:00 left"
    now = 90.0
    assert clock.left() == "about 4:30 left"
    clock.tell(0.1)  # another part of the study
    assert clock.left() == ""
    now = 5490.0
    clock.tell(0.5)
    assert clock.left() == "about 1:52:30 left"


@pytest.mark.serial
def test_the_time_left_does_not_jump():
    """A part that takes longer than the ones before moves it by half of the way."""
    now = 0.0
    clock = Clock(lambda: now)
    clock.tell(0.0)
    now = 10.0
    clock.tell(0.5)
    assert clock.left() == "about 0:10 left"
    now = 30.0
    clock.tell(0.6)  # in proportion 20 s; at the pace of before it would have ended
    assert clock.left() == "about 0:10 left"


@pytest.mark.serial
@pytest.mark.parametrize(
    ("seconds", "share", "said"),
    [
        (2.9, 0.5, ""),  # a start says little of what follows
        (30.0, 0.02, ""),
        (3.0, 0.5, "about 0:03 left"),
        (60.0, 0.01, "about 1:39:00 left"),
    ],
)
def test_nothing_is_said_of_the_time_left_before_it_is_known(seconds, share, said):
    now = 0.0
    clock = Clock(lambda: now)
    clock.tell(0.0)
    now = seconds
    clock.tell(share)
    assert clock.left() == said


def test_plain_lines_where_there_is_no_terminal(monkeypatch, capfd, comm):
    monkeypatch.setattr(progress_bar, "EVERY", 0.0)
    arguments = ["inflate", "meshes/single.toml", "--divisions", "4x8"]
    monkeypatch.chdir(__file__.rpartition("/tests/")[0])
    assert cli.main(arguments) == 0
    err = capfd.readouterr().err
    if comm.rank == 0:
        line = err.splitlines()[-1]
        assert line.startswith("lobefem: [")
        assert line.endswith("100% done")
        assert "s] inflate 1000 Pa: converged" in line
    else:
        assert err == ""
    assert cli.main([*arguments, "--quiet"]) == 0
    assert capfd.readouterr().err == ""


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


@pytest.mark.parametrize("colour", [True, False])
def test_a_bar_on_a_terminal(monkeypatch, comm, colour):
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    for name in ("NO_COLOR", "FORCE_COLOR", "COLUMNS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "120")
    if not colour:
        monkeypatch.setenv("NO_COLOR", "1")
    stop, level = Stop(), logger.level
    with progress_bar.reporting(True, stop, verbose=True) as progress:
        progress(said("modes at 5 [Pa]", 0.25))
        logger.info("what a step did")
        stop.hush()  # as Ctrl-C does, before the end
    shown = screen.getvalue()
    assert " 25%" in shown
    assert "modes at 5 [Pa]" in shown
    assert ("what a step did\n" in shown) == (comm.rank == 0)  # the log is rank 0's
    assert shown.count("\x1b[?25l") == shown.count("\x1b[?25h") == 1  # the cursor comes back
    assert ("\x1b[3" in shown) == colour
    assert logger.level == level


def test_what_takes_its_time_below_a_study_is_shown_too(monkeypatch):
    """A form that is compiled, say, to which no study passes its progress down."""
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    for name, value in (("TERM", "xterm"), ("COLUMNS", "120")):
        monkeypatch.setenv(name, value)
    with progress_bar.reporting(True, Stop()):
        announce("compiling form 3")
    announce("compiling form 4")  # nobody listens
    assert "compiling form 3" in screen.getvalue()
    assert "compiling form 4" not in screen.getvalue()
