"""Cases survive their file, and a file that is not one is named in one line."""

import zipfile
from dataclasses import fields

import numpy as np
import pytest

from rtbench.accuracy.cases import CLASS_NAMES, EXPECT, Cases
from rtbench.errors import RtbenchError

N = 5


def arrays():
    rng = np.random.default_rng(1)
    vectors = {name: rng.normal(size=(N, 3)) for name in ("v0", "v1", "v2", "org", "dir")}
    numbers = ("difficulty", "t", "u", "v", "eta", "cond_t", "cond_u", "cond_v")
    found = vectors | {name: rng.normal(size=N) for name in numbers}
    found["t"][2], found["org"][1, 1], found["dir"][0] = np.nan, np.inf, [0.0, -0.0, 5e-324]
    found |= {"family": np.array([0, 1, 1, 0, 1], np.int16), "family_names": ("near", "far")}
    found |= {"f32_ok": np.array([True, False, True, True, False])}
    found |= {"cls": np.array([0, 1, 2, 11, 4], np.int8), "class_names": CLASS_NAMES}
    found |= {"expect": EXPECT[found["cls"]], "sos_hit": np.array([0, 1, 1, -1, 0], np.int8)}
    found |= {"group": np.array([-1, -1, 3, 3, -1], np.int32)}
    return found | {"group_rule": np.array([0, 1], np.int8)}


def assert_same(a, b):
    for field in fields(Cases):
        x, y = getattr(a, field.name), getattr(b, field.name)
        assert type(x) is type(y)
        if isinstance(x, np.ndarray):
            assert x.dtype == y.dtype and x.tobytes() == y.tobytes()
        else:
            assert x == y


def write(path, **changed):
    np.savez(path, **{k: v for k, v in (arrays() | changed).items() if v is not None})
    return path


def test_what_is_owed_by_class():
    owed = dict(zip(CLASS_NAMES, EXPECT.tolist(), strict=True))
    assert [name for name in owed if owed[name] == 1] == ["hit_interior"]
    either = ["hit_edge", "hit_vertex", "origin_on", "coplanar_touch", "degenerate_touch"]
    assert [name for name in owed if owed[name] == 2] == either


