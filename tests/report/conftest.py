"""Run folders as the schema describes them, and the runs loaded from them."""

import importlib.util
from pathlib import Path

import pytest

from rtbench.records.store import load_run


@pytest.fixture(scope="session")
def sample_runs():
    return _module("sample_runs")


@pytest.fixture(scope="session")
def soup_runs():
    return _module("soup_runs")


@pytest.fixture(scope="session")
def packet_runs():
    return _module("packet_runs")


@pytest.fixture(scope="session")
def tree_runs():
    return _module("tree_runs")


def _module(name: str):
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def make(sample_runs, soup_runs, packet_runs, tree_runs, tmp_path):
    """Return a function that writes a run of an experiment and loads it."""

    def write_and_load(experiment: str, name: str = "", **options):
        folder = tmp_path / (name or f"a-{experiment}")
        for module in (soup_runs, packet_runs, tree_runs):
            if write := getattr(module, f"{experiment}_run", None):
                return load_run(write(folder, sample_runs.write_run, **options))
        return load_run(getattr(sample_runs, f"{experiment}_run")(folder, **options))

    return write_and_load


@pytest.fixture
def published():
    return lambda name: load_run(name, Path("no-such-folder"))
