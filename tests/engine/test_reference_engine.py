"""The reference engine: forward and reverse mode are transposes, derivatives agree with central differences.

Its closed forms are in `test_closed_forms`, its comparison with another renderer in `test_references`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.derivatives.table_derivatives import ParameterMap, with_requested
from edgegrad.reference import Engine
from edgegrad.reference.engine import TERMS
from edgegrad.rendering.options import RenderOptions
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene import parameters
from edgegrad.tables import tables as flat
from tests.support.block_statistics import (
    ALARM,
    NOTICED,
    check,
    check_noticed,
    compare,
    half_width,
    means_p_value,
    normal_p_value,
)
from tests.support.small_scenes import (
    MOTIONS,
    Floats,
    Moving,
    box,
    camera,
    central_difference,
    crease_sheet,
    floating_box,
    matte,
    split,
    translated,
    white_world,
)

# One path of every kind that has a derivative.
PATHS = [
    "meshes.box.vertices",
    "meshes.floor.vertices",
    "meshes.lamp.vertices",
    "materials.clay.base_color",
    "materials.lamp.emission",
    "materials.floor.emission",
    "lights.area.power",
    "lights.area.color",
    "lights.point.power",
    "lights.point.color",
    "lights.sun.strength",
    "lights.sun.color",
    "world.color",
    "world.strength",
]


def make_engine(scene: edgegrad.Scene, threads: int = 2) -> tuple[Engine, flat.Tables]:
    tables = flat.flatten(scene)
    engine = Engine(tables, threads)
    engine.set_edges(tables.edges())
    return engine, tables


def random_tangent(scene: edgegrad.Scene, paths: list[str]) -> dict[str, Floats]:
    rng = np.random.default_rng(7)
    return {p: rng.normal(size=np.shape(parameters.get(scene, p))) for p in paths}


# ---------------------------------------------------------------- forward against reverse
@pytest.mark.parametrize("paths", [[p] for p in PATHS] + [PATHS], ids=[*PATHS, "all"])
def test_forward_and_reverse_are_transposes(paths: list[str]) -> None:
    scene = floating_box()
    engine, tables = make_engine(scene)
    tangent = random_tangent(scene, paths)
    adjoint = np.random.default_rng(8).normal(size=(32, 32, 3)).astype(np.float32)
    tables = with_requested(scene, tables, paths)
    derivative = ParameterMap(scene, tables, paths)
    wanted = derivative.requested
    options = RenderOptions(4, 3)
    image = engine.forward_exact(tables, derivative.push_forward(tangent), wanted, options)
    gradient = derivative.pull_back(engine.backward(tables, adjoint, wanted, options))
    forward = float(np.sum(image * adjoint))
    reverse = sum(float(np.sum(gradient[p] * tangent[p])) for p in paths)
    assert forward != 0.0
    assert reverse == pytest.approx(forward, rel=1e-10, abs=1e-12 * float(np.abs(image).sum()))


@pytest.mark.parametrize("term", TERMS)
def test_each_term_is_transposed(term: str) -> None:
    scene = floating_box()
    engine, tables = make_engine(scene)
    tangent = random_tangent(scene, PATHS)
    adjoint = np.random.default_rng(8).normal(size=(32, 32, 3)).astype(np.float32)
    tables = with_requested(scene, tables, PATHS)
    derivative = ParameterMap(scene, tables, PATHS)
    wanted, velocity = derivative.requested, derivative.push_forward(tangent)
    image = engine.forward_exact(tables, velocity, wanted, RenderOptions(4, 3, terms=(term,)))
    gradient = engine.backward(tables, adjoint, wanted, RenderOptions(4, 3, terms=(term,)))
    reverse = sum(float(np.sum(gradient[name] * part)) for name, part in velocity.items())
    assert float(np.sum(image * adjoint)) == pytest.approx(reverse, rel=1e-10)


def test_float32_pictures_are_the_exact_ones() -> None:
    scene = floating_box()
    engine, tables = make_engine(scene)
    tangent = random_tangent(scene, ["meshes.box.vertices"])
    derivative = ParameterMap(scene, tables, tangent)
    velocity, wanted = derivative.push_forward(tangent), derivative.requested
    options = RenderOptions(2, 3)
    exact = engine.forward_exact(tables, velocity, wanted, options)
    image = engine.forward(tables, velocity, wanted, options)
    assert image.dtype == np.float32
    assert image == pytest.approx(exact, rel=1e-6)


# ---------------------------------------------------------------- against central differences
@pytest.mark.slow
@pytest.mark.parametrize("name", list(MOTIONS))
def test_motion_agrees_with_central_differences(name: str) -> None:
    make, eps = MOTIONS[name], 0.02
    difference, stderr = central_difference(make, eps, 256, 16, "reference")
    thetas = eps * ((np.arange(8) + 0.5) / 8 - 0.5)
    samples = np.stack([[_forward(make, theta, 32, 2 * k + s) for s in range(2)] for k, theta in enumerate(thetas)])
    outcome = compare(samples, difference, stderr)
    print(outcome)
    check(outcome)
    assert outcome.noticed(ALARM) < NOTICED


@pytest.mark.slow
def test_shading_by_construction_is_noticed_when_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison above notices that rule A4 is missing: without it a folded sheet leaks light along its crease."""
    make, eps = MOTIONS["concave sheet moves"], 0.02
    difference, stderr = central_difference(make, eps, 256, 16, "reference")
    monkeypatch.setattr(
        "edgegrad.reference.light.Points.hidden_by_arms", lambda self, row, w: np.zeros(len(w), bool)
    )
    samples = np.stack([_forward(make, 0.0, 32, k) for k in range(8)])
    check_noticed(compare(samples, difference, stderr))


