"""Effects are read off scenes made by hand, each at its border."""

from dataclasses import replace

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.scenes.model import (
    Camera,
    Cone,
    Disc,
    Indirect,
    Light,
    Material,
    Plane,
    Scene,
    Settings,
    Sphere,
    Texture,
    Triangles,
)
from rtbench.tracer.effects import (
    DESCRIBED,
    EFFECTS,
    called_for,
    compiled,
    neutral,
    reasons,
    with_settings,
)

KEYS = ["shadows", "reflection", "refraction", "dispersion", "specular", "texture"]
KEYS += ["smooth_normals", "soft_shadows", "glossy", "depth_of_field", "motion_blur"]
KEYS += ["antialiasing", "indirect"]
GREY = (0.5, 0.5, 0.5)
FLOOR = np.array([[[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[1, 0, 0], [1, 0, 1], [0, 0, 1]]], float)
LAMP = Light(position=(0, 9, 0))


def scene(*materials, objects=None, lights=(LAMP,), **rest):
    """Return a scene in which each material is used by a sphere above a plane."""
    materials = materials or (Material(),)
    if objects is None:
        spheres = [Sphere(k, center=(3.0 * k, 0.0, 0.0)) for k in range(len(materials))]
        objects = (*spheres, Plane(0, point=(0.0, -1.0, 0.0)))
    return Scene("made", Camera(), tuple(lights), tuple(materials), tuple(objects), **rest)


def called(made, **chosen):
    return [key for key, why in called_for(made, **chosen).items() if why is not None]


def test_the_keys_are_in_the_agreed_order():
    flags = compiled(scene())
    assert list(EFFECTS) == list(neutral) == list(called_for(scene())) == list(flags) == KEYS
    for effect in DESCRIBED.values():
        assert effect.title and effect.simulates and effect.source and effect.neutral
        assert set(effect.needs) <= set(KEYS)


def test_a_scene_of_nothing_calls_for_nothing():
    assert called(scene(objects=())) == []
    assert called(scene(objects=(Triangles(normals=np.zeros((0, 3, 3))),))) == []


def test_a_plain_scene_calls_for_shadows_alone():
    assert called_for(scene())["shadows"] == "light 1 casts shadows"
    assert called(scene()) == ["shadows"]


@pytest.mark.parametrize(
    ("lights", "why"),
    [
        ((), "no light shines"),
        ((Light(color=(0, 0, 0)),), "no light shines"),
        ((Light(shadows=False),), "no light casts shadows"),
    ],
)
def test_without_a_light_that_casts_them_there_are_no_shadows(lights, why):
    assert reasons(scene(lights=lights))["shadows"].why == why
    assert called(scene(lights=lights)) == []


def test_the_light_that_casts_shadows_is_named():
    lights = (Light(color=(0, 0, 0)), Light(shadows=False), Light())
    assert called_for(scene(lights=lights))["shadows"] == "light 3 casts shadows"


def test_surfaces_that_light_does_not_show_on_have_no_shadows():
    dark = Material(diffuse=(0, 0, 0), emission=GREY)
    assert "diffuse and specular are 0" in reasons(scene(dark))["shadows"].why
    assert "shadows" in called(scene(replace(dark, specular=GREY)))


def one(each, **rest):
    return "shadows" in called(scene(objects=(each,), **rest))


def test_one_convex_object_cannot_shadow_itself():
    assert not one(Plane())
    assert not one(Disc())
    assert not one(Triangles(corners=FLOOR[:1]))
    assert not one(Sphere())
    assert "one sphere" in reasons(scene(objects=(Sphere(),)))["shadows"].why
    assert one(Cone())  # its inside is seen through its open ends
    assert "shadows" in called(scene(objects=(Sphere(), Sphere(center=(3, 0, 0)))))


def test_a_sphere_shadows_its_inside():
    """The camera stands at distance 5."""
    assert not one(Sphere(radius=4.9))
    assert one(Sphere(radius=5.1))
    assert one(Sphere(velocity=(0, 0, 4.5)))
    glass = Material(transmission=GREY)
    assert "shadows" in called(scene(glass, objects=(Sphere(),)))
    near = Camera(lens_radius=4.5)
    assert "shadows" in called(replace(scene(objects=(Sphere(),)), camera=near))


def test_what_lies_in_one_plane_cannot_shadow_itself():
    floor, disc = Triangles(corners=FLOOR), Disc(center=(5.0, 0.0, 0.0))
    assert called(scene(objects=(floor,))) == []
    assert called(scene(objects=(floor, disc, Plane()))) == []
    assert "one plane" in reasons(scene(objects=(floor, disc)))["shadows"].why
    raised = replace(disc, center=(5.0, 1e-9, 0.0))
    assert called(scene(objects=(floor, raised))) == ["shadows"]
    leaning = replace(disc, normal=(1e-9, 1.0, 0.0))
    assert called(scene(objects=(floor, leaning))) == ["shadows"]
    leaving = replace(disc, velocity=(0.0, 1.0, 0.0))
    assert called(scene(objects=(floor, leaving))) == ["shadows", "motion_blur"]
    bent = FLOOR.copy()
    bent[1, 1, 1] = 1e-9
    assert called(scene(objects=(Triangles(corners=bent),))) == ["shadows"]


def test_a_triangle_with_normals_may_face_a_light_from_behind():
    normals = np.tile((0.0, 1.0, 0.0), (1, 3, 1))
    made = scene(objects=(Triangles(corners=FLOOR[:1], normals=normals),))
    assert called(made) == ["shadows", "smooth_normals"]


@pytest.mark.parametrize("key", ["reflection", "transmission"])
def test_rays_are_called_for_above_the_threshold(key):
    effect = {"reflection": "reflection", "transmission": "refraction"}[key]

    def made(value, **settings):
        material = Material(name="glass", **{key: (0.0, value, 0.0)})
        # Without lights: through what lets light through, shadow rays would pass at any rate.
        return scene(Material(), material, lights=(), settings=Settings(**settings))

    assert called_for(made(0.9))[effect] == f"material 'glass' of object 2 has {key} (0, 0.9, 0)"
    assert called(made(0.25, threshold=0.25)) == []
    assert called(made(0.25, threshold=0.2499)) == [effect]
    assert called(made(1e-9, threshold=0.0)) == [effect]
    assert called(made(0.0, threshold=0.0)) == []
    assert called(made(0.9, depth=0)) == []
    assert called(made(0.9, depth=1)) == [effect]
    assert "the depth is 0" in reasons(made(0.9, depth=0))[effect].why
    assert "threshold 0.25" in reasons(made(0.1, threshold=0.25))[effect].why
    # A path chooses by chance, and goes as deep as paths do.
    paths = made(0.1, depth=0, threshold=0.25, indirect=Indirect())
    assert called(paths) == [effect, "indirect"]


def test_total_reflection_adds_the_weights_of_both():
    both = Material(reflection=(0.2, 0.2, 0.2), transmission=(0.2, 0.2, 0.2), index=1.5)
    weak = Settings(threshold=0.3)
    assert called(scene(both, lights=(), settings=weak)) == ["reflection", "refraction"]


def test_shadow_rays_pass_where_no_refracted_ray_is_sent():
    glass = Material(transmission=(0.001, 0.0, 0.0), name="smoke")
    made = scene(glass)
    assert called(made) == ["shadows", "refraction"]
    assert called_for(made)["refraction"].endswith("light passes on its way to other surfaces")
    assert called(scene(glass, lights=())) == []
    assert called(made, without=["shadows"]) == []


def test_materials_without_a_name_have_a_number():
    made = scene(Material(), Material(reflection=GREY))
    assert called_for(made)["reflection"] == "material 2 of object 2 has reflection 0.5"


def test_materials_that_no_object_uses_call_for_nothing():
    everything = Material(
        specular=GREY,
        reflection=GREY,
        transmission=GREY,
        index=1.5,
        abbe=30.0,
        roughness=0.3,
        texture=Texture(),
    )
    objects = (Sphere(0), Plane(0))
    assert called(scene(Material(), everything, objects=objects)) == ["shadows"]
    empty = Triangles(1)
    assert called(scene(Material(), everything, objects=(*objects, empty))) == ["shadows"]
    assert called(scene(Material(), everything)) == [
        "shadows",
        "reflection",
        "refraction",
        "dispersion",
        "specular",
        "texture",
        "glossy",
    ]


@pytest.mark.parametrize(
    ("changed", "there"),
    [
        ({}, True),
        ({"abbe": None}, False),
        ({"index": 1.0}, False),
        ({"transmission": (0.0, 0.0, 0.0)}, False),
    ],
)
def test_dispersion_needs_glass_an_index_and_an_abbe_number(changed, there):
    prism = {"transmission": GREY, "index": 1.5, "abbe": 30.0} | changed
    assert ("dispersion" in called(scene(Material(**prism)))) is there


def test_dispersion_needs_rays_that_are_bent():
    prism = Material(transmission=GREY, index=1.5, abbe=30.0)
    made = scene(prism, settings=Settings(depth=0))
    assert called(made) == ["shadows", "refraction"]  # shadow rays go straight
    assert called(scene(prism), without=["refraction"]) == ["shadows"]
    assert reasons(scene(prism), ["refraction"])["dispersion"].why == "needs refraction, left out"


def test_highlights_need_a_light():
    shiny = Material(specular=(0.0, 0.1, 0.0), name="wax")
    assert called_for(scene(shiny))["specular"].startswith("material 'wax' of object 1")
    assert "no light" in reasons(scene(shiny, lights=()))["specular"].why
    assert called(scene(shiny, lights=())) == []


def test_textures_need_light():
    painted = Material(texture=Texture())
    assert called(scene(painted)) == ["shadows", "texture"]
    assert called(scene(painted, lights=())) == []
    assert called(scene(painted, lights=(), settings=Settings(indirect=Indirect()))) == [
        "texture",
        "indirect",
    ]
    ambient = replace(painted, ambient=GREY)
    assert called(scene(ambient, lights=())) == ["texture"]
    assert called(scene(ambient, lights=(), ambient=(0, 0, 0))) == []
    red_on_green = replace(painted, ambient=(1.0, 0.0, 0.0))
    assert called(scene(red_on_green, lights=(), ambient=(0, 1, 0))) == []
    assert "a checker" in called_for(scene(painted))["texture"]
    pixels = np.zeros((1, 1, 3), np.float32)
    image = Texture(kind="image", pixels=pixels, source="wood.png")
    assert "the image wood.png" in called_for(scene(Material(texture=image)))["texture"]


@pytest.mark.parametrize("kind", ["point", "directional", "spot", "rectangle", "sphere"])
def test_lights_with_an_area_cast_soft_shadows(kind):
    lights = (Light(), Light(kind=kind, position=(0, 9, 0)))
    area = kind in ("rectangle", "sphere")
    told = called_for(scene(lights=lights))["soft_shadows"]
    assert told == (f"light 2 is a {kind}" if area else None)
    dark = (Light(), replace(lights[1], color=(0, 0, 0)))
    assert "soft_shadows" not in called(scene(lights=dark))


def test_a_light_with_an_area_counts_where_nothing_is_in_its_way():
    """Past a horizon, a part of it shines on where its middle does not."""
    rectangle = Light(kind="rectangle", position=(0, 9, 0))
    assert called(scene(objects=(Plane(),), lights=(rectangle,))) == ["soft_shadows"]
    black = Material(diffuse=(0, 0, 0))
    assert called(scene(black, lights=(rectangle,))) == []
    assert called(scene(lights=(rectangle,)), without=["shadows"]) == []


def test_roughness_needs_mirrored_or_refracted_rays():
    rough = Material(roughness=0.2)
    assert called(scene(rough)) == ["shadows"]
    mirror, window = replace(rough, reflection=GREY), replace(rough, transmission=GREY)
    assert called(scene(mirror)) == ["shadows", "reflection", "glossy"]
    assert called(scene(window)) == ["shadows", "refraction", "glossy"]
    assert called(scene(replace(mirror, roughness=0.0))) == ["shadows", "reflection"]
    assert called(scene(mirror), without=["reflection"]) == ["shadows"]
    # The rough one sends no rays, though another does.
    weak = replace(rough, reflection=(0.001, 0.001, 0.001))
    assert called(scene(weak, Material(reflection=GREY))) == ["shadows", "reflection"]
    other = (mirror, Material(transmission=GREY))
    assert called(scene(*other), without=["reflection"]) == ["shadows", "refraction"]


def test_the_camera_and_what_moves():
    assert called_for(replace(scene(), camera=Camera(lens_radius=0.1)))["depth_of_field"] == (
        "the camera's lens has radius 0.1"
    )
    moving = scene(objects=(Plane(), Sphere(velocity=(0.0, -1e-9, 0.0))))
    assert called_for(moving)["motion_blur"] == "object 2 moves by (0, -1e-09, 0)"
    assert called(moving) == ["shadows", "motion_blur"]


def test_samples_and_paths():
    made = scene(settings=Settings(samples=4))
    assert called_for(made)["antialiasing"] == "4 samples a pixel"
    assert reasons(scene())["antialiasing"].why == "1 sample a pixel"
    paths = scene(settings=Settings(indirect=Indirect(samples=7)))
    assert called_for(paths)["indirect"] == "the scene asks for 7 paths a pixel"


def test_settings_can_be_replaced():
    mirror = scene(Material(reflection=GREY))
    assert with_settings(mirror) is mirror
    assert "reflection" not in called(with_settings(mirror, depth=0))
    assert "reflection" not in called(with_settings(mirror, threshold=0.6))
    assert "antialiasing" in called(with_settings(mirror, samples=9))
    with pytest.raises(RtbenchError, match="no square"):
        with_settings(mirror, samples=5)


def names(flags):
    return {key for key, flag in flags.items() if flag}


def test_what_is_left_out_takes_with_it_what_needs_it():
    prism = Material(transmission=GREY, index=1.5, abbe=30.0, roughness=0.1)
    made = scene(prism, lights=(Light(kind="sphere", position=(0, 9, 0)),))
    everything = {"shadows", "refraction", "dispersion", "soft_shadows", "glossy"}
    assert names(compiled(made)) == everything
    assert names(compiled(made, ["shadows"])) == {"refraction", "dispersion", "glossy"}
    assert names(compiled(made, ["refraction"])) == {"shadows", "soft_shadows"}
    assert names(compiled(made, KEYS)) == set()


def test_what_is_forced_brings_what_it_needs():
    plain = scene(objects=(Plane(),))
    assert names(compiled(plain)) == set()
    assert names(compiled(plain, force=["texture"])) == {"texture"}
    assert names(compiled(plain, force=["soft_shadows"])) == {"shadows", "soft_shadows"}
    assert names(compiled(plain, force=["dispersion"])) == {"refraction", "dispersion"}
    assert names(compiled(plain, force=["glossy"])) == {"reflection", "glossy"}
    assert names(compiled(plain, force=["glossy", "refraction"])) == {"refraction", "glossy"}
    assert names(compiled(plain, ["reflection"], ["glossy"])) == {"refraction", "glossy"}
    assert names(compiled(plain, force=KEYS)) == set(KEYS)


@pytest.mark.parametrize(
    ("without", "force", "told"),
    [
        (["shadow"], [], "unknown effect 'shadow'; did you mean 'shadows'?"),
        ([], ["soft-shadows"], "did you mean 'soft_shadows'?"),
        (["texture"], ["texture"], "effect 'texture' cannot be both left out and forced"),
        (["shadows"], ["soft_shadows"], "effect 'soft_shadows' needs 'shadows', left out"),
        (["refraction"], ["dispersion"], "effect 'dispersion' needs 'refraction', left out"),
        (["reflection", "refraction"], ["glossy"], "needs 'reflection' or 'refraction', left out"),
    ],
)
def test_contradictions_are_told_in_one_line(without, force, told):
    with pytest.raises(RtbenchError) as raised:
        compiled(scene(), without, force)
    assert told in str(raised.value) and "\n" not in str(raised.value)
