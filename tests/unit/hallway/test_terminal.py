"""What is a terminal, and what is shown there and elsewhere."""

import fcntl
import io
import os
import pty
import select
import struct
import sys
import termios
from contextlib import contextmanager

import pytest

from lobefem.app import cli
from lobefem.app.doctor import Finding
from lobefem.app.process import Stop
from lobefem.app.progress_bar import reporting
from lobefem.app.tables import show_findings, show_rows
from lobefem.progress import said
from lobefem.terminal import console, is_terminal, settle


@contextmanager
def screen(columns):
    """A pseudo-terminal, of no columns as Open MPI gives its ranks, and what was written to it."""
    reader, writer = pty.openpty()
    fcntl.ioctl(writer, termios.TIOCSWINSZ, struct.pack("HHHH", 24 if columns else 0, columns, 0, 0))
    with os.fdopen(writer, "w") as stream:

        def shown():
            stream.flush()
            data = b""
            while select.select([reader], [], [], 0.3)[0]:  # the kernel hands it over by and by
                data += os.read(reader, 4096)
            return data.decode().replace("\r\n", "\n")

        yield stream, shown
    os.close(reader)


@pytest.fixture(autouse=True)
def _a_terminal_of_colours(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "COLUMNS", "LINES"):
        monkeypatch.delenv(name, raising=False)


def test_a_terminal_has_columns(tmp_path):
    for columns, true in ((0, False), (100, True)):
        with screen(columns) as (stream, _):
            assert stream.isatty()
            assert is_terminal(stream) is true
    with (tmp_path / "file").open("w") as stream:
        assert not is_terminal(stream)
    assert not is_terminal(io.StringIO())
    assert is_terminal(type("Window", (io.StringIO,), {"isatty": lambda self: True})())


def test_tables_on_a_terminal_without_columns_are_those_of_a_file(monkeypatch):
    rows = [("name", "value"), ("a" * 60, "b" * 60), ("c", "d")]
    findings = [Finding("compiler", True, "compiles forms"), Finding("MUMPS", False, "missing", "install it")]

    def shown_on(stream, shown):
        monkeypatch.setattr(sys, "stdout", stream)
        show_rows(rows)
        show_findings(findings)
        return shown()

    file = io.StringIO()
    plain = shown_on(file, file.getvalue)
    assert "a" * 60 in plain
    assert "\x1b" not in plain
    with screen(0) as (stream, shown):
        assert shown_on(stream, shown) == plain
    with screen(100) as (stream, shown):
        text = shown_on(stream, shown)
        assert "\x1b[32mok" in text
        assert "b" * 60 not in text  # a real terminal's width is a limit


def test_colours_that_are_forced_are_given_to_a_file(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    file = io.StringIO()
    console(file, 80).print("[red]no[/red]")
    assert file.getvalue() == "\x1b[31mno\x1b[0m\n"


def test_progress_without_columns_is_plain_lines(monkeypatch):
    monkeypatch.setattr("lobefem.app.progress_bar.EVERY", 0.0)
    for columns, bar in ((0, False), (100, True)):
        with screen(columns) as (stream, shown):
            monkeypatch.setattr(sys, "stderr", stream)
            with reporting(True, Stop()) as progress:
                progress(said("half of it", 0.5))
            text = shown()
            assert ("\x1b[?25l" in text) is bar
            assert ("s] half of it, 50% done\n" in text) is not bar


def test_libraries_that_ask_a_stream_themselves_are_told(monkeypatch, comm):
    with screen(0) as (stream, shown):
        monkeypatch.setattr(sys, "stdout", stream)
        settle()
        assert not stream.isatty()
        assert cli.main(["--help"]) == 0
        text = shown()
        assert ("Usage: lobefem" in text) == (comm.rank == 0)  # one rank speaks for all
        assert "\x1b" not in text
    with screen(100) as (stream, _):
        monkeypatch.setattr(sys, "stdout", stream)
        settle()
        assert stream.isatty()
