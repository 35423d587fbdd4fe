"""Every kernel against its listing in C: outcome and t (and u, v) equal to the last bit.

The digests are those of the C program (listings.c, gcc -O2 -ffp-contract=off), so that the test
needs no compiler; where there is one, they are computed again. To see them after a change of the
listings: `python tests/kernels/test_transcription.py`.
"""

import ctypes
import functools
import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest

from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import REAL_TYPE, fill
from rtbench.compiled.loops import loop
from rtbench.kernels.registry import all_kernels
from rtbench.records.store import load_run
from rtbench.workloads.pairs import random_pairs

N = 1_000_000
REAL = {"float32": "float", "float64": "double"}
# The workload of tables 4.1 to 4.5 (16-bit coordinates: exact zeros and ties), and 24-bit ones.
WORKLOADS = {"msvc": 24660781, "pcg64": 2007}
COMPILER = shutil.which(os.environ.get("CC", "gcc"))
DIGESTS = {
    ("badouel", "float32", "msvc"): "478979411e32e434cc6b290c",
    ("badouel", "float32", "pcg64"): "7f371acd8ac4a9eef1f6f482",
    ("badouel", "float64", "msvc"): "6f48a2e9923ab18200d10614",
    ("badouel", "float64", "pcg64"): "6f9d123f586e13c7018ca43b",
    ("badouel_uv", "float32", "msvc"): "730f425c2654c50f17c720a1",
    ("badouel_uv", "float32", "pcg64"): "4dbd536d75f62641101534c7",
    ("badouel_uv", "float64", "msvc"): "2776e4cd3ec7ae30bd9e6c41",
    ("badouel_uv", "float64", "pcg64"): "829228a7263fbc9e6ad238dd",
    ("chirkov", "float32", "msvc"): "deed012eb6771dccb4a2cd56",
    ("chirkov", "float32", "pcg64"): "2aac808ce0bd37894abe21ae",
    ("chirkov", "float64", "msvc"): "17e7398e1067bd6b2307956e",
    ("chirkov", "float64", "pcg64"): "2c4b2d0f76432e82308b785c",
    ("chirkov_uv", "float32", "msvc"): "84bc8bbd9188e7cb6230a4b2",
    ("chirkov_uv", "float32", "pcg64"): "be13024c30dab12e4665ca9b",
    ("chirkov_uv", "float64", "msvc"): "2ed485030ec210c2e79d8942",
    ("chirkov_uv", "float64", "pcg64"): "bb416c791b11f1d96874eef3",
    ("moller0", "float32", "msvc"): "c727eee97803555038b4721a",
    ("moller0", "float32", "pcg64"): "64738e774b66e95300d6db86",
    ("moller0", "float64", "msvc"): "a04d0a3d0ad4f137c150540e",
    ("moller0", "float64", "pcg64"): "5e222bc3b24fb9b49b36912f",
    ("moller0_uv", "float32", "msvc"): "70eea7bd6d3ec6ed1048cdf9",
    ("moller0_uv", "float32", "pcg64"): "a58ece2205b76bd0a2424565",
    ("moller0_uv", "float64", "msvc"): "ac79327f6ec1f98a92e1bf2e",
    ("moller0_uv", "float64", "pcg64"): "83833c9d5bf4e7ee75a9513a",
    ("moller1", "float32", "msvc"): "239448d3c3f9aec0ad966fce",
    ("moller1", "float32", "pcg64"): "5b83b32345fb753e79043b64",
    ("moller1", "float64", "msvc"): "fdd2a11da4350858238cc287",
    ("moller1", "float64", "pcg64"): "ea97037d45fd794c53ce5e93",
    ("moller1_uv", "float32", "msvc"): "975594787693c3e5d083e237",
    ("moller1_uv", "float32", "pcg64"): "d106d8577edbf9d426cee8f4",
    ("moller1_uv", "float64", "msvc"): "c1aa21769306bd7d3c6d7740",
    ("moller1_uv", "float64", "pcg64"): "3c9876b590b1639de4e549e7",
    ("moller2", "float32", "msvc"): "239448d3c3f9aec0ad966fce",
    ("moller2", "float32", "pcg64"): "5b83b32345fb753e79043b64",
    ("moller2", "float64", "msvc"): "fdd2a11da4350858238cc287",
    ("moller2", "float64", "pcg64"): "ea97037d45fd794c53ce5e93",
    ("moller2_uv", "float32", "msvc"): "975594787693c3e5d083e237",
    ("moller2_uv", "float32", "pcg64"): "d106d8577edbf9d426cee8f4",
    ("moller2_uv", "float64", "msvc"): "c1aa21769306bd7d3c6d7740",
    ("moller2_uv", "float64", "pcg64"): "3c9876b590b1639de4e549e7",
    ("moller3", "float32", "msvc"): "239448d3c3f9aec0ad966fce",
    ("moller3", "float32", "pcg64"): "5b83b32345fb753e79043b64",
    ("moller3", "float64", "msvc"): "fdd2a11da4350858238cc287",
    ("moller3", "float64", "pcg64"): "ea97037d45fd794c53ce5e93",
    ("moller3_uv", "float32", "msvc"): "975594787693c3e5d083e237",
    ("moller3_uv", "float32", "pcg64"): "d106d8577edbf9d426cee8f4",
    ("moller3_uv", "float64", "msvc"): "c1aa21769306bd7d3c6d7740",
    ("moller3_uv", "float64", "pcg64"): "3c9876b590b1639de4e549e7",
}


