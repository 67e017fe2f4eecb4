"""Reference cases: picture and derivative agree with central differences of another renderer, block by block.

The files (``tests/references``) hold scenes, pictures and, where derivatives are tested, central differences with their
standard errors; more of them are read from EDGEGRAD_REFS, or from ``../shared/refs`` beside the
repository, where these exist.
"""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import peer_scenes
from tests.support.block_statistics import block_sums, check, check_noticed, compare, over_theta
from tests.support.reference_files import HERE, find
from tests.support.small_scenes import need

# With derivatives.
CASES = ["tri_black", "tri_background", "two_triangles", "sphere_env", "emissive_convex", "crease", "blob_flat"]
# Of rich scenes, whose differences have no term that isn't computed; not for the reference engine.
RICH = ["camera_move", "cornell_albedo", "glossy_emitter", "point_shadow", "roughness_env", "spot_intensity"]
# About moving shadows.
MORE = ["shadow_occluder", "shadow_light", "dense_200k"]
# Not in the repository (size); tested where the file exists.
LARGE = ["dense_200k"]
# Pictures alone: the boundary that their differences have and derivatives don't, as the plan names it.
PICTURES = {"glass_sphere": "caustics, light that mirrors and smooth glass"}
# The files don't hold the noise of their pictures, which have independent samples, at least this many per pixel. Of the
# exceptions the number was estimated from single pixels' differences from a converged picture.
PICTURE_SPP = 8192
FEWER_SPP = {"cornell_albedo": 500, "glossy_emitter": 2500, "glass_sphere": 3000}
SLOW = pytest.mark.slow
# engine, samples per pixel and seed
RUNS = [
    *[pytest.param(case, "native", 32, id=f"native-{case}") for case in CASES],
    *[pytest.param(case, "native", 32, id=f"native-{case}") for case in RICH],
    *[pytest.param(case, "native", 32, id=f"native-{case}", marks=SLOW) for case in MORE],
    pytest.param("tri_background", "reference", 8, id="reference-tri_background"),
    *[pytest.param(case, "reference", 16, id=f"reference-{case}", marks=SLOW) for case in CASES[2:] + MORE[:2]],
]
PICTURE_RUNS = RUNS + [pytest.param(case, "native", 32, id=f"native-{case}") for case in PICTURES]


@pytest.mark.parametrize(("case", "engine", "spp"), PICTURE_RUNS)
def test_picture_agrees(case: str, engine: str, spp: int) -> None:
    need(engine)
    scene, arrays = peer_scenes.load_picture(find(case))
    renderer = Renderer(scene, engine=engine)
    depth = int(arrays["max_depth"])
    pictures = [renderer.render(spp=spp, seed=seed, max_depth=depth) for seed in range(8)]
    single = [renderer.render(spp=1, seed=seed, max_depth=depth) for seed in range(100, 116)]
    # Our environment sampling is free of noise where nothing is hidden; theirs has about half the radiance.
    spread = np.maximum(np.std(single, axis=0, ddof=1), 0.5 * np.mean(pictures, axis=0))
    stderr = spread / np.sqrt(FEWER_SPP.get(case, PICTURE_SPP))
    outcome = compare(pictures, arrays["image"], stderr)
    print(outcome)
    check(outcome)


@pytest.mark.parametrize(("case", "engine", "spp"), RUNS)
def test_derivative_agrees(case: str, engine: str, spp: int) -> None:
    need(engine)
    path = find(case)
    _, _, arrays = peer_scenes.load(path)
    depth = int(arrays["max_depth"])
    samples = over_theta(
        path,
        float(arrays["eps"]),
        lambda scene, tangent, seed: Renderer(scene, engine=engine).render_forward(
            tangent, spp=spp, seed=seed, max_depth=depth
        ),
    )
    outcome = compare(samples, arrays["grad_fd"], arrays["grad_fd_stderr"])
    print(outcome)
    check(outcome)