class TestFile:
    def test_round_trip(self, tmp_path):
        names = np.array(["", "teapot", "", "", "Möller"])
        cases = Cases(**arrays(), name=names, source=names[::-1])
        path = tmp_path / "corpus.anything"
        cases.save(path)
        cases.save(path)  # replaces
        assert [p.name for p in tmp_path.iterdir()] == ["corpus.anything"]
        assert_same(Cases.load(path), cases)
        assert_same(Cases.load(str(path)), cases)

    def test_names_and_sources_are_optional(self, tmp_path):
        cases = Cases.load(write(tmp_path / "c.npz"))
        assert cases.name.tolist() == cases.source.tolist() == [""] * N
        assert_same(cases, Cases(**arrays()))

    def test_no_cases(self, tmp_path):
        none = Cases(**arrays()).take(np.array([], int))
        none.save(tmp_path / "c.npz")
        assert len(Cases.load(tmp_path / "c.npz")) == 0

    def test_unknown_arrays_are_ignored_even_if_pickled(self, tmp_path):
        path = write(tmp_path / "c.npz", more=np.arange(3), objects=np.array([{}], object))
        assert_same(Cases.load(path), Cases(**arrays()))

    def test_other_integers_and_small_floats_are_taken(self, tmp_path):
        given = arrays()
        wider = {"family": given["family"].astype(np.uint64), "cls": given["cls"].astype(int)}
        path = write(tmp_path / "c.npz", **wider, eta=given["eta"].astype(np.float32))
        found = Cases.load(path)
        assert (found.family.dtype, found.cls.dtype, found.eta.dtype) == ("i2", "i1", "f8")

    @pytest.mark.parametrize(
        ("changed", "complaint"),
        [
            ({"eta": None}, "missing array 'eta'"),
            ({"eta": None, "t": None}, "missing array 't', 'eta'"),
            ({"v1": np.zeros((N, 4))}, r"array 'v1' must have the shape \(5, 3\), not \(5, 4\)"),
            ({"v0": np.zeros(N)}, r"array 'v0' must have the shape"),
            ({"u": np.zeros(N + 1)}, r"array 'u' must have the shape \(5,\), not \(6,\)"),
            ({"t": np.array(["1"] * N)}, "array 't' must be float64, not <U1"),
            ({"t": np.zeros(N, complex)}, "array 't' must be float64, not complex128"),
            ({"f32_ok": np.zeros(N)}, "array 'f32_ok' must be bool, not float64"),
            ({"cls": np.zeros(N)}, "array 'cls' must be int8, not float64"),
            ({"cls": np.full(N, 300)}, "array 'cls' has values that int8 does not hold"),
            ({"cls": np.full(N, 12)}, r"array 'cls' has 12 in row 0 \(allowed: 0 to 11\)"),
            ({"expect": np.array([0, 3, 0, 0, 0])}, "array 'expect' has 3 in row 1"),
            ({"sos_hit": np.full(N, -2)}, "array 'sos_hit' has -2 in row 0"),
            ({"family": np.full(N, 2)}, r"array 'family' has 2 in row 0 \(allowed: 0 to 1\)"),
            ({"group": np.full(N, -2)}, r"array 'group' has -2 in row 0 \(allowed: at least -1\)"),
            ({"group_rule": np.zeros(3, int)}, r"array 'group_rule' must have the shape \(2,\)"),
            ({"group_rule": np.array([0, 4])}, r"array 'group_rule' has 4 in row 1"),
            ({"family_names": np.arange(2)}, "array 'family_names' must be a list of texts"),
            ({"name": np.array(["a"])}, "array 'name' must have 5 texts, not 1"),
            ({"v0": np.array([[None] * 3] * N)}, "array 'v0' cannot be read: Object arrays"),
        ],
    )
    def test_bad_arrays_are_named(self, tmp_path, changed, complaint):
        path = write(tmp_path / "c.npz", **changed)
        with pytest.raises(RtbenchError, match=rf"c\.npz: {complaint}") as error:
            Cases.load(path)
        assert "\n" not in str(error.value)

    @pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04rest"])
    def test_what_is_no_npz_is_named(self, tmp_path, content):
        path = tmp_path / "c.npz"
        path.write_bytes(content)
        with pytest.raises(RtbenchError, match=r"c\.npz: not an npz file of cases"):
            Cases.load(path)

    def test_a_single_array_is_no_npz(self, tmp_path):
        np.save(tmp_path / "c.npy", np.zeros(3))
        with pytest.raises(RtbenchError, match="not an npz file of cases"):
            Cases.load(tmp_path / "c.npy")

    def test_a_broken_array_is_named(self, tmp_path):
        path = write(tmp_path / "c.npz")
        with zipfile.ZipFile(path) as archive:
            kept = {name: archive.read(name) for name in archive.namelist()}
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in kept.items():
                archive.writestr(name, data[:-3] if name == "eta.npy" else data)
        with pytest.raises(RtbenchError, match=r"c\.npz: array 'eta' cannot be read"):
            Cases.load(path)

    def test_a_file_that_cannot_be_opened_is_named(self, tmp_path):
        for path in (tmp_path / "none.npz", tmp_path):
            with pytest.raises(RtbenchError, match="cannot read"):
                Cases.load(path)
        with pytest.raises(RtbenchError, match="cannot write"):
            Cases(**arrays()).save(tmp_path / "none" / "c.npz")


class TestTake:
    def test_rows_keep_their_order_and_the_tables(self):
        cases = Cases(**arrays(), name=np.array(list("abcde")))
        some = cases.take(np.array([3, 1]))
        assert len(some) == 2 and some.name.tolist() == ["d", "b"]
        np.testing.assert_array_equal(some.v0, cases.v0[[3, 1]])
        assert some.family_names == ("near", "far") and some.class_names == CLASS_NAMES
        assert_same(cases.take(cases.f32_ok), cases.take(np.array([0, 2, 3])))
        assert_same(cases.take(slice(1, 3)), cases.take(np.array([1, 2])))

    def test_triangles_hold_the_vertices(self):
        cases = Cases(**arrays())
        assert cases.triangles.shape == (N, 3, 3)
        np.testing.assert_array_equal(cases.triangles[:, 2], cases.v2)