@functools.cache
def workload(generator: str):
    return random_pairs(N, generator, WORKLOADS[generator])


@functools.cache
def records(generator: str, precision: str):
    """Return the thesis's TRIANGLEs and RAYs, the same for C and for rtbench."""
    pairs = workload(generator)
    vertices = pairs.v0, pairs.v1, pairs.v2
    badouel = all_kernels()["badouel"]
    return fill(badouel, "shared", precision, vertices, pairs.orig, pairs.dir, pairs.end)


def digest(*outputs: np.ndarray) -> str:
    """Return a digest of the bits of outputs, every NaN as the same one."""
    sha = hashlib.sha256()
    for values in outputs:
        if values.dtype.kind == "f":
            values = np.where(np.isnan(values), values.dtype.type(np.nan), values)
        sha.update(np.ascontiguousarray(values, values.dtype.newbyteorder("<")))
    return sha.hexdigest()[:24]


def in_c(library: ctypes.CDLL, name: str, precision: str, generator: str) -> list[np.ndarray]:
    tris, rays = records(generator, precision)
    outputs = [np.full(N, -1, np.int32), *(np.zeros(N, REAL_TYPE[precision]) for _ in range(3))]
    pointers = [ctypes.c_void_p(each.ctypes.data) for each in (tris, rays, *outputs)]
    getattr(library, f"run_{name}")(ctypes.c_int64(N), *pointers)
    return outputs


def built(folder: Path) -> dict[str, ctypes.CDLL]:
    """Compile the listings in both precisions."""
    libraries = {}
    for precision, real in REAL.items():
        target = folder / f"listings-{precision}.so"
        flags = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", f"-DREAL={real}"]
        source = Path(__file__).with_name("listings.c")
        subprocess.run([COMPILER, *flags, str(source), "-o", str(target), "-lm"], check=True)
        libraries[precision] = ctypes.CDLL(str(target))
    return libraries


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    if COMPILER is None:
        pytest.skip("no C compiler: the digests that are kept stand for it")
    return built(tmp_path_factory.mktemp("c"))


def test_every_kernel_has_a_listing():
    """Methods of pieces are printed as formulas, not as code; so is the angle sum.

    What takes tmax is later than the theses.
    """
    listings = {
        name
        for name, kernel in all_kernels().items()
        if kernel.ending is None and not kernel.takes_tmax
    }
    assert {name for name, *_ in DIGESTS} == listings - {"angle_sum"}


@pytest.mark.parametrize(("name", "precision", "generator"), DIGESTS)
def test_answers_are_those_of_the_listing_bit_for_bit(name, precision, generator):
    kernel = all_kernels()[name]
    compiled = loop(kernel, precision)
    outputs = run_once(compiled, kernel, precision, *records(generator, precision))
    assert digest(*outputs) == DIGESTS[name, precision, generator]


@pytest.mark.parametrize(("name", "precision", "generator"), DIGESTS)
def test_the_digest_is_that_of_the_c_program(name, precision, generator, libraries):
    found = digest(*in_c(libraries[precision], name, precision, generator))
    assert found == DIGESTS[name, precision, generator]


def test_a_digest_tells_one_bit_and_no_nan_from_another():
    t = np.array([0.5, np.nan], np.float32)
    other = t.copy()
    other.view(np.uint32)[1] |= 1 << 31  # a NaN with the sign that x86 gives 0 / 0
    assert digest(t) == digest(other)
    other.view(np.uint32)[0] ^= 1
    assert digest(t) != digest(other)


def test_moller1_gives_the_published_counts_of_table_4_5():
    published = load_run("blecha-pc1").outcomes
    published = published[(published["kernel"] == "moller1") & (published["table"] == "4.5")]
    kernel = all_kernels()["moller1"]
    compiled = loop(kernel, "float32")
    outcome, *_ = run_once(compiled, kernel, "float32", *records("msvc", "float32"))
    ours = dict(enumerate(np.bincount(outcome).tolist()))
    assert ours == dict(zip(published["outcome"], published["count"], strict=True))
    assert sum(ours.values()) == N


@pytest.mark.parametrize("precision", REAL)
@pytest.mark.parametrize("generator", WORKLOADS)
def test_badouel_tells_t_wherever_it_has_one(precision, generator):
    kernel = all_kernels()["badouel"]
    compiled = loop(kernel, precision)
    outcome, t, *_ = run_once(compiled, kernel, precision, *records(generator, precision))
    assert np.array_equal(np.isnan(t), outcome == 1)
    assert {3, 4} <= set(outcome.tolist())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        made = built(Path(folder))
        for name in dict.fromkeys(name for name, *_ in DIGESTS):
            for precision in REAL:
                for generator in WORKLOADS:
                    found = digest(*in_c(made[precision], name, precision, generator))
                    print(f'    ("{name}", "{precision}", "{generator}"): "{found}",')