@pytest.mark.parametrize(
    ("case", "missing"), [("tri_background", "primary"), ("crease", "interior"), ("two_triangles", "shadow")]
)
def test_comparison_notices_a_missing_term(case: str, missing: str) -> None:
    """The same comparison fails for each term that is left out."""
    path = find(case)
    _, _, arrays = peer_scenes.load(path)
    terms = [t for t in ("interior", "primary", "shadow") if t != missing]
    samples = over_theta(
        path,
        float(arrays["eps"]),
        lambda scene, tangent, seed: Renderer(scene).render_forward(tangent, spp=4, seed=seed, terms=terms),
    )
    check_noticed(compare(samples, arrays["grad_fd"], arrays["grad_fd_stderr"]))


@pytest.mark.parametrize("case", sorted(PICTURES))
def test_missing_boundary_is_named(case: str) -> None:
    need("native")
    scene, tangent, arrays = peer_scenes.load(find(case))
    missing = edgegrad.plan(scene, list(tangent), max_depth=int(arrays["max_depth"])).missing
    assert any(PICTURES[case] in sentence for sentence in missing)


def test_environment_map_is_that_of_the_file() -> None:
    """The world's image, looked up as `World` specifies, equals the file's map."""
    rng = np.random.default_rng(5)
    bitmap = rng.uniform(size=(6, 9, 3))
    image = peer_scenes._environment(bitmap).pixels
    d = rng.normal(size=(2000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    ours = d @ peer_scenes.ENVIRONMENT_ROTATION.T
    u, v = 0.5 - np.arctan2(ours[:, 1], ours[:, 0]) / (2 * np.pi), 0.5 - np.arcsin(ours[:, 2]) / np.pi
    looked_up = bilinear(image, u * 9 - 0.5, v * len(image) - 0.5)
    u, v = np.arctan2(d[:, 0], -d[:, 2]) / (2 * np.pi), np.arccos(d[:, 1]) / np.pi
    wanted = bilinear(bitmap, u * 9 - 0.5, v * 5)
    # A kink of values in [0, 1] is cut by at most a quarter strip times the change of slope, 2; elsewhere it is exact.
    assert np.abs(looked_up - wanted).max() < 0.5 / peer_scenes.ENVIRONMENT_ROWS
    assert np.mean(np.abs(looked_up - wanted) > 1e-5) < 2.0 / peer_scenes.ENVIRONMENT_ROWS


def bilinear(image: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Image at columns x (periodic) and rows y (clamped); values are at whole numbers."""
    height, width = image.shape[:2]
    y = np.clip(y, 0, height - 1)
    row, column = np.minimum(y.astype(int), height - 2), np.floor(x).astype(int)
    fy, fx = (y - row)[:, None], (x - column)[:, None]
    upper, lower = (
        image[r, column % width] * (1 - fx) + image[r, (column + 1) % width] * fx for r in (row, row + 1)
    )
    return upper * (1 - fy) + lower * fy


@pytest.mark.parametrize("case", CASES)
def test_tangent_is_the_derivative_of_the_motion(case: str) -> None:
    """`load_at` moves the scene as the tangent says; at theta = 0 it is the scene of `load`."""
    path = find(case)
    scene, tangent, arrays = peer_scenes.load(path)
    assert arrays["image"].shape == (scene.camera.height, scene.camera.width, 3)
    assert tangent
    h = 1e-4
    ahead, behind = peer_scenes.load_at(path, h)[0], peer_scenes.load_at(path, -h)[0]
    for name, mesh in scene.meshes.items():
        difference = (ahead.meshes[name].vertices - behind.meshes[name].vertices) / (2.0 * h)
        rate = tangent.get(f"meshes.{name}.vertices", np.zeros_like(mesh.vertices))
        assert difference == pytest.approx(rate, abs=1e-7)
        assert peer_scenes.load_at(path, 0.0)[0].meshes[name].vertices == pytest.approx(mesh.vertices, abs=1e-15)


def test_reference_files_are_small() -> None:
    files = list((HERE / "references").glob("*.npz"))
    assert {f.stem for f in files} == {*CASES, *MORE, *RICH, *PICTURES} - {*LARGE}
    assert sum(f.stat().st_size for f in files) < 5_000_000


def test_reference_noise_is_below_the_signal() -> None:
    """A reference that is all noise would agree with everything."""
    for case in CASES:
        _, _, arrays = peer_scenes.load(find(case))
        noise = np.sqrt(block_sums(arrays["grad_fd_stderr"].astype(np.float64) ** 2).sum())
        assert noise < 0.1 * np.linalg.norm(block_sums(arrays["grad_fd"]))
