"""Fits find the parameters of their targets, and leave the scene valid."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Mesh, Scene
from edgegrad.fitting.history import History
from edgegrad.fitting.run import Run
from edgegrad.fitting.scene_fit import fit
from edgegrad.fitting.schedule import Cycle
from edgegrad.fitting.targets import Target, View, views
from edgegrad.fitting.variables import unknown
from edgegrad.geometry import topology
from edgegrad.losses import Pyramid, l1, l2
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.fits import COLOR, POWER, VERTICES, ball, picture, same, state
from tests.support.picture_differences import seed_of_picture


def test_colour_and_power_are_found() -> None:
    # The lamp alone determines the product of reflectance and power only; a world of known radiance separates them.
    truth, scene = (shapes.scene(*shapes.ball(2), world=1.0) for _ in range(2))
    truth.materials["clay"].base_color = np.array([0.2, 0.7, 0.4])
    truth.lights["lamp"].power = 800.0  # type: ignore[union-attr]
    result = fit(scene, Target(picture(truth)), [COLOR, POWER], iterations=120, spp=4, seed=1)
    np.testing.assert_allclose(scene.materials["clay"].base_color, [0.2, 0.7, 0.4], atol=0.02)
    assert parameters.get(scene, POWER) == pytest.approx(800.0, rel=0.1)
    # A loss is a square: a seventh of the difference would leave as much.
    assert result.losses[-1] < 0.02 * result.losses[0] and len(result.losses) == 121
    np.testing.assert_array_equal(result.values[COLOR], scene.materials["clay"].base_color)


def test_a_bare_picture_is_a_target() -> None:
    truth, one, other = ball(1.2), ball(), ball()
    image = picture(truth)
    results = [
        fit(scene, target, [COLOR], iterations=2, spp=1)
        for scene, target in ((one, image), (other, [Target(image)]))
    ]
    assert results[0].losses == results[1].losses


@pytest.mark.parametrize(("stored", "slide"), [("shared", None), ("split", None), ("shared", 1.0)])
def test_shape_is_found_from_several_views(stored: str, slide: float | None) -> None:
    """A bump along the normals is found by default; a stretched and moved body if vertices may slide."""
    vertices, faces = shapes.ball(2, 0.8)
    if slide is None:
        goal = vertices * (1.1 + 0.3 * np.sin(3.0 * vertices[:, [0]]))
    else:
        goal = vertices * [1.4, 1.1, 1.2] + [0.15, 0.0, 0.1]
    cameras = [shapes.camera(eye, size=(32, 32)) for eye in ([0, -6, 1], [6, 0, 1], [-4, 4, 2], [1, 1, 6])]
    truth = shapes.scene(goal, faces)
    targets = [Target(picture(truth, camera=camera), camera) for camera in cameras]
    if stored == "split":
        goal, vertices, faces = goal[faces].reshape(-1, 3), *shapes.split(vertices, faces)
    scene = shapes.scene(vertices, faces)
    result = fit(scene, targets, [VERTICES], iterations=60, spp=4, seed=2, slide=slide)
    found = scene.meshes["object"].vertices
    before, after = (np.linalg.norm(v - goal, axis=1).mean() for v in (vertices, found))
    # Pictures show outlines and shading, not how vertices lie along the surface: more than half of the distance is
    # undone, and of the loss, a square, all but a twentieth.
    assert after < 0.45 * before, (before, after)
    assert result.losses[result.best] < 0.05 * result.losses[0]
    for k in np.unique(topology.weld(vertices), return_index=True)[1]:
        copies = found[(vertices == vertices[k]).all(axis=1)]
        assert (copies == copies[0]).all(), "a seam is torn"


def test_a_scene_that_fits_stays() -> None:
    """With the truth as start the noise must not carry the scene away."""
    scene = ball()
    before = state(scene)
    target = picture(scene)

    def loss() -> float:
        """Of pictures as the fit sees them, in the mean: single ones differ by a factor of two."""
        return float(np.mean([Pyramid()(edgegrad.render(scene, spp=8, seed=s), target, None)[0] for s in range(16)]))

    least = loss()
    fit(scene, Target(target), [VERTICES, COLOR], iterations=30, spp=8)
    after = state(scene)
    # By single steps of the first length: steps that noise alone directs cancel each other.
    assert np.abs(after[COLOR] - before[COLOR]).max() < 0.05
    assert np.linalg.norm(after[VERTICES] - before[VERTICES], axis=1).mean() < 0.05
    # What it has moved by is less than the noise of one picture.
    assert loss() < 2.0 * least


def test_the_gradient_of_a_noisy_loss_is_unbiased() -> None:
    """One sample per pixel: the picture that the adjoint comes from and the derivative must be independent."""
    scene = ball()
    scene.camera = shapes.camera(size=(8, 8), fov_x=0.4)
    scene.lights["lamp"].radius = 2.0  # type: ignore[union-attr]
    renderer, target = edgegrad.Renderer(scene), np.zeros((8, 8, 3), np.float32)
    run = Run(scene, renderer, [View(target, scene.camera, None, 1.0)], [unknown(scene, COLOR, None, None, None)], l2,
              schedule=Cycle(1, 1, 600, 3), spp=1, gradient_spp=1, limits={"max_depth": 2}, seed=3, started=0.0,
              progress=None)  # fmt: skip
    sharp = renderer.render(spp=4096, seed=7)
    expected = renderer.render_backward(l2(sharp, target)[1], [COLOR], spp=4096, seed=8)[COLOR].sum()
    found = np.array([run._gradient(k)[COLOR].sum() for k in range(run.iterations)])
    check(mean_p_value(found, expected))
    # The derivative of this seed has the random numbers of the picture.
    same = [renderer.render_backward(l2(renderer.render(spp=1, seed=k), target)[1], [COLOR], spp=1,
                                     seed=seed_of_picture(k))[COLOR].sum()
            for k in range(run.iterations)]  # fmt: skip
    assert abs(np.mean(same) - expected) > half_width(found), "or this scene has no noise to be biased by"


def test_equal_pictures_move_nothing_and_are_warned_of() -> None:
    """A loss that is exactly zero has an exactly zero gradient."""
    scene = ball()
    scene.lights = {}
    scene.materials["clay"].base_color = np.zeros(3)  # neither light nor noise
    scene.world.color = np.zeros(3)
    scene.materials["clay"].emission = np.ones(3)
    scene.meshes["object"].vertices *= 100.0  # fills the picture
    scene.camera = shapes.camera((0.0, -500.0, 1.0), size=(8, 8), fov_x=0.1)
    before = state(scene)
    with pytest.warns(RuntimeWarning, match="already equal their targets"):
        result = fit(scene, Target(np.ones((8, 8, 3))), [VERTICES], iterations=3, spp=1)
    assert result.losses == [0.0] * 4
    assert same(before, state(scene))
    assert result.untouched == {VERTICES: 1.0}


def test_parameters_that_nothing_depends_on_are_named() -> None:
    scene = ball()
    scene.materials["spare"] = edgegrad.Material()  # type: ignore[index]
    scene.meshes["behind"] = Mesh(shapes.cube()[0], shapes.cube()[1], ("clay",))  # type: ignore[index]
    scene.meshes["behind"].vertices += [0.0, -40.0, 0.0]
    with pytest.warns(RuntimeWarning) as caught:
        result = fit(
            scene, Target(np.zeros((24, 32, 3))), [COLOR, "materials.spare.base_color", "meshes.behind.vertices"],
            iterations=1, spp=2,
        )
    words = [str(w.message) for w in caught]
    assert any("'materials.spare.base_color', because no mesh or field uses this material" in w for w in words)
    assert any("'meshes.behind.vertices', because nothing that the cameras see" in w for w in words)
    assert len(words) == 2 and result.untouched[COLOR] == 0.0
    assert caught[0].filename == __file__


def test_what_part_of_a_gradient_is_zero_is_told_with_its_reason() -> None:
    """Of a sheet that the frame cuts in the middle half the vertices lie outside; its mask hides half of the rest."""
    scene = shapes.scene(*shapes.sheet(9), world=1.0)
    scene.camera = shapes.camera((0.0, -0.01, 8.0), size=(32, 32), fov_x=0.3)
    scene.camera.to_world[0, 3] = 1.1
    mask = np.zeros((32, 32))
    mask[:16] = 1.0
    result = fit(scene, Target(np.zeros((32, 32, 3)), mask=mask), [VERTICES], iterations=1, spp=4)
    assert 0.5 < result.untouched[VERTICES] < 0.9
    depth, note = result.notes
    assert depth.startswith("one view does not determine depth")
    assert note.startswith(f"{result.untouched[VERTICES]:.0%} of the gradient of '{VERTICES}' is exactly 0: ")
    assert "lie outside all pictures" in note and "are hidden, unlit or masked" in note
    whole = fit(ball(), Target(np.zeros((24, 32, 3))), [COLOR], iterations=1, spp=4)
    assert whole.notes == ()


def test_notes_name_what_is_not_computed() -> None:
    scene = ball()
    found = edgegrad.plan(scene, [VERTICES], max_depth=6).missing
    result = fit(scene, Target(np.zeros((24, 32, 3))), [VERTICES], iterations=1, spp=1, max_depth=6)
    assert [note for note in result.notes if "not computed" in note] == [f"not computed: {words}" for words in found]


def test_of_values_that_noise_alone_tells_apart_the_latest_are_kept() -> None:
    history = History([1.0], {}, [])
    kept = []
    noise = np.random.default_rng(0).normal(size=80)
    # The loss falls, stays, and rises: the rise is larger than the noise.
    for k, loss in enumerate(np.concatenate([np.linspace(10.0, 1.0, 20), np.ones(40), np.linspace(1.0, 3.0, 20)])):
        history.newest = np.array([loss + 0.1 * noise[k]])
        history.record(True, lambda: ({}, []))
        kept.append(history.best)
    assert kept[30] >= 28 and kept[59] >= 50 and 58 <= kept[-1] <= 66


def test_values_stay_in_their_range() -> None:
    scene = ball()
    steps = {COLOR: 1.0, POWER: 1e4, "world.color": 5.0}
    fit(scene, Target(np.full((24, 32, 3), 1e3)), list(steps), iterations=2, spp=2, step_sizes=steps)
    assert scene.materials["clay"].base_color.max() <= 1.0
    fit(scene, Target(np.zeros((24, 32, 3))), list(steps), iterations=2, spp=2, step_sizes=steps)
    for path in steps:
        assert np.min(parameters.get(scene, path)) >= 0.0
    scene.validate()


@pytest.mark.parametrize("threads", [1, 2])
def test_equal_seeds_give_equal_fits(threads: int) -> None:
    found = []
    for _ in range(2):
        scene = ball()
        fit(scene, Target(np.zeros((24, 32, 3))), [VERTICES], iterations=3, spp=2, seed=5, threads=threads)
        found.append(scene.meshes["object"].vertices)
    np.testing.assert_array_equal(found[0], found[1])


def test_views_take_turns() -> None:
    truth = ball(1.1)
    cameras = [shapes.camera(eye, size=(16, 16)) for eye in ([0, -6, 1], [6, 0, 1], [-4, 4, 2])]
    targets = [Target(picture(truth, camera=camera), camera) for camera in cameras]
    result = fit(ball(), targets, [VERTICES], iterations=7, spp=2, views_per_iteration=1)
    assert len(result.losses) == 8 and result.best >= 2, "before all pictures were seen there is no best"


def test_alpha_is_put_over_the_world() -> None:
    """A picture rendered over nothing and one over the world are the same target."""
    scene = ball()
    over_nothing = np.zeros((24, 32, 4), np.float32)
    fit_from_alpha = fit(scene, Target(over_nothing), [COLOR], iterations=1, spp=2)
    plain = fit(ball(), Target(np.full((24, 32, 3), 0.2)), [COLOR], iterations=1, spp=2)
    assert fit_from_alpha.losses == plain.losses


def test_alpha_is_put_over_an_image_of_the_world() -> None:
    scene = ball()
    scene.images = {"sky": edgegrad.Image(np.random.default_rng(0).uniform(0.0, 2.0, (8, 16, 3)).astype(np.float32))}
    scene.world = edgegrad.World(np.ones(3), image="sky")
    sky = edgegrad.render(Scene(scene.camera, world=scene.world, images=scene.images), spp=64)
    over_nothing = np.zeros((24, 32, 4), np.float32)
    seen = views(scene, Target(over_nothing))[0].image
    np.testing.assert_allclose(seen, sky, atol=1e-6)
    over_nothing[..., :3], over_nothing[..., 3] = 0.25, 1.0
    assert (views(scene, Target(over_nothing))[0].image == 0.25).all()


def test_a_target_is_as_large_as_the_camera_crop() -> None:
    scene = ball()
    scene.camera.crop = (4, 2, 24, 18)
    image = picture(scene)
    assert image.shape == (16, 20, 3) and len(fit(scene, Target(image), [COLOR], iterations=1, spp=1).losses) == 2
    with pytest.raises(ValueError, match="is 32 x 24 pixels, but its camera's picture is 20 x 16, of another aspect"):
        fit(scene, Target(np.zeros((24, 32, 3))), [COLOR], iterations=1, spp=1)


@pytest.mark.parametrize("loss", [l1, l2])
def test_plain_functions_are_losses(loss: Any) -> None:
    scene = ball()
    target = Target(picture(ball(1.1)))
    result = fit(scene, target, [VERTICES], iterations=25, spp=4, loss=loss)
    assert result.losses[result.best] < 0.6 * result.losses[0]  # plain losses see near differences alone


def test_the_reference_engine_fits_too() -> None:
    scene = ball()
    target = Target(picture(ball(1.15)))
    result = fit(scene, target, [VERTICES], iterations=8, spp=2, engine="reference")
    assert result.losses[result.best] < 0.7 * result.losses[0]  # in the few steps that its speed allows
