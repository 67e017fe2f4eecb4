"""The native engine: determinism, instruction sets, cancelling, updates, meshes that are skipped."""

from __future__ import annotations

import signal
from itertools import pairwise

import numpy as np
import pytest

import edgegrad
from edgegrad.derivatives.table_derivatives import ParameterMap, with_requested
from edgegrad.rendering.options import RenderOptions
from tests.support.block_statistics import ALARM, NOTICED, check, compare

native_engine = pytest.importorskip("edgegrad.rendering.native_engine", reason="the native module isn't built")


def boxes(res: int = 48, *, world: float = 0.2, shift: float = 0.0) -> edgegrad.Scene:
    """A turned box over a floor under an area light, a point light, a sun and a dim sky."""
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])
    c, s = np.cos(0.5), np.sin(0.5)
    turn, tilt = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    turned = 0.5 * cube @ (tilt @ turn).T + [0, 0, 1.1]
    floor = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], float)
    light = np.eye(4)
    light[:3, 3] = [1.0, -0.5, 4.0]
    pose = np.array([[1, 0, 0, 0], [0, 0.6, -0.8, -3.6], [0, 0.8, 0.6, 3.4], [0, 0, 0, 1]], float)
    offset = np.full(3, shift)
    light[:3, 3] += offset
    pose[:3, 3] += offset
    return edgegrad.Scene(
        edgegrad.Camera(pose, 0.7, res, res),
        {
            "box": edgegrad.Mesh(turned + offset, faces, ("clay",)),
            "floor": edgegrad.Mesh(floor + offset, np.array([[0, 1, 2], [0, 2, 3]]), ("grey",)),
        },
        {
            "clay": edgegrad.Material(np.array([0.8, 0.4, 0.2]), np.array([0.02, 0.0, 0.01])),
            "grey": edgegrad.Material(np.full(3, 0.5)),
        },
        {
            "key": edgegrad.AreaLight(light, np.array([0.8, 0.5]), "ELLIPSE", 60.0),
            "lamp": edgegrad.PointLight(np.array([-1.5, -1.0, 2.5]) + offset, 20.0, color=np.array([1.0, 0.8, 0.6])),
            "sun": edgegrad.SunLight(np.array([0.3, 0.2, -1.0]), 0.4),
        },
        edgegrad.World(np.full(3, world)),
    )


WRT = [
    "meshes.box.vertices",
    "meshes.floor.vertices",
    "materials.clay.base_color",
    "materials.clay.emission",
    "lights.key.power",
    "lights.lamp.color",
    "lights.sun.strength",
    "world.color",
]


