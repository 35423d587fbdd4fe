import dataclasses
import hashlib

import numpy as np
import pytest

from rtbench.accuracy import exact
from rtbench.errors import RtbenchError
from rtbench.workloads import draws, pairs, safety
from rtbench.workloads.pairs import pairs_at_density, random_pairs

EPSILON = np.float32(1e-6)

# Frequencies over the generator's whole cycle of 2^31 items.
TRUE_FREQUENCIES = [0.12077, 0.31840, 0.12121, 0.31840, 0.12121, 6.1e-6]


def moller1_counts(pairs):
    """Count the outcomes of the listing of Blecha 2007, 4.5.1, evaluated from left to right."""
    v0, v1, v2, orig, dir = (
        [array[:, k] for k in range(3)]
        for array in (pairs.v0, pairs.v1, pairs.v2, pairs.orig, pairs.dir)
    )

    def minus(a, b):
        return [x - y for x, y in zip(a, b, strict=True)]

    def cross(a, b):
        return [a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))]

    def dot(a, b):
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    e1, e2, tv = minus(v1, v0), minus(v2, v0), minus(orig, v0)
    pv, qv = cross(dir, e2), cross(tv, e1)
    det, u, v = dot(e1, pv), dot(tv, pv), dot(dir, qv)
    codes = np.select(
        [
            (det > EPSILON) & ((u < 0) | (u > det)),
            (det > EPSILON) & ((v < 0) | (u + v > det)),
            (det < -EPSILON) & ((u > 0) | (u < det)),
            (det < -EPSILON) & ((v > 0) | (u + v < det)),
            np.abs(det) <= EPSILON,
        ],
        [1, 2, 3, 4, 5],
        default=0,
    )
    return np.bincount(codes, minlength=6)


@pytest.fixture(scope="module")
def half():
    return pairs_at_density(5000, 0.5, seed=3)


class TestRandomPairs:
    def test_counts_of_table_4_5(self):
        found = random_pairs(1_000_000, "msvc", 24660781)
        expected = [120720, 317737, 121256, 318641, 121632, 14]
        assert moller1_counts(found).tolist() == expected
        assert found.drawn == 1_000_000
        assert sum(found.redrawn.values()) == found.surplus == 0
        assert found.density is None

    @pytest.mark.parametrize("generator", draws.GENERATORS)
    def test_frequencies_are_the_true_ones(self, generator):
        from scipy.stats import chisquare

        counts = moller1_counts(random_pairs(400_000, generator, 99))
        expected = np.array(TRUE_FREQUENCIES) / sum(TRUE_FREQUENCIES) * counts.sum()
        # The last cell is too small for the test: it goes together with its neighbour.
        pvalue = chisquare(
            np.append(counts[:4], counts[4:].sum()), np.append(expected[:4], expected[4:].sum())
        ).pvalue
        assert pvalue > 1e-4

    def test_hits_and_values_are_exact(self):
        found = random_pairs(1500, "msvc", 5)
        for i in range(len(found)):
            vectors = (found.v0[i], found.v1[i], found.v2[i], found.orig[i], found.dir[i])
            hit, *values = exact.line_hit(*(vector.tolist() for vector in vectors))
            assert found.hit[i] == hit
            for array, value in zip((found.t, found.u, found.v), values, strict=True):
                if hit:
                    assert array[i] == pytest.approx(float(value), rel=1e-10, abs=1e-12)
                else:
                    assert np.isnan(array[i])

    def test_items_keep_the_order_in_which_they_were_drawn(self):
        found = random_pairs(70_000, "pcg64", 4)
        items = draws.draw("pcg64", 4, 70_000)
        for name, part in (("orig", draws.ORIG), ("end", draws.END), ("v2", draws.V2)):
            np.testing.assert_array_equal(getattr(found, name), items[:, part])

    @pytest.mark.parametrize("n", [0, -3])
    def test_no_pairs_are_refused(self, n):
        with pytest.raises(RtbenchError, match=f"number of pairs {n} "):
            random_pairs(n)


