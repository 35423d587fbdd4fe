"""Runs without anybody watching, and a way to stop one."""

import csv
from collections import defaultdict

import pytest

from rtbench.experiments import run
from rtbench.experiments.config import Config


class Nobody:
    """Watches a run and says nothing."""

    def say(self, text):
        self.said = text

    def plan(self, text):
        self.planned = text

    def progress(self, fraction):
        self.done = fraction


@pytest.fixture
def nobody():
    return Nobody


@pytest.fixture
def go(tmp_path):
    """Return a run of what a config says."""

    def started(config=None, out=tmp_path / "results", watcher=None, **changes):
        config = (config or Config()).changed(**changes)
        return run.start(config, watcher or Nobody(), out, "test")

    return started


def rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def table():
    """Return a CSV of a run as a list of dicts of texts."""
    return lambda done, name: rows(done.path / name)


@pytest.fixture
def substance():
    """Return what is in a run but its times: what an unbroken run and a resumed one share."""

    def of(done):
        repetitions = defaultdict(int)
        places = []
        cell = [*done.info["cell"], "outcome"]
        for row in rows(done.path / "samples.csv"):
            key = tuple(row[name] for name in cell)
            repetitions[key, row["triangles"]] += int(row["repetitions"])
            places.append((key, row["triangles"], row["process"], row["round"]))
            assert row["ns"].isdigit() and row["cpu_ns"].isdigit()
            assert int(row["tests"]) == int(row["triangles"]) * int(row["repetitions"])
        assert len(set(places)) == len(places), "a sample is there twice"
        return {
            "repetitions": dict(repetitions),
            "places": sorted(places),
            "hits": sorted(
                (r["kernel"], r["order"], r["density"], r["hits"], r["tests"])
                for r in rows(done.path / "summary.csv")
            ),
            "outcomes": [
                (r["kernel"], r["density"], r["outcome"], r["count"], r["fraction"])
                for r in rows(done.path / "outcomes.csv")
            ],
            "workloads": done.info["workloads"],
            "config": done.info["config"],
        }

    return of
