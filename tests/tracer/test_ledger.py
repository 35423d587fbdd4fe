"""The ledger's sums, with a renderer whose costs are known."""

import json
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from rtbench.scenes.model import Camera, Light, Material, Plane, Scene, Settings, Sphere
from rtbench.tracer.effects import EFFECTS, called_for, compiled, with_settings
from rtbench.tracer.ledger import ledger, max_difference, median_interval
from rtbench.tracer.options import Options

# Seconds that each effect costs where it shows, and a tenth of it where it is neutral.
COSTS = {key: 2.0**-place for place, key in enumerate(EFFECTS, 1)}
SCENE = Scene(
    "two balls",
    Camera(width=8, height=6),
    (Light(position=(3.0, 9.0, 3.0)),),
    (
        Material(specular=(0.5, 0.5, 0.5), name="wax"),
        Material(reflection=(0.5, 0.5, 0.5), name="mirror"),
    ),
    (Sphere(0), Sphere(1, center=(2.0, 0.0, 0.0)), Plane(0, point=(0.0, -1.0, 0.0))),
)


@dataclass
class Picture:
    pixels: np.ndarray
    rays: dict
    saved: dict
    seconds: dict
    effects: dict


@dataclass
class Fake:
    """Renders nothing, and says what it would have cost."""

    scene: Scene
    options: Options
    log: list = field(default_factory=list)

    def render(self, camera=None, threads=1, progress=None):
        self.log.append(self.options)
        turn = sum(each is self.options for each in self.log)
        made = with_settings(self.scene, self.options.depth)
        flags = compiled(made, self.options.without, self.options.force)
        shown = called_for(made, self.options.without)
        seconds = 1.0 + 0.001 * turn  # it gets slower, for all alike
        pixels = np.zeros((6, 8, 3))
        rays = dict.fromkeys(("primary", "shadow", "reflection", "refraction", "indirect"), 0)
        saved = dict.fromkeys(("light_behind", "no_contribution", "below_threshold", "depth"), 0)
        rays["primary"], saved["light_behind"] = 48, 8  # lights are looked at without shadows too
        for key in EFFECTS:
            if shown[key] is not None:
                seconds += COSTS[key]
                pixels[0, 0, 0] += 0.25 if key == "shadows" else 0.0
                pixels[0, 0, 1] -= 0.5 if key == "reflection" else 0.0
                if key == "shadows":
                    rays["shadow"] += 40
                if key == "reflection":
                    rays |= {"reflection": 10, "shadow": rays["shadow"] + 7}
                    saved["depth"] = 3
            elif flags[key]:
                seconds += COSTS[key] / 10
        return Picture(pixels, rays, saved, {"trace": seconds}, flags)


def made(options=None, repeats=6, progress=None, scene=SCENE):
    log = []
    found = ledger(scene, options, repeats, progress, lambda *given: Fake(*given, log))
    return found, log


def test_each_effect_has_its_row():
    found, _ = made()
    assert [row.key for row in found.rows] == list(EFFECTS)
    assert {row.key for row in found.rows if row.called} == {"shadows", "reflection", "specular"}
    rows = {row.key: row for row in found.rows}
    assert rows["reflection"].why == "material 'mirror' of object 2 has reflection 0.5"
    assert rows["glossy"].why.startswith("no material")
    assert rows["glossy"].along == () and rows["soft_shadows"].along == ()
    assert rows["dispersion"].along == ("refraction",)
    assert found.picture.pixels.shape == (6, 8, 3)


def test_rays_are_the_difference_that_an_effect_makes():
    rows = {row.key: row for row in made()[0].rows}
    assert rows["shadows"].rays == {"shadow": 40}
    assert rows["shadows"].saved == {"light_behind": 8}
    assert rows["reflection"].rays == {"shadow": 7, "reflection": 10}
    assert rows["reflection"].saved == {"depth": 3}
    assert all(rows[key].rays == rows[key].saved == {} for key in EFFECTS if key not in rows)
    assert rows["texture"].rays == {}


def test_seconds_are_what_an_effect_costs():
    found, _ = made()
    rows = {row.key: row for row in found.rows}
    for key, row in rows.items():
        # What each round is slower by is the same for both of a pair.
        if row.called:
            assert row.seconds == row.forced_seconds == pytest.approx(COSTS[key])
        else:
            assert row.seconds == 0.0
            costs = sum(COSTS[each] for each in (key, *row.along))
            assert row.forced_seconds == pytest.approx(costs / 10)
        assert row.low == pytest.approx(row.forced_seconds) == row.high
        assert len(row.rounds) == 6
    own = 1.0045 + COSTS["shadows"] + COSTS["reflection"] + COSTS["specular"]
    assert found.seconds == pytest.approx(own)
    without = own - COSTS["shadows"]
    assert rows["shadows"].share == pytest.approx(COSTS["shadows"] / without)


def test_pictures_differ_by_what_is_called_for_alone():
    rows = {row.key: row for row in made()[0].rows}
    assert rows["shadows"].max_difference == 0.25
    assert rows["reflection"].max_difference == 0.5
    for key, row in rows.items():
        if key not in ("shadows", "reflection"):
            assert row.max_difference == 0.0 and row.same_bits