def _forward(make: Moving, theta: float, spp: int, seed: int) -> Floats:
    scene, tangent = make(theta)
    return Renderer(scene, engine="reference").render_forward(tangent, spp=spp, seed=seed).astype(np.float64)


# ---------------------------------------------------------------- invariances
def total(scene: edgegrad.Scene, rate: Floats, seed: int, spp: int = 8) -> float:
    """<adjoint, derivative> for the mesh "box" with an adjoint that grows to the right."""
    adjoint = np.broadcast_to(np.linspace(-1.0, 1.0, 32)[None, :, None] * (1.0, 0.7, 0.4), (32, 32, 3))
    image = Renderer(scene, engine="reference").render_forward({"meshes.box.vertices": rate}, spp=spp, seed=seed)
    return float(np.sum(adjoint * image.astype(np.float64)))


def check_means(a: list[float], b: list[float]) -> None:
    """The means of two lists of estimates agree, which they wouldn't if one were wrong by itself."""
    assert half_width(a) < abs(np.mean(a))
    check(means_p_value(a, b))


def boxed(mesh: edgegrad.Mesh) -> edgegrad.Scene:
    scene = floating_box()
    scene.meshes = {**scene.meshes, "box": mesh}
    return scene


def drift(mesh: edgegrad.Mesh) -> Floats:
    """A stretching motion to the right."""
    return np.array([1.0, 0.3, 0.2]) * (1.0 + 0.5 * mesh.vertices)


def degenerate(mesh: edgegrad.Mesh) -> edgegrad.Mesh:
    """The mesh with triangles without area: a repeated corner, two equal vertices, three in a line."""
    v, n = mesh.vertices, len(mesh.vertices)
    extra = np.stack([v[0], 0.5 * (v[0] + v[1])])
    faces = [[0, 0, 1], [0, n, 1], [2, 3, 3]]
    return edgegrad.Mesh(
        np.concatenate([v, extra]), np.concatenate([mesh.faces, np.array(faces, np.int32)]), mesh.materials
    )


def permuted(mesh: edgegrad.Mesh) -> edgegrad.Mesh:
    """The mesh with faces and their corners in another order."""
    faces = mesh.faces[np.random.default_rng(0).permutation(len(mesh.faces))]
    return edgegrad.Mesh(mesh.vertices, np.roll(faces, 1, axis=1), mesh.materials)


def subdivided(mesh: edgegrad.Mesh) -> edgegrad.Mesh:
    """Each face in four, in its own plane, with vertices of their own."""
    p = mesh.vertices[mesh.faces]
    p0, p1, p2 = np.moveaxis(p, 1, 0)
    m0, m1, m2 = np.moveaxis(0.5 * (p + np.roll(p, -1, axis=1)), 1, 0)
    parts = [[p0, m0, m2], [m0, p1, m1], [m2, m1, p2], [m0, m1, m2]]
    corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    return edgegrad.Mesh(
        corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3), mesh.materials
    )


@pytest.mark.parametrize("change", [split, degenerate, permuted, subdivided])
def test_storage_does_not_matter(change: Callable[[edgegrad.Mesh], edgegrad.Mesh]) -> None:
    plain = floating_box().meshes["box"]
    other = change(plain)
    a = [total(boxed(plain), drift(plain), k) for k in range(8)]
    b = [total(boxed(other), drift(other), 100 + k) for k in range(8)]
    check_means(a, b)


def test_third_face_without_jump_changes_nothing() -> None:
    """A triangle stored twice: two faces on one side of each of its edges, three on the others."""
    plain = floating_box().meshes["box"]
    doubled = edgegrad.Mesh(plain.vertices, np.concatenate([plain.faces, plain.faces[:3]]), plain.materials)
    a = [total(boxed(plain), drift(plain), k) for k in range(8)]
    b = [total(boxed(doubled), drift(doubled), 100 + k) for k in range(8)]
    check_means(a, b)


def test_zero_area_triangles_change_no_bit_of_the_picture() -> None:
    plain = floating_box()
    other = boxed(degenerate(plain.meshes["box"]))
    images = [Renderer(s, engine="reference").render(spp=4) for s in (plain, other)]
    assert np.array_equal(images[0], images[1])