def tangent(scene: edgegrad.Scene, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {path: rng.normal(size=np.shape(edgegrad.parameters.get(scene, path))) for path in WRT}


def adjoint(scene: edgegrad.Scene) -> np.ndarray:
    shape = (scene.camera.height, scene.camera.width, 3)
    return np.random.default_rng(5).normal(size=shape).astype(np.float32)


def test_bits_do_not_depend_on_threads_or_run() -> None:
    scene = boxes()
    velocity, weights = tangent(scene), adjoint(scene)
    results = []
    for threads in (1, 2, 5, 2):
        r = edgegrad.Renderer(scene, threads=threads, engine="native")
        image = r.render(spp=8, seed=3)
        forward = r.render_forward(velocity, spp=8, seed=3)
        gradients = r.render_backward(weights, WRT, spp=8, seed=3)
        results.append([image, forward, *gradients.values()])
    for other in results[1:]:
        for a, b in zip(results[0], other, strict=True):
            assert np.array_equal(a, b)


def test_seeds_differ() -> None:
    r = edgegrad.Renderer(boxes(), engine="native")
    assert not np.array_equal(r.render(spp=4, seed=0), r.render(spp=4, seed=1))


@pytest.mark.parametrize("path", WRT)
def test_forward_and_backward_are_transposes(path: str) -> None:
    scene = boxes()
    r = edgegrad.Renderer(scene, engine="native")
    v = {path: tangent(scene)[path]}
    w = adjoint(scene)
    for terms in (("interior",), ("primary",), ("shadow",), edgegrad.TERMS):
        jv = r.render_forward(v, spp=8, seed=7, terms=terms).astype(np.float64)
        jtw = r.render_backward(w, [path], spp=8, seed=7, terms=terms)[path]
        left, right = float((jv * w).sum()), float((jtw * v[path]).sum())
        scale = float(np.linalg.norm(jv) * np.linalg.norm(w))
        # The sum of many terms of both signs: float32 rounding is relative to their size, not the sum's.
        assert abs(left - right) <= 1e-4 * max(abs(left), 1e-2 * scale)


@pytest.mark.parametrize("name", native_engine.instruction_sets())
def test_instruction_sets_agree(name: str) -> None:
    scene = boxes()
    tables = edgegrad.tables.tables.flatten(scene)
    tables = with_requested(scene, tables, WRT)
    derivative = ParameterMap(scene, tables, WRT)
    wanted, velocity = derivative.requested, derivative.push_forward(tangent(scene))
    options = RenderOptions(8, 1, two_passes=False)  # after a first pass rounding would move samples
    results = []
    for isa in ("scalar", name):
        engine = native_engine.Engine(tables, 2, isa)
        engine.set_edges(tables.edges())
        assert engine.instruction_set == isa
        results.append(
            (engine.render(tables, options), engine.forward(tables, velocity, wanted, options))
        )
    for a, b in zip(*results, strict=True):
        # The same samples: only rounding differs, and rays that graze an edge within it.
        different = np.abs(a - b) > 1e-3 * np.abs(a).max()
        assert different.mean() < 0.01
        assert abs(float(a.mean()) - float(b.mean())) < 1e-3 * float(np.abs(a).mean())


def test_unknown_instruction_set_is_named() -> None:
    tables = edgegrad.tables.tables.flatten(boxes())
    with pytest.raises(ValueError, match="'mmx' is not available here"):
        native_engine.Engine(tables, 1, "mmx")


def test_cancelling_leaves_a_usable_renderer() -> None:
    r = edgegrad.Renderer(boxes(256), engine="native")
    before = r.render(spp=1, seed=2)

    def stop(fraction: float) -> None:
        assert 0.0 <= fraction <= 1.0
        raise edgegrad.Cancelled

    with pytest.raises(edgegrad.Cancelled):
        r.render(spp=256, progress=stop)
    with pytest.raises(edgegrad.Cancelled):
        r.render_backward(adjoint(boxes(256)), WRT, spp=256, progress=stop)
    assert np.array_equal(before, r.render(spp=1, seed=2))


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no interval timer here")
def test_ctrl_c_works_without_a_callback() -> None:
    r = edgegrad.Renderer(boxes(512), engine="native")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(KeyboardInterrupt):
            r.render(spp=4096)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)


def test_progress_grows_to_one() -> None:
    scene = boxes(192)
    r = edgegrad.Renderer(scene, engine="native")
    for call in (
        lambda report: r.render(spp=64, progress=report),
        lambda report: r.render_forward(tangent(scene), spp=32, progress=report),
        lambda report: r.render_backward(adjoint(scene), WRT, spp=32, progress=report),
    ):
        seen: list[float] = []
        call(seen.append)
        assert seen[-1] == pytest.approx(1.0) and all(a <= b for a, b in pairwise(seen))


def test_zero_adjoint_gives_zero_gradient() -> None:
    scene = boxes()
    gradients = edgegrad.Renderer(scene, engine="native").render_backward(
        np.zeros((48, 48, 3), np.float32), WRT, spp=4
    )
    assert all(not g.any() for g in gradients.values())


def test_far_worlds_render_alike() -> None:
    near = edgegrad.render(boxes(), spp=4, engine="native")
    far = edgegrad.render(boxes(shift=1e5), spp=4, engine="native")
    assert (np.abs(near - far) > 1e-3).mean() < 0.01


