"""Decisions on derivatives: parts that are decided to be zero are zero, and a call decides the same as its plan."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Bounces, Image, Material, Mesh, Renderer, Scene, SunLight, expression, plan
from edgegrad.derivatives.decisions import Decision, Decisions
from edgegrad.derivatives.table_derivatives import without_derivative
from edgegrad.rendering import one_shot
from edgegrad.rendering import renderer as module
from edgegrad.rendering.engine import engine_class
from edgegrad.rendering.options import checked_options
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.distributions import student_to_normal
from tests.support.rich_scene import everything
from tests.support.small_scenes import camera, glowing, need, standing_box
from tests.torture.checks import LIMITS, directions
from tests.torture.scenes import Case, case, paths_of

FEW, MANY = 330, 4000
SPP = 32
COLLECTIONS = ("lights.", "world.", "lights.", "camera.", "meshes.")
# Tolerance for parts that are zero, relative to the largest pixel of the derivative: sums of float32 in another order.
ROUNDING = 2e-6
# A forced part may share its samples with another one, whose estimate then differs by seed, with the same mean.
SEEDS, WEIGHTINGS, ERROR = 32, 8, 5.0
# Parts that are no separate integral, or follow from others.
NO_INTEGRALS = {"unseen meshes", "followed lobes", "contact", "sharp reflections", "transparency", "favoured lobes",
                "edge-on faces"}


def scene_of(seed: int) -> Case:
    """A random scene. Two of three scenes have one requested parameter only, so that most parts are zero."""
    made = case(seed)
    kind = COLLECTIONS[seed % len(COLLECTIONS)]
    paths = [path for path in paths_of(made.scene) if path.startswith(kind)]
    if seed % 3 and paths:
        made.wrt = (paths[int(np.random.default_rng(seed).integers(len(paths)))],)
    return made


def said(decided: Decisions) -> set[tuple[str, str, str]]:
    return {(d.part, d.outcome, d.reason) for d in decided}


def is_checked(made: Case, decision: Decision) -> bool:
    """Whether a part that is zero can be forced. Paths longer than the picture's are another integral."""
    if decision.outcome != "zero" or decision.part in NO_INTEGRALS:
        return False
    if decision.reason == "not rendered" and decision.part != "shading":
        return False
    # A search for static intersections changes the samples of other intersections, with the same mean.
    return (decision.part, decision.reason) != ("light intersections", "no light")


def check(made: Case, forced: Counter[str]) -> str:
    """Return an error in the decisions on a scene, or "". Counts the forced parts."""
    tangent, _ = directions(made)
    renderer = Renderer(made.scene, threads=1)
    options = {**made.options, "spp": SPP}
    planned = plan(renderer, made.wrt, max_depth=options["max_depth"]).decisions
    if "bounces" in options:
        planned = renderer.decide(made.wrt, max_depth=options["max_depth"], bounces=options["bounces"])
    image = _derivative(renderer, tangent, options)
    found = renderer.last_decisions
    if said(planned) != said(found):
        return f"planned otherwise than computed: {sorted(said(planned) ^ said(found))}"
    unsaid = [d.part for d in found if d.samples > 0.0 and not d.computed]
    if unsaid:
        return f"sampled though called zero: {unsaid}"
    zero = [d.part for d in found if is_checked(made, d)]
    forced.update(zero)
    if not _differs(renderer, tangent, options, image, zero):
        return ""
    changed = [part for part in zero if _differs(renderer, tangent, options, image, [part])]
    wrong = [part for part in changed if abs(_deviate(renderer, tangent, options, part)) > ERROR]
    return f"not zero: {wrong}" if wrong else ""