class TestStoredData:
    def test_dtypes_and_shapes(self, half):
        for name in ("v0", "v1", "v2", "orig", "end", "dir", "normal"):
            array = getattr(half, name)
            assert array.shape == (5000, 3)
            assert array.dtype == np.float32
            assert array.flags.c_contiguous
        assert half.d.dtype == np.float32
        assert {getattr(half, name).dtype for name in ("i0", "i1", "i2")} == {np.dtype("u4")}
        assert {getattr(half, name).dtype for name in "tuv"} == {np.dtype("f8")}

    def test_planes_and_directions_are_those_of_the_coordinates(self, half):
        v0, v1, v2, orig, end = (
            getattr(half, name).astype(float) for name in ("v0", "v1", "v2", "orig", "end")
        )
        normal = np.cross(v1 - v0, v2 - v0)
        length = np.linalg.norm(normal, axis=1)[:, None]
        wide = length[:, 0] > 0.1
        np.testing.assert_allclose(half.normal[wide], (normal / length)[wide], atol=1e-5)
        np.testing.assert_allclose(half.d, -(half.normal.astype(float) * v0).sum(1), atol=1e-6)
        far = np.linalg.norm(end - orig, axis=1) > 0.1
        unit = (end - orig) / np.linalg.norm(end - orig, axis=1)[:, None]
        np.testing.assert_allclose(half.dir[far], unit[far], atol=1e-6)

    def test_axes(self, half):
        magnitude = np.abs(half.normal)
        rows = np.arange(5000)
        assert (magnitude[rows, half.i0] == magnitude.max(axis=1)).all()
        assert (half.i1 < half.i2).all()
        axes = np.sort(np.stack([half.i0, half.i1, half.i2]), axis=0)
        assert (axes == np.array([[0], [1], [2]])).all()

    def test_under_200_bytes_a_pair(self, half):
        arrays = [x for x in vars(half).values() if isinstance(x, np.ndarray)]
        # What a view keeps alive counts whole, once.
        owners = {id(owner): owner for owner in (x if x.base is None else x.base for x in arrays)}
        assert all(owner.base is None for owner in owners.values())
        assert sum(owner.nbytes for owner in owners.values()) < 200 * len(half)