def test_update_follows_moved_vertices() -> None:
    scene = boxes()
    r = edgegrad.Renderer(scene, engine="native")
    for step in (0.01, 0.01, 0.5, 0.01):  # first motion, refit, rebuild, refit
        scene.meshes["box"].vertices = scene.meshes["box"].vertices + [step, 0, 0]
        r.update()
        fresh = edgegrad.Renderer(scene, engine="native")
        # The origin of the tables is kept, so that rounding may differ by a few rays.
        assert (np.abs(r.render(spp=4) - fresh.render(spp=4)) > 1e-3).mean() < 0.01


def test_update_refuses_another_topology() -> None:
    scene = boxes()
    r = edgegrad.Renderer(scene, engine="native")
    box = scene.meshes["box"]
    box.faces = box.faces[:-1]
    with pytest.raises(ValueError, match="topology has changed"):
        r.update()


def test_zero_area_triangles_change_nothing() -> None:
    scene, other = boxes(), boxes()
    box = other.meshes["box"]
    box.faces = np.concatenate([box.faces, [[0, 0, 1], [2, 2, 2], [0, 6, 6]]])
    a = edgegrad.Renderer(scene, engine="native")
    b = edgegrad.Renderer(other, engine="native")
    assert np.array_equal(a.render(spp=4), b.render(spp=4))
    v = {"meshes.box.vertices": np.tile([1.0, 0.3, 0.2], (8, 1))}
    da, db = (np.array([r.render_forward(v, spp=8, seed=k) for k in range(16)], np.float64) for r in (a, b))
    assert np.isfinite(db).all()
    outcome = compare(db, da.mean(axis=0), da.std(axis=0, ddof=1) / 4.0)
    check(outcome)
    assert outcome.noticed(ALARM) < NOTICED


def test_a_scene_of_background_alone() -> None:
    scene = edgegrad.Scene(edgegrad.Camera(np.eye(4), 0.7, 8, 8), world=edgegrad.World(np.array([0.1, 0.2, 0.3])))
    image = edgegrad.render(scene, spp=2, engine="native")
    assert np.allclose(image, [0.1, 0.2, 0.3])
    gradient = edgegrad.render_backward(scene, np.ones((8, 8, 3)), ["world.color"], spp=2, engine="native")
    assert np.allclose(gradient["world.color"], 64.0)