def _derivative(
    renderer: Renderer, tangent: dict[str, Any], options: dict[str, Any], force: Sequence[str] = ()
) -> NDArray[np.float32]:
    """Return the derivative with one pass over edges. With two, a part without noise takes samples from others."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "checked_options",
                      lambda *a: replace(checked_options(*a), two_passes=False, force=tuple(force)))
        return renderer.render_forward(tangent, **options)


def _deviate(renderer: Renderer, tangent: dict[str, Any], options: dict[str, Any], part: str) -> float:
    """The largest normal deviate of what forcing a part changes, of sums over the picture with random signs."""
    sums = []
    for seed in range(SEEDS):
        own = {**options, "seed": seed}
        change = _derivative(renderer, tangent, own, [part]) - _derivative(renderer, tangent, own).astype(np.float64)
        signs = np.random.default_rng(1).choice([-1.0, 1.0], (WEIGHTINGS - 1, *change.shape))
        sums.append([change.sum(), *(signs * change).sum(axis=(1, 2, 3))])
    mean, error = np.mean(sums, axis=0), np.std(sums, axis=0, ddof=1) / np.sqrt(SEEDS)
    t = np.where(error > 0.0, mean / np.where(error > 0.0, error, 1.0), 0.0)
    return float(np.abs(student_to_normal(t, np.full(len(t), SEEDS - 1.0))).max())


def _differs(
    renderer: Renderer, tangent: dict[str, Any], options: dict[str, Any], image: NDArray[np.float32], parts: list[str]
) -> bool:
    """Whether the derivative changes if the engine computes these parts."""
    found = _derivative(renderer, tangent, options, parts)
    slack = ROUNDING * float(np.nanmax(np.abs(image), initial=0.0))
    return not np.allclose(found, image, rtol=0.0, atol=slack, equal_nan=True)


def _check_scenes(seeds: range) -> Counter[str]:
    need("native")
    if engine_class("native").narrow:
        pytest.skip("this engine differentiates few tables")
    wrong, forced = {}, Counter[str]()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of samples that no float holds
        for seed in seeds:
            try:
                outcome = check(scene_of(seed), forced)
            except ValueError as error:
                if not any(limit in str(error) for limit in LIMITS):
                    raise
                continue
            if outcome:
                wrong[seed] = outcome
    assert wrong == {}
    return forced


def test_what_is_called_zero_is_zero_in_random_scenes() -> None:
    forced = _check_scenes(range(FEW))
    missed = {"shading", "edges", "light shadows", "environment shadows", "horizons", "edges between surfaces",
              "light outlines", "light intersections", "mirrored edges"} - set(forced)  # fmt: skip
    assert not missed, "of these parts none was zero"


@pytest.mark.parametrize("seed", [0, 2, 10, 21, 23, 31])
def test_the_light_of_a_moving_field_moves_behind_horizons(seed: int) -> None:
    need("native")
    if engine_class("native").narrow:
        pytest.skip("this engine differentiates few tables")
    made = case(seed)
    made.wrt = ("fields.field.0.upper",)
    assert check(made, Counter()) == ""


@pytest.mark.slow
def test_what_is_called_zero_is_zero_in_many_random_scenes() -> None:
    _check_scenes(range(FEW, MANY))


def test_custom_normals_alone_change_shading() -> None:
    need("native")
    vertices, faces = shapes.sheet(5, 20.0)
    normals = np.array([[0.3, 0.1, 1.0]])
    mesh = Mesh(vertices, faces, ("clay",), smoothing=np.zeros_like(faces), normals=normals)
    scene = Scene(camera(), {"object": mesh}, {"clay": Material(np.full(3, 0.7))},
                  {"sun": SunLight(np.array([-0.8, 0.0, -1.0]), 2.0)})
    path = "meshes.object.normals"
    image = Renderer(scene).render_forward({path: np.ones_like(normals)}, spp=8, terms=["interior"])
    assert np.abs(image).max() > 1e-3


def test_a_call_reports_samples_and_seconds() -> None:
    need("native")
    made = case(1)
    renderer = Renderer(made.scene)
    tangent, adjoint = directions(made)
    for run in (lambda: renderer.render_forward(tangent, **made.options),
                lambda: renderer.render_backward(adjoint, made.wrt, **made.options)):
        run()
        shading = {d.part: d for d in renderer.last_decisions}["shading"]
        assert shading.computed and shading.samples > 0.0 and shading.seconds > 0.0


def rippled() -> Scene:
    """A sheet that may shade itself."""
    vertices, faces = shapes.sheet(6)
    vertices[:, 2] = 0.2 * np.sin(4.0 * vertices[:, 0])
    return shapes.scene(vertices, faces)


def test_decisions_trace_no_ray() -> None:
    """A plan builds no BVH, and does not change the bits of later derivatives."""
    need("native")
    made = rippled()
    renderer = Renderer(made, threads=1, engine="native")
    wrt = ["meshes.object.vertices", "camera.to_world"]
    assert any(decision.computed for decision in renderer.decide(wrt))
    assert not renderer._engine._scene.has_bvh
    vertices = made.meshes["object"].vertices
    vertices += 0.01 * np.sin(7.0 * vertices[:, ::-1])
    renderer.update(wrt)
    assert not renderer._engine._scene.has_bvh
    tangent = {wrt[0]: np.ones_like(vertices)}
    derivative = renderer.render_forward(tangent, spp=2)
    assert renderer._engine._scene.has_bvh
    np.testing.assert_array_equal(derivative, Renderer(made, threads=1, engine="native").render_forward(tangent, spp=2))


def test_a_plan_validates_the_scene_once(monkeypatch: pytest.MonkeyPatch) -> None:
    need("native")
    made = rippled()
    calls: list[str] = []
    validate = Mesh.validate
    monkeypatch.setattr(one_shot, "_last", {})  # no renderer of an earlier test
    monkeypatch.setattr(Mesh, "validate", lambda mesh, name: (calls.append(name), validate(mesh, name))[1])
    made.meshes["other"] = replace(made.meshes["object"], vertices=made.meshes["object"].vertices + 3.0)
    plan(made, ["meshes.object.vertices"])
    assert sorted(calls) == ["object", "other"]


def test_the_engine_tells_its_limits() -> None:
    """Sentences name the numbers that come with the decisions."""
    need("native")
    if engine_class("native").narrow:
        pytest.skip("this engine differentiates few tables")
    made = rippled()
    made.materials["clay"] = Material(kind="GLOSSY", roughness=0.0)
    said = plan(made, ["meshes.object.vertices"], max_depth=40)
    chains = next(decision for decision in said.decisions if decision.part == "long chains")
    assert chains.limit > 2 and any(f"chains of more than {chains.limit} surfaces" in line for line in said.missing)
    shorter = plan(made, ["meshes.object.vertices"], max_depth=chains.limit).decisions
    assert shorter and "long chains" not in {decision.part for decision in shorter}


def test_what_the_camera_alone_sees_neither_lights_nor_hides_anything() -> None:
    """A backdrop that glows for the camera takes no samples of shadows."""
    need("native")
    scene, alone = standing_box(), Renderer(standing_box())
    scene.materials["glow"] = glowing(3.0, True)
    vertices, faces = shapes.sheet(20)
    scene.meshes["photo"] = Mesh(vertices - [0.0, 0.0, 3.0], faces, ("glow",), visible_to=frozenset({"camera"}))
    tangent = {"meshes.box.vertices": np.tile([0.3, 0.2, 0.1], (len(scene.meshes["box"].vertices), 1))}
    behind = Renderer(scene)
    one, other = (r.render_forward(tangent, spp=64, max_depth=3, terms=["shadow"]) for r in (alone, behind))
    assert np.abs(one - other).mean() < 0.1 * np.abs(one).mean()
    kept = [[(d.part, d.outcome, d.edges.kept) for d in r.last_decisions if d.term == "shadow"]
            for r in (alone, behind)]  # fmt: skip
    assert kept[0] == kept[1]


def test_images_that_keep_a_surface_rough_make_no_mirror_of_it() -> None:
    """A map of roughness without zeros: nothing is searched for in mirrors, until an update brings one."""
    need("native")
    scene = standing_box()
    rough = np.random.default_rng(0).uniform(0.3, 0.8, (8, 8, 3)).astype(np.float32)
    scene.images["rough"] = Image(rough)
    mesh = scene.meshes["floor"]
    mesh.attributes["UVMap"] = (0.2 * mesh.vertices[mesh.faces][..., :2]).astype(np.float32)
    image = expression.ImageTexture("rough", expression.Attribute("UVMap"))
    scene.materials["floor"] = Material(np.full(3, 0.8), kind="GLOSSY",
                                        textures={"roughness": expression.Channel(image, 0)})  # fmt: skip
    tangent = {"meshes.box.vertices": np.ones_like(scene.meshes["box"].vertices)}
    renderer = Renderer(scene)
    for least, outcome in ((0.3, "zero"), (0.0, "computed"), (0.3, "zero")):
        pixels = rough.copy()
        pixels[2, 3] = least
        scene.images["rough"].pixels = pixels
        renderer.update()
        renderer.render_forward(tangent, spp=2)
        mirrored = next(d for d in renderer.last_decisions if d.part == "mirrored edges")
        assert mirrored.outcome == outcome
        assert (outcome == "computed") == any("in mirrors" in said for said in plan(scene, list(tangent)).missing)


def test_plans_know_how_paths_bounce() -> None:
    """Filter Glossy makes smooth glass rough, and rough glass has directions behind which it scatters nothing."""
    need("native")
    scene = shapes.scene(*shapes.ball(2))
    scene.materials = dict.fromkeys(scene.materials, Material(kind="GLASS", roughness=0.0))
    path = "meshes.object.vertices"

    def with_rims(filter_glossy: float) -> bool:
        found = plan(scene, [path], max_depth=4, bounces=Bounces(filter_glossy=filter_glossy))
        return any("scatter no light" in why for term in found.terms for why in term.why)

    assert with_rims(1.0) and not with_rims(0.0)


def boxes_through_sheet() -> Scene:
    """Twelve boxes that stand in a sheet of many faces, each turned by another angle."""
    vertices, faces = shapes.sheet(12, 6.0)
    meshes = {"sheet": Mesh(vertices, faces, ("clay",))}
    for k in range(12):
        corners, sides = shapes.cube(0.8)
        c, s = np.cos(0.1 + 0.1 * k), np.sin(0.1 + 0.1 * k)
        place = [1.4 * (k % 4) - 2.1, 1.4 * (k // 4) - 1.4, 0.13]
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        meshes[f"box {k}"] = Mesh(corners @ turn + place, sides, ("clay",))
    return Scene(camera((0.0, -5.0, 6.0), (0.0, 0.0, 0.0), 24), meshes, {"clay": Material()},
                 {"sun": SunLight(np.array([0.3, 0.4, -1.0]))})


def test_many_meshes_that_pass_through_one_are_all_found() -> None:
    # The search looks at all faces of a mesh at first, and in a tree once it has searched it a few times.
    scene = boxes_through_sheet()
    paths = [f"meshes.box {k}.vertices" for k in range(12)]
    decided = next(d for d in Renderer(scene).decide(paths) if d.part == "seen intersections")
    assert [sorted(pair) for pair in decided.pairs] == [[0, k] for k in range(1, 13)]


@pytest.mark.parametrize("depth", [1, 3])
def test_each_of_many_parameters_changes_what_it_changes_alone(depth: int) -> None:
    need("native")
    scene = everything()
    renderer = Renderer(scene, threads=1)
    # Requested emission makes all surfaces ones that may emit
    paths = [path for path in parameters.paths(scene)
             if without_derivative(path) is None and not path.endswith(".emission")]

    def reasons(wrt: list[str]) -> list[str]:
        shading = next(d for d in renderer.decide(wrt, max_depth=depth) if d.part == "shading")
        kinds, places = shading.by_parameter
        return [kinds[place][0] for place in places]

    together = reasons(paths)
    assert len(together) == len(paths) and {"needed", "unread"} <= {*together}
    assert together == [reason for path in paths for reason in reasons([path])]