def test_static_scene_has_no_boundary() -> None:
    """Colours sweep over nothing: the boundary terms are exactly zero."""
    tangent: dict[str, Any] = {"materials.clay.base_color": np.ones(3), "world.strength": 1.0}
    image = Renderer(floating_box(), engine="reference").render_forward(tangent, spp=2, terms=("primary", "shadow"))
    assert not image.any()


def test_still_meshes_get_no_gradient() -> None:
    scene = floating_box()
    engine, tables = make_engine(scene)
    wanted = ParameterMap(scene, tables, ["meshes.box.vertices"]).requested
    gradient = engine.backward(tables, np.ones((32, 32, 3), np.float32), wanted, RenderOptions(2))
    assert set(gradient) == {"vertices"}
    ((first, last),) = wanted["vertices"]
    assert gradient["vertices"][first:last].any()
    assert not gradient["vertices"][:first].any() and not gradient["vertices"][last:].any()


# ---------------------------------------------------------------- the engine as a tool
def test_threads_change_no_bit() -> None:
    scene = floating_box()
    tangent = random_tangent(scene, ["meshes.box.vertices"])
    images = [
        Renderer(scene, engine="reference", threads=n).render_forward(tangent, spp=8, seed=5) for n in (1, 3)
    ]
    assert np.array_equal(images[0], images[1])


def test_pixels_with_more_samples_than_a_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their samples go on in the same sequence."""
    scene = floating_box()
    scene.camera.width = scene.camera.height = 4
    images = []
    for chunk in (64, 48, 7):
        monkeypatch.setattr("edgegrad.reference.radiance.CHUNK", chunk)
        images.append(Renderer(scene, engine="reference").render(spp=64))
    assert images[1] == pytest.approx(images[0], rel=1e-5)
    assert images[2] == pytest.approx(images[0], rel=1e-5)


def test_seeds_are_independent() -> None:
    renderer = Renderer(floating_box(), engine="reference")
    expected = renderer.render(spp=256, seed=9).astype(np.float64)
    deviations = [(renderer.render(spp=1, seed=k) - expected).ravel() for k in range(2)]
    # The correlation coefficient of n independent pairs has the standard deviation 1/sqrt(n); channels share samples.
    pixels = deviations[0].size / 3.0
    check(normal_p_value(np.corrcoef(deviations[0], deviations[1])[0, 1] * np.sqrt(pixels)))


def test_progress_reaches_one_and_can_cancel() -> None:
    seen: list[float] = []
    renderer = Renderer(floating_box(), engine="reference")
    tangent: Mapping[str, Floats] = random_tangent(renderer.scene, ["meshes.box.vertices"])
    renderer.render_forward(tangent, spp=256, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
    assert len(seen) > 3

    class StopError(RuntimeError):
        pass

    def stop(fraction: float) -> None:
        raise StopError

    with pytest.raises(StopError):
        renderer.render(spp=2, progress=stop)


def test_wrong_options_are_named() -> None:
    engine, tables = make_engine(crease_sheet())
    with pytest.raises(ValueError, match="max_depth must be 1 or 2"):
        engine.render(tables, RenderOptions(1, max_depth=3))
    with pytest.raises(ValueError, match="spp"):
        engine.render(tables, RenderOptions(0))
    with pytest.raises(ValueError, match="unknown term 'caustics'"):
        engine.forward(tables, {}, {}, RenderOptions(1, terms=("caustics",)))


def test_scene_without_meshes_shows_the_world() -> None:
    scene = edgegrad.Scene(camera(size=4), world=white_world(2.0))
    assert Renderer(scene, engine="reference").render(spp=1) == pytest.approx(np.full((4, 4, 3), 2.0))


def test_update_takes_over_moved_vertices() -> None:
    scene = edgegrad.Scene(
        camera(), {"box": box((0, 0, 0), (0.5, 0.5, 0.5), "clay")}, {"clay": matte()}, world=white_world()
    )
    renderer = Renderer(scene, engine="reference")
    renderer.render(spp=1)
    scene.meshes["box"].vertices = scene.meshes["box"].vertices + np.array([0.4, 0.0, 0.0])
    renderer.update()
    # the origin that positions are relative to stays the first one: equal up to rounding
    fresh = Renderer(scene, engine="reference").render(spp=4)
    assert renderer.render(spp=4).mean() == pytest.approx(fresh.mean(), rel=1e-3)


def test_motion_helper_moves_as_it_says() -> None:
    make = translated(crease_sheet, "sheet", (1.0, 0.0, 0.0))
    (ahead, tangent), (behind, _) = make(0.5), make(-0.5)
    moved = ahead.meshes["sheet"].vertices - behind.meshes["sheet"].vertices
    assert moved == pytest.approx(tangent["meshes.sheet.vertices"])
