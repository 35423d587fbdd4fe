"""The bar: what it says at known times."""

import io

import pytest

from rtbench.cli import progress as module
from rtbench.cli.progress import Progress, bar


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    stand_in = Clock()
    monkeypatch.setattr(module, "time", stand_in)
    return stand_in


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_bar():
    assert bar(0.0, 0.0) == f"measuring [{'.' * 30}]   0 %"
    assert bar(0.5, 75) == f"measuring [{'#' * 15}{'.' * 15}]  50 %, 1:15 gone, 1:15 left"
    assert bar(0.25, 1800).endswith("25 %, 30:00 gone, 1:30:00 left")
    assert bar(1.0, 3).endswith("100 %, 0:03 gone, 0:00 left")


def test_on_a_terminal_a_line_takes_the_place_of_another(clock, monkeypatch):
    monkeypatch.setattr("sys.stderr", Terminal())
    watched = Progress()
    watched.say("compiling")
    watched.plan("9 cells")
    for tenth in range(1, 11):
        clock.now += 6
        watched.progress(tenth / 10)
    watched.end()
    before, after = module.sys.stderr.getvalue().split("9 cells\n")
    assert before == "\r\033[Kcompiling ...\r\033[K"
    lines = after.split("\r\033[K")
    assert lines[1] == bar(0, 0)
    assert lines[5].endswith("40 %, 0:24 gone, 0:36 left")
    assert len(lines) == 13 and lines[-1] == ""


def test_it_is_not_told_more_often_than_anybody_can_read(clock, monkeypatch):
    monkeypatch.setattr("sys.stderr", Terminal())
    watched = Progress()
    watched.plan("9 cells")
    for done in range(1000):
        clock.now += 1 / 1024
        watched.progress(done / 1000)
    assert module.sys.stderr.getvalue().count("left") == 9


def test_a_line_is_no_longer_than_the_terminal(clock, monkeypatch):
    monkeypatch.setattr("sys.stderr", Terminal())
    monkeypatch.setattr(module, "_columns", lambda: 40)
    watched = Progress()
    watched.say("drawing " * 20)
    assert len(module.sys.stderr.getvalue().removeprefix("\r\033[K")) == 39


def test_without_a_terminal_there_are_few_plain_lines(clock, monkeypatch):
    monkeypatch.setattr("sys.stderr", io.StringIO())
    watched = Progress()
    watched.say("compiling")
    watched.plan("9 cells")
    for done in range(1, 26):
        clock.now += 1
        watched.progress(done / 25)
    watched.end()
    assert module.sys.stderr.getvalue().splitlines() == ["9 cells", bar(0.4, 10), bar(0.8, 20)]


@pytest.mark.parametrize("stream", [Terminal, io.StringIO])
def test_quiet_says_nothing(clock, monkeypatch, stream):
    monkeypatch.setattr("sys.stderr", stream())
    watched = Progress(quiet=True)
    watched.say("compiling")
    watched.plan("9 cells")
    clock.now += 100
    watched.progress(0.5)
    watched.end()
    assert module.sys.stderr.getvalue() == ""