def test_they_render_in_turns_that_begin_elsewhere_each_round():
    _, log = made(repeats=3)
    assert len(log) == 14 * 4
    first = log[:14]  # one of each, untimed
    assert first[0] == Options()
    assert first[1] == Options(without=("shadows",))
    assert first[3] == Options(force=("refraction",))
    for turn in range(3):
        lap = log[14 * (turn + 1) : 14 * (turn + 2)]
        assert lap == first[turn:] + first[:turn]


def test_progress_ends_at_one():
    told = []
    made(repeats=2, progress=told.append)
    assert len(told) == 14 * 4 and told == sorted(told) and told[-1] == 1.0


def test_options_stand_in_for_settings_and_what_they_leave_out_does_not_count():
    found, log = made(Options(depth=0, without=("shadows",), force=("texture",)))
    assert {row.key for row in found.rows if row.called} == {"shadows", "specular"}
    assert log[0] == Options(depth=0)


def test_a_few_rounds_have_no_interval():
    found, _ = made(repeats=2)
    assert all(row.low is None and row.high is None for row in found.rows)


def test_the_interval_of_a_median_holds_what_it_says():
    """Its chance of missing is that of coins: by enumeration of all throws of 9."""
    assert median_interval(np.arange(5.0)) is None  # 2 / 32 outside
    assert median_interval(np.array([3.0, 1.0, 2.0, 6.0, 5.0, 4.0])) == (1.0, 6.0)  # 2 / 64
    low, high = median_interval(np.arange(9.0))
    below = [bin(throw).count("1") for throw in range(512)]
    missed = sum(heads <= low or heads > high for heads in below) / 512
    one_further = sum(heads <= low + 1 or heads > high - 1 for heads in below) / 512
    assert missed <= 0.05 < one_further
    assert median_interval(np.arange(2.0)) is None and median_interval(np.zeros(0)) is None


def test_the_largest_difference_of_two_pictures():
    a = np.array([[[1.0, np.inf, np.nan]]])
    assert max_difference(a, a.copy()) == 0.0
    assert max_difference(a, np.array([[[0.25, np.inf, np.nan]]])) == 0.75
    assert max_difference(a, np.array([[[1.0, np.inf, 0.0]]])) == np.inf
    assert max_difference(a, np.array([[[1.0, -np.inf, np.nan]]])) == np.inf
    assert max_difference(np.float32([[[0.0]]]), np.float32([[[-0.0]]])) == 0.0


def test_the_record_is_plain_values():
    record = json.loads(json.dumps(made()[0].record(), allow_nan=False))
    assert (record["scene"], record["width"], record["height"]) == ("two balls", 8, 6)
    assert record["rays"]["shadow"] == 47 and record["saved"]["depth"] == 3
    assert record["effects"][0]["rays"] == {"shadow": 40}


def test_settings_with_samples_are_seen():
    four = replace(SCENE, settings=Settings(samples=4))
    assert {row.key for row in made(scene=four)[0].rows if row.called} >= {"antialiasing"}


def floor_alone():
    return Scene(
        "floor",
        Camera(position=(1.0, 2.0, 5.0), width=16, height=12),
        (Light(position=(3.3, 5.1, 4.0), color=(20.0, 20.0, 20.0), falloff="inverse_square"),),
        (Material(ambient=(0.1, 0.1, 0.1)),),
        (Plane(point=(0.0, -1.0, 0.0)),),
        background=(0.2, 0.3, 0.4),
    )


def test_a_scene_that_calls_for_nothing_is_the_same_with_everything_compiled_in():
    from rtbench.tracer.render import Renderer

    scene = floor_alone()
    own = Renderer(scene).render()
    forced = Renderer(scene, Options(force=tuple(EFFECTS))).render()
    assert not any(own.effects.values()) and all(forced.effects.values())
    assert own.pixels.tobytes() == forced.pixels.tobytes()
    assert own.rays["shadow"] == 0 < forced.rays["shadow"]
    # By hand: below the light, at distance d, a white light of colour 20 brings 0.8 * 20 / d^2.
    from_above = Camera((3.3, 3.0, 4.0), (3.3, -1.0, 4.0), (1.0, 0.0, 0.0), width=1, height=1)
    seen = Renderer(scene).render(from_above).pixels[0, 0]
    np.testing.assert_allclose(seen, 0.1 + 0.8 * 20.0 / 6.1**2, rtol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_no_forced_effect_changes_a_bit(precision):
    """The tracers of 28 sets of effects are compiled: minutes."""
    found = ledger(SCENE, Options(precision=precision), repeats=1)
    rows = {row.key: row for row in found.rows}
    assert {key for key, row in rows.items() if row.called} == {"shadows", "reflection", "specular"}
    for row in rows.values():
        if row.called:
            assert row.max_difference > 0.0
        else:
            assert row.same_bits and row.max_difference == 0.0
    assert rows["shadows"].rays["shadow"] == found.picture.rays["shadow"] > 0
    assert rows["reflection"].rays["reflection"] == found.picture.rays["reflection"] > 0
    assert rows["refraction"].rays == {}