class TestDensity:
    @pytest.mark.parametrize("generator", draws.GENERATORS)
    @pytest.mark.parametrize(
        ("n", "density", "hits"),
        [(1, 0, 0), (1, 1.0, 1), (10, 0.3, 3), (2000, 0.3, 600), (999, 0.5, 500), (500, 1, 500)],
    )
    def test_hits_are_exactly_as_many(self, generator, n, density, hits):
        found = pairs_at_density(n, density, generator, 17)
        assert len(found) == n
        assert found.hit.sum() == hits
        assert np.isfinite(found.t).sum() == hits
        for i in range(min(n, 50)):
            vectors = (found.v0[i], found.v1[i], found.v2[i], found.orig[i], found.dir[i])
            assert exact.line_hit(*(x.tolist() for x in vectors)).hit == found.hit[i]

    def test_every_pair_is_safe_and_none_is_left_out(self, half):
        items = draws.draw("pcg64", 3, half.drawn)
        classes = safety.classify(items)
        for kind, is_hit in ((exact.HIT, True), (exact.MISS, False)):
            expected = items[classes == kind][:2500]
            kept = np.hstack([half.orig, half.end, half.v0, half.v1, half.v2])[half.hit == is_hit]
            assert {row.tobytes() for row in kept} == {row.tobytes() for row in expected}
            assert len(kept) == 2500

    def test_what_was_redrawn_is_counted(self, half):
        classes = safety.classify(draws.draw("pcg64", 3, half.drawn))
        assert half.redrawn == {
            reason: np.count_nonzero(classes == kind) for reason, kind in safety.REASONS.items()
        }
        assert half.redrawn["edge"] > 100
        assert half.redrawn["margin"] > 0
        assert half.drawn == 5000 + sum(half.redrawn.values()) + half.surplus

    def test_hits_are_shuffled_among_misses(self, half):
        changes = np.count_nonzero(half.hit[1:] != half.hit[:-1])
        assert abs(changes - 2500) < 250
        assert abs(int(half.hit[:2500].sum()) - 1250) < 150

    def test_portions_make_no_difference(self, half, monkeypatch):
        monkeypatch.setattr(pairs, "PORTION", 777)
        assert pairs_at_density(5000, 0.5, seed=3).digest == half.digest
        again = pairs_at_density(5000, 0.5, seed=3)
        assert (again.drawn, again.redrawn, again.surplus) == (
            half.drawn,
            half.redrawn,
            half.surplus,
        )

    def test_progress_rises_to_one(self):
        seen = []
        pairs_at_density(30_000, 1.0, progress=seen.append)
        assert len(seen) > 2
        assert seen == sorted(seen)
        assert seen[-1] == 1.0

    @pytest.mark.parametrize("density", [-0.1, 1.01, float("nan"), float("inf")])
    def test_density_outside_0_to_1_is_refused(self, density):
        with pytest.raises(RtbenchError, match=r"density \S+ is not allowed \(allowed: 0 to 1\)"):
            pairs_at_density(10, density)

    @pytest.mark.parametrize(
        ("n", "density", "near"),
        [(1, 0.5, "0 and 1"), (100, 0.001, "0 and 0.01"), (100, 0.999, "0.99 and 1")],
    )
    def test_unreachable_density_names_the_nearest(self, n, density, near):
        with pytest.raises(RtbenchError, match=f"nearest: {near}"):
            pairs_at_density(n, density)

    @pytest.mark.parametrize("n", [0, -1])
    def test_no_pairs_are_refused(self, n):
        with pytest.raises(RtbenchError, match="number of pairs"):
            pairs_at_density(n, 0.5)

    def test_a_generator_without_hits_ends(self, monkeypatch):
        item = next(
            item
            for item in draws.draw("pcg64", 1, 100)
            if safety.classify(item[None]) == exact.MISS
        )
        monkeypatch.setattr(draws, "items", lambda *_: lambda n: np.tile(item, (n, 1)))
        with pytest.raises(RtbenchError, match="too few pairs: 5 hits still missing after"):
            pairs_at_density(10, 0.5)


class TestDigest:
    # A change here changes every workload: raise it to the reader of old records.
    def test_is_stable(self):
        assert pairs_at_density(1000, 0.3, "pcg64", 1).digest == PCG64_DIGEST
        assert pairs_at_density(1000, 0.3, "msvc", 1).digest == MSVC_DIGEST

    def test_same_seed_same_workload(self, half):
        assert pairs_at_density(5000, 0.5, seed=3).digest == half.digest

    def test_each_choice_changes_it(self):
        digests = {
            found.digest
            for found in (
                pairs_at_density(100, 0.5, "pcg64", 1),
                pairs_at_density(100, 0.5, "pcg64", 2),
                pairs_at_density(100, 0.4, "pcg64", 1),
                pairs_at_density(101, 0.5, "pcg64", 1),
                pairs_at_density(100, 0.5, "msvc", 1),
                random_pairs(100, "pcg64", 1),
            )
        }
        assert len(digests) == 6

    def test_is_of_the_bytes_in_the_stated_order(self, half):
        names = ("v0", "v1", "v2", "orig", "end", "dir", "normal", "d", "i0", "i1", "i2", "hit")
        data = b"".join(getattr(half, name).tobytes() for name in names)
        assert half.digest == hashlib.sha256(data).hexdigest()

    def test_one_bit_changes_it(self, half):
        v1 = half.v1.copy()
        v1[-1, -1] = np.nextafter(v1[-1, -1], np.float32(2))
        assert dataclasses.replace(half, v1=v1).digest != half.digest


PCG64_DIGEST = "d738d5c403c6ad5f4fa7630c44b7dedc6d73db86b9032b7bf5cc83730f365dbc"
MSVC_DIGEST = "4cc3d3cf13632e57874cde2ac1cf559f25c9688392986bea22c1dcd9e9382ad3"
