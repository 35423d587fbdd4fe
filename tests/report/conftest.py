"""Run folders as the schema describes them, and the runs loaded from them."""

import importlib.util
from pathlib import Path

import pytest

from rtbench.records.store import load_run


@pytest.fixture(scope="session")
def sample_runs():
    spec = importlib.util.spec_from_file_location(
        "sample_runs", Path(__file__).with_name("sample_runs.py")
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def make(sample_runs, tmp_path):
    """Return a function that writes a run of an experiment and loads it."""

    def write_and_load(experiment: str, name: str = "", **options):
        folder = tmp_path / (name or f"a-{experiment}")
        return load_run(getattr(sample_runs, f"{experiment}_run")(folder, **options))

    return write_and_load


@pytest.fixture
def published():
    return lambda name: load_run(name, Path("no-such-folder"))