def alike(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two pictures of the same samples differ by no more than rounding, and few rays that it turns."""
    return bool((np.abs(a - b) > 1e-3 * max(float(np.abs(b).max()), 1e-6)).mean() < 0.01)


def box_alone(*, beside: bool, clip_start: float = 0.01) -> edgegrad.Scene:
    """The box of `boxes` in a constant environment with a point light, and a small triangle behind it on request."""
    scene = boxes(world=0.5)
    meshes = {"box": edgegrad.Mesh(scene.meshes["box"].vertices, scene.meshes["box"].faces, ("grey",))}
    if beside:
        speck = np.array([[0, 8, -4.9], [0.01, 8, -4.9], [0, 8, -4.89]], float)
        meshes["speck"] = edgegrad.Mesh(speck, np.array([[0, 1, 2]]), ("grey",))
    scene.camera.clip_start = clip_start
    return edgegrad.Scene(scene.camera, meshes, scene.materials, {"lamp": scene.lights["lamp"]}, scene.world)


def test_a_convex_body_alone_is_skipped_rightly() -> None:
    # The speck turns the rule off, but nothing that is seen sees it.
    skipped = edgegrad.Renderer(box_alone(beside=False), engine="native")
    traced = edgegrad.Renderer(box_alone(beside=True), engine="native")
    assert alike(skipped.render(spp=16), traced.render(spp=16))
    v = {"meshes.box.vertices": np.random.default_rng(1).normal(size=(8, 3))}
    for term in ("interior", "shadow"):
        a, b = (r.render_forward(v, spp=16, terms=(term,)) for r in (skipped, traced))
        assert alike(a, b)
        if term == "shadow":
            assert not a.any() and not b.any()


def sheet_alone(*, beside: bool) -> edgegrad.Scene:
    """`box_alone` with its front alone, of two faces, which its lamp lights from the side."""
    scene = box_alone(beside=beside)
    corners = np.array([[-1, -0.2, -1], [1, 0.1, -1], [1, 0.1, 1], [-1, -0.2, 1]], float)
    scene.meshes["box"] = edgegrad.Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), ("grey",))
    return scene


def test_a_flat_sheet_alone_is_skipped_rightly() -> None:
    skipped = edgegrad.Renderer(sheet_alone(beside=False), engine="native")
    traced = edgegrad.Renderer(sheet_alone(beside=True), engine="native")
    picture = skipped.render(spp=16, max_depth=3)
    assert picture.max() > 0.0 and alike(picture, traced.render(spp=16, max_depth=3))
    v = {"meshes.box.vertices": np.random.default_rng(1).normal(size=(4, 3))}
    for term in ("interior", "shadow", "indirect"):
        a, b = (r.render_forward(v, spp=16, max_depth=3, terms=(term,)) for r in (skipped, traced))
        assert alike(a, b)
        assert a.any() == b.any() == (term == "interior")


def test_a_sheet_that_bends_is_no_longer_skipped() -> None:
    scene = sheet_alone(beside=False)
    renderer = edgegrad.Renderer(scene, engine="native")
    renderer.render(spp=1)
    corners = scene.meshes["box"].vertices.copy()
    corners[1] = [0.0, -0.8, 0.9]
    scene.meshes["box"].vertices = corners
    renderer.update(["meshes.box.vertices"])
    bent = sheet_alone(beside=True)
    bent.meshes["box"].vertices = corners
    assert alike(renderer.render(spp=64), edgegrad.render(bent, spp=64, engine="native"))


def test_a_convex_body_cut_by_the_near_plane_is_dark_inside() -> None:
    image = edgegrad.render(box_alone(beside=False, clip_start=4.2), spp=16, engine="native")
    other = edgegrad.render(box_alone(beside=True, clip_start=4.2), spp=16, engine="native")
    assert alike(image, other)
    assert (image == 0.0).all(axis=2).any()


def notched(*, beside: bool) -> edgegrad.Scene:
    """A body with an L-shaped section whose one concave edge is lined by a face without area."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float) - 0.7
    vertices = np.concatenate([np.c_[outline, np.zeros(6)], np.c_[outline, np.ones(6)], [[0.3, 0.3, 0.5]]])
    caps = [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]]
    faces = [[c, b, a] for a, b, c in caps] + [[a + 6, b + 6, c + 6] for a, b, c in caps]
    for k in range(6):
        n = (k + 1) % 6
        faces += [[k, n, n + 6], [k, n + 6, k + 6]]
    # The wall from corner 3 to corner 4 meets the concave edge 3-9 in two faces, at vertex 12 on it.
    faces.remove([3, 10, 9])
    faces += [[3, 10, 12], [12, 10, 9], [3, 12, 9]]
    meshes = {"body": edgegrad.Mesh(vertices, np.array(faces), ("grey",))}
    if beside:
        speck = np.array([[0, 0, 9], [0.01, 0, 9], [0, 0, 9.01]], float)
        meshes["speck"] = edgegrad.Mesh(speck, np.array([[0, 1, 2]]), ("grey",))
    turn = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]) @ np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, turn @ [0, 0, 5.0]
    return edgegrad.Scene(
        edgegrad.Camera(pose, 0.6, 48, 48), meshes, {"grey": edgegrad.Material(np.full(3, 0.5))},
        world=edgegrad.World(np.ones(3)),
    )


def test_a_concave_edge_lined_by_a_sliver_is_not_convex() -> None:
    tables = edgegrad.tables.tables.flatten(notched(beside=False))
    assert (np.diff(tables.edges().face_first.astype(int)) == 2).all()  # closed
    images = [edgegrad.render(notched(beside=beside), spp=64, engine="native") for beside in (False, True)]
    assert alike(*images)
    assert images[0].min() < 0.45  # the notch shades itself


# ---------------------------------------------------------------- loading


