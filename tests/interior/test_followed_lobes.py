"""Narrow lobes that are followed like mirrors and smooth glass, with the normal of the microfacet kept fixed
(native/shading/bsdf/followed_lobes.h).

Scenes of mirrors and glass with a little roughness are compared with central differences, lobes beside other lobes and
lights of every kind are rendered in them, and the noise of a derivative stays bounded as roughness goes to zero.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from tests.support import shapes
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.rich_scene import turn
from tests.support.scenes import mirrored_shadows, mirrors_and_glass
from tests.support.scenes.gloss import glossy_ball
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along, box, camera, matte, need, rectangle

ROUGHNESS = 0.1


def roughened(make: Make, roughness: float = ROUGHNESS, distribution: str = "GGX") -> Make:
    """The same scene with mirrors and glass that are nearly smooth."""

    def nearly(theta: float) -> edgegrad.Scene:
        made = make(theta)
        names = ("mirror",) if distribution == "ASHIKHMIN_SHIRLEY" else ("mirror", "glass")  # glass has no such lobe
        rough = {name: replace(made.closures(name)[0], roughness=roughness, distribution=distribution)
                 for name in names if name in made.materials}  # fmt: skip
        return replace(made, materials={**made.materials, **rough})

    return nearly


SEEN = ("flat mirror: box moves", "flat mirror: mirror moves", "flat mirror: camera moves", "round mirror: box moves",
        "round mirror: mirror moves", "glass: box moves", "glass: glass moves", "glass: camera moves",
        "glass: a block turns")


@pytest.mark.parametrize("case", slow_but(SEEN, ("flat mirror: mirror moves", "glass: glass moves")))
def test_edges_agree_with_differences(case: str) -> None:
    need("native")
    make, paths = mirrors_and_glass.CASES[case]
    options = {**mirrors_and_glass.OPTIONS, "spp": 128}
    check_agreement(along(roughened(make, 0.14), paths), **options)


SHAPED = (*(f"{case}, {distribution}" for case in ("flat mirror: mirror moves", "round mirror: box moves")
            for distribution in ("BECKMANN", "ASHIKHMIN_SHIRLEY")),
          "glass: glass moves, BECKMANN", "glass: camera moves, BECKMANN")  # fmt: skip


@pytest.mark.parametrize("name", slow_but(SHAPED, ("flat mirror: mirror moves, ASHIKHMIN_SHIRLEY",
                                                   "glass: camera moves, BECKMANN")))  # fmt: skip
def test_other_distributions_agree_with_differences(name: str) -> None:
    need("native")
    case, distribution = name.split(", ")
    make, paths = mirrors_and_glass.CASES[case]
    check_agreement(along(roughened(make, 0.14, distribution), paths), **{**mirrors_and_glass.OPTIONS, "spp": 128})


SHADOWS = ("point: box moves", "rectangle: box moves", "mesh: box moves", "point: mirror moves", "sky: mirror moves",
           "rectangle: camera moves", "slab: slab moves under a point", "ball: ball moves under a rectangle",
           "bounced: wall moves")


@pytest.mark.parametrize("case", slow_but(SHADOWS, ("mesh: box moves", "point: mirror moves")))
def test_what_they_show_agrees_with_differences(case: str) -> None:
    """Edges of shadows, and of light that surfaces scatter, in narrow lobes; lights of every kind in them."""
    need_every_table()
    make, paths = mirrored_shadows.CASES[case]
    # Under lights with a size only narrower lobes are followed
    roughness = 0.14 if not sized_lights(make(0.0)) else ROUGHNESS
    options = mirrored_shadows.options_of(case)
    if case == "rectangle: camera moves":  # rays in the tail of the lobe meet the lamp rarely
        options["seeds"] = 48
    check_agreement(along(roughened(make, roughness), paths), **options)


def sized_lights(made: edgegrad.Scene) -> bool:
    """Whether any light, except emissive meshes, has a size."""
    return any(isinstance(light, edgegrad.AreaLight) or getattr(light, "radius", 0.0) > 0.0
               or getattr(light, "angle", 0.0) > 0.0 for light in made.lights.values())  # fmt: skip


def over_gloss(theta: float) -> edgegrad.Scene:
    """A ball that moves just above a glossy floor beside another ball, under a rectangle of the table."""
    vertices, faces = shapes.ball(2, 0.4)
    step = theta * np.array([0.5, 0.2, -0.3])
    gloss = edgegrad.Material(np.array([0.3, 0.3, 0.3]), roughness=0.15)
    down = np.array([[1.0, 0, 0, 0], [0, 0, 1, 1.6], [0, -1, 0, 0], [0, 0, 0, 1]])  # -Z is turned to -Y
    lamp = edgegrad.AreaLight(down, np.array([0.8, 0.8]), power=20.0)
    return edgegrad.Scene(
        camera((0.0, 1.2, 2.4), (0.0, 0.2, 0.0), 24, 0.7),
        {"ball": edgegrad.Mesh(vertices + [-0.42, 0.46, 0.0] + step, faces, ("ball",), smoothing=faces),
         "other": edgegrad.Mesh(vertices + [0.5, 0.46, 0.0], faces, ("other",), smoothing=faces),
         "floor": rectangle((0, 0, 0), (0, 0, 3), (3, 0, 0), "floor")},
        {"ball": matte(0.2, 0.4, 0.7), "other": matte(0.8, 0.8, 0.8), "floor": gloss},
        {"lamp": lamp},
        edgegrad.World(np.full(3, 0.05)),
    )  # fmt: skip


def test_wider_lobes_under_sized_lights_agree_with_differences() -> None:
    """There light keeps its direction near contact at several surfaces, instead of lobes being followed."""
    need_every_table()
    options = {"eps": 0.02, "seeds": 12, "spp": 128, "reference_spp": 256, "thetas": 4, "max_depth": 4}
    assert "nearly as narrow" not in str(edgegrad.plan(over_gloss(0.0), ["meshes.ball.vertices"], max_depth=4))
    check_agreement(along(over_gloss, ["meshes.ball.vertices"]), **options)


def test_rays_of_followed_lobes_find_sized_lights() -> None:
    """Within a light the interior term then has no noise. By emitter samples it would have 100 times as much."""
    need("native")

    def noise(roughness: float, term: str) -> float:
        return glossy_ball.noise(glossy_ball.scene("metal", roughness, "sphere", "none"), term, 64, 6, "ball")

    assert noise(0.2, "interior") < 0.1 * noise(0.23, "interior")
    assert noise(0.2, "all") < 0.5 * noise(0.23, "all")


def flat_under_sun(theta: float) -> edgegrad.Scene:
    """A flat sheet of metal that turns, and a card, as parallel rays see them; the sun is where the sheet mirrors."""
    made = edgegrad.Scene(
        replace(camera((0.0, 2.0, 2.0), (0, 0, 0), size=16), kind="ORTHOGRAPHIC", ortho_width=1.6),
        {"sheet": rectangle((0, 0, 0), (0, 0, 0.6), (0.6, 0, 0), "metal"),
         "card": rectangle((0.2, 0.3, -0.3), (0.2, 0, 0), (0, 0.2, 0), "matte")},
        {"metal": edgegrad.Material(metallic=1.0, roughness=0.14), "matte": matte(0.6, 0.6, 0.6)},
        {"sun": edgegrad.SunLight(np.array([0.02, -1.0, 0.97]), 2.0, angle=0.08)},
    )  # fmt: skip
    made.meshes["sheet"].vertices = made.meshes["sheet"].vertices @ turn(0.2 * theta, 0.0, 0.1 * theta).T
    return made


def test_flat_faces_that_parallel_rays_see_under_a_sun_agree_with_differences() -> None:
    """All of a flat face mirrors the sun or none of it: for a held microfacet normal nothing moves in the picture."""
    need("native")
    check_agreement(along(flat_under_sun, ["meshes.sheet.vertices"]), spp=128, max_depth=2, eps=0.05)


def beside_highlight(moving: str, seen: str) -> Make:
    """A part of a polished sheet beside the highlight of a small lamp: rays of the lobe rarely meet the lamp there.

    The box stands between this part and the lamp. The camera sees the part, or sees it `in a mirror`, or the
    highlight's `border`, where rays and emitter samples share the light.
    """

    def make(theta: float) -> edgegrad.Scene:
        step = theta * np.array([0.5, 0.3, -0.2])
        shown = box((0.45, 0.45, 0.3), (0.04, 0.02, 0.03), "box", 0.4)
        if moving == "box":
            shown = replace(shown, vertices=shown.vertices + step)
        lamp = edgegrad.PointLight(np.array([0.9, 0.9, 0.6]) + (step if moving == "lamp" else 0.0), power=20.0,
                                   radius=0.05, sphere=True)  # fmt: skip
        meshes = {"sheet": rectangle((0, 0, 0), (0, 0, 0.6), (0.6, 0, 0), "metal"), "box": shown}
        view, target = (-0.9, 1.2, 0.4), (0.06, 0.0, 0.46) if seen == "border" else (0.0, 0.0, 0.0)
        if seen == "in a mirror":  # in the plane x = -1.2
            mirror = rectangle((-1.2, 0.8, 0), (0, 0, 0.8), (0, 0.6, 0), "mirror")
            meshes["mirror"] = replace(mirror, visible_to=frozenset({"camera"}))
            view, target = (-0.5, 1.6, 0.6), (-2.4, 0.0, 0.0)
        metal = edgegrad.Material(np.array([0.9, 0.7, 0.5]), metallic=1.0, roughness=0.1)
        mirror_like = edgegrad.Material(np.ones(3), kind="GLOSSY", roughness=0.0)
        return edgegrad.Scene(
            camera(view, target, 12, 0.12),
            meshes,
            {"metal": metal, "box": matte(0.0, 0.0, 0.0), "mirror": mirror_like},
            {"lamp": lamp},
            edgegrad.World(np.zeros(3)),
        )

    return make


BESIDE = {"lamp": "lights.lamp.position", "box": "meshes.box.vertices"}


@pytest.mark.parametrize(("moving", "seen"), [("lamp", "directly"), ("lamp", "border"), ("lamp", "in a mirror"),
                                              ("box", "directly"), ("box", "in a mirror")])  # fmt: skip
def test_tails_of_highlights_agree_with_differences(moving: str, seen: str) -> None:
    """Emitter samples find the light of small lamps in the tails of followed lobes."""
    need_every_table()
    options = {"eps": 0.01, "seeds": 8, "spp": 64 if seen == "directly" else 1024, "reference_spp": 2048, "thetas": 4}
    check_agreement(along(beside_highlight(moving, seen), [BESIDE[moving]]), max_depth=4, **options)


def far_from_highlight(theta: float) -> edgegrad.Scene:
    """A part of a polished sheet far beside the highlight of a wide lamp, which moves."""
    pose = np.array([[1, 0, 0, 0.4 + theta], [0, 0, 1, 2.5], [0, -1, 0, -0.2], [0, 0, 0, 1.0]])
    return edgegrad.Scene(
        replace(camera((-0.9, 2.2, 1.4), (0, 0, 0), 12, 0.2), crop=(0, 0, 12, 6)),
        {"sheet": rectangle((0, 0, 0), (0, 0, 0.6), (0.6, 0, 0), "metal")},
        {"metal": edgegrad.Material(np.array([0.9, 0.7, 0.5]), metallic=1.0, roughness=0.06)},
        {"lamp": edgegrad.AreaLight(pose, size=np.ones(2), power=60.0)},
        edgegrad.World(np.zeros(3)),
    )


def test_tails_of_wide_lamps() -> None:
    """Lobes much narrower than a lamp: rays with slopes near its angular radius are as rare as beside a small lamp.

    The rays that are left have 2 % of the derivative there, at most.
    """
    need("native")
    step, shift = 0.02, np.zeros((4, 4))
    shift[0, 3] = 1.0
    options = {"max_depth": 2}
    ends = [edgegrad.Renderer(far_from_highlight(side * step)) for side in (1.0, -1.0)]
    pictures = [np.array([end.render(spp=1024, seed=k, **options).sum() for k in range(8)]) for end in ends]
    differences = (pictures[0] - pictures[1]) / (2.0 * step)
    renderer = edgegrad.Renderer(far_from_highlight(0.0))
    found = np.array([renderer.render_forward({"lights.lamp.to_world": shift}, spp=64, seed=k, **options).sum()
                      for k in range(16)])  # fmt: skip
    error = np.sqrt(found.var(ddof=1) / 16 + differences.var(ddof=1) / 8)
    assert abs(found.mean() - differences.mean()) < 5.0 * error + 0.02 * abs(differences.mean())


def coated(coat_roughness: float, moving: str) -> Make:
    """A coat over a rough base, and a box, under a lamp without size; `moving` moves."""

    def make(theta: float) -> edgegrad.Scene:
        step = theta * np.array([0.5, 0.3, -0.2])
        base = edgegrad.Material(np.array([0.7, 0.5, 0.3]), roughness=0.6, coat_weight=1.0,
                                 coat_roughness=coat_roughness)  # fmt: skip
        shown = box((0.2, 0.5, -0.3), (0.25, 0.2, 0.2), "box", 0.4)
        if moving == "box":
            shown = replace(shown, vertices=shown.vertices + step)
        lamp = edgegrad.PointLight(np.array([0.3, 1.2, 0.2]) + (step if moving == "lamp" else 0.0), power=20.0)
        origin = np.array([0.0, 2.0, 2.0]) + (step if moving == "camera" else 0.0)
        return edgegrad.Scene(
            camera(origin, (0, 0, 0), 24, 0.7),
            {"floor": rectangle((0, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"), "box": shown},
            {"floor": base, "box": matte(0.5, 0.6, 0.7)},
            {"lamp": lamp},
            edgegrad.World(np.full(3, 0.2)),
        )

    return make


COATED = {"lamp": "lights.lamp.position", "camera": "camera.to_world", "box": "meshes.box.vertices"}


@pytest.mark.parametrize(("roughness", "moving"), [(0.0, "lamp"), (0.1, "camera"), (0.1, "box")])
def test_coats_leave_the_light_of_what_is_below(roughness: float, moving: str) -> None:
    """Whichever lobe goes on from a surface, the others scatter samples of light."""
    need_every_table()
    options = {"eps": 0.02, "seeds": 8, "spp": 64, "reference_spp": 256, "thetas": 4, "max_depth": 4}
    check_agreement(along(coated(roughness, moving), [COATED[moving]]), **options)


TRANSPOSED = {
    "mirror": (roughened(mirrors_and_glass.CASES["round mirror: mirror moves"][0]), ["meshes.ball.vertices"]),
    "glass": (roughened(mirrors_and_glass.CASES["glass: camera moves"][0]), ["camera.to_world"]),
    "beckmann mirror": (roughened(mirrors_and_glass.CASES["round mirror: mirror moves"][0], 0.14, "BECKMANN"),
                        ["meshes.ball.vertices"]),
    "phong mirror": (roughened(mirrors_and_glass.CASES["flat mirror: mirror moves"][0], 0.14, "ASHIKHMIN_SHIRLEY"),
                     mirrors_and_glass.CASES["flat mirror: mirror moves"][1]),
    "beckmann glass": (roughened(mirrors_and_glass.CASES["glass: camera moves"][0], 0.14, "BECKMANN"),
                       ["camera.to_world"]),
    "coat": (coated(0.1, "box"), ["meshes.box.vertices", "camera.to_world", "lights.lamp.position"]),
}


@pytest.mark.parametrize("name", list(TRANSPOSED))
def test_modes_are_transposes(name: str) -> None:
    need_every_table()
    make, paths = TRANSPOSED[name]
    check_transpose(make, paths, spp=16, seed=3, max_depth=4)


def test_same_bits_for_any_number_of_threads() -> None:
    need_every_table()
    make, paths = TRANSPOSED["coat"]
    check_equal_bits(make, paths, spp=4, max_depth=4)


@pytest.mark.parametrize("kind", glossy_ball.BODIES)
def test_noise_does_not_explode_where_roughness_goes_to_zero(kind: str) -> None:
    """A ball alone has hardly more noise with little roughness than with none."""
    need("native")

    def noise(roughness: float) -> float:
        made = glossy_ball.scene(kind, roughness, "image", "none")
        return glossy_ball.noise(made, "interior", 64, 4, "ball")

    # The noise of lobes that are not followed grows without bound as roughness goes to zero: by hundreds here.
    assert noise(0.02) < 5.0 * noise(0.0)


def test_plan_tells_of_it() -> None:
    make, paths = mirrors_and_glass.CASES["flat mirror: box moves"]
    words = str(edgegrad.plan(roughened(make)(0.0), paths, max_depth=3))
    assert "lobes nearly as narrow (mirror)" in words
    assert "nearly as narrow" not in str(edgegrad.plan(roughened(make, 0.3)(0.0), paths, max_depth=3))
