"""The Standard Procedural Databases, where RTBENCH_SCENES names a folder that has them."""

import os
from pathlib import Path

import pytest


@pytest.fixture
def spd():
    """Return the path of an SPD file by its name; skip the test without it."""

    def found(name):
        folder = os.environ.get("RTBENCH_SCENES")
        if not folder:
            pytest.skip("RTBENCH_SCENES names no folder of SPD scenes")
        path = Path(folder) / name
        if not path.is_file():
            pytest.skip(f"RTBENCH_SCENES has no {name}")
        return path

    return found
