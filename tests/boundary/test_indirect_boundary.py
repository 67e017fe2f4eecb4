"""The indirect boundary term: edges between two surfaces that light each other, against central differences.

The scenes' lamps are hidden from what moves, or nothing can come between them and what they light: their derivatives
are those of shading, of edges that the camera sees, and of edges between surfaces.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.options import TERMS
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene.bounces import Bounces
from tests.support.block_statistics import (
    ALARM,
    NOTICED,
    STAGE_ALARM,
    Agreement,
    check,
    check_in_stages,
    check_noticed,
    compare,
)
from tests.support.engine_options import set_options
from tests.support.picture_differences import agreement, check_transpose
from tests.support.scenes.lit_by_surfaces import BOX, CASES, Case, bounced_light, instanced, moving, veiled
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import along, box, camera, matte, need, white_world


def beside_differences(case: Case, terms: tuple[str, ...] = TERMS, first_seed: int = 0) -> Agreement:
    """Compare the derivative with the central difference."""
    return agreement(
        along(case.make, [case.path]), eps=case.eps, seeds=case.seeds, spp=case.spp, reference_spp=case.reference_spp,
        reference_seeds=2 * case.seeds, thetas=case.seeds, first_seed=first_seed, terms=terms,
        max_depth=case.max_depth, bounces=case.bounces,
    )  # fmt: skip


RUNS = slow_but(CASES, [name for name, case in CASES.items() if case.quick])


@pytest.mark.parametrize("name", RUNS)
def test_it_agrees_with_central_differences_and_is_needed(name: str) -> None:
    need("native")
    case = CASES[name]
    check_in_stages(lambda first_seed: beside_differences(case, first_seed=first_seed))
    without = beside_differences(case, tuple(term for term in TERMS if term != case.without))
    print(without)
    check_noticed(without, STAGE_ALARM)


def over_metal() -> edgegrad.Scene:
    """Bounced light on a floor of rough metal."""
    scene = bounced_light()
    scene.materials["floor"] = edgegrad.Material(
        np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=float(np.sqrt(0.3))
    )
    return scene


def glossy_sheet() -> edgegrad.Scene:
    """Bounced light past a veil, on a floor with a diffuse colour, a gloss and a sharper coat; two boxes."""
    scene = veiled()
    scene.materials["floor"] = edgegrad.Material(
        np.array([0.5, 0.4, 0.3]), roughness=0.6, specular_ior_level=0.5, coat_weight=0.8, coat_roughness=0.3
    )
    scene.meshes["box"].instances = instanced().meshes["box"].instances
    return scene


# What the two estimators treat differently, in lobes that either may sample. They are compared with each other, since
# that has less noise than central differences.
BOTH: dict[str, Case] = {
    "edge in rougher metal": CASES["edge in rougher metal"],
    "edge behind rough glass": CASES["edge behind rough glass"],
    "occluder of light on metal": Case(moving(over_metal, "box", BOX)),
    "coated floor, veils and instances": Case(moving(glossy_sheet, "box", BOX), max_depth=4),
    "one bounce by limit": Case(moving(over_metal, "box", BOX), max_depth=5, bounces=Bounces(diffuse=1, glossy=1)),
}
# An alpha up to which all glossy lobes are sampled from the camera, and the weak ones over a diffuse base.
ALL_GLOSSY = 4.0


@pytest.mark.parametrize("name", BOTH)
def test_samples_from_edges_and_from_the_camera_agree(name: str) -> None:
    need("native")
    case = BOTH[name]
    scene, tangent = along(case.make, [case.path])(0.0)
    renderer = Renderer(scene)
    options: dict[str, Any] = {"max_depth": case.max_depth, "bounces": case.bounces, "terms": ("indirect",)}
    found = []
    for alpha, spp in ((0.0, 1024), (ALL_GLOSSY, 256)):
        set_options(renderer, camera_sampled_alpha=alpha)
        found.append(np.stack([renderer.render_forward(tangent, spp=spp, seed=k, **options) for k in range(24)]))
    edges, camera_first = found
    outcome = compare(camera_first, edges.mean(axis=0), edges.std(axis=0, ddof=1) / np.sqrt(len(edges)))
    print(outcome)
    check(outcome)
    assert outcome.noticed(ALARM) < NOTICED


@pytest.mark.parametrize(
    "name",
    ["two bounces", "edge behind rough glass", "camera and metal", "edge in rough metal",
     "bounces in nearly smooth metal"],
)  # fmt: skip
def test_modes_are_transposes(name: str) -> None:
    need("native")
    case = CASES[name]
    check_transpose(case.make, [case.path], spp=64, seed=3, max_depth=case.max_depth, terms=("indirect",))


def test_a_convex_body_under_an_even_sky_has_none() -> None:
    need("native")
    body = box((0, 0, 0), (0.5, 0.4, 0.3), "clay", 0.3)
    scene = edgegrad.Scene(camera(), {"box": body}, {"clay": matte(0.8, 0.7, 0.6)}, world=white_world())
    tangent = {"meshes.box.vertices": np.random.default_rng(0).normal(size=body.vertices.shape)}
    for term in ("shadow", "indirect"):
        assert not Renderer(scene).render_forward(tangent, spp=64, max_depth=5, terms=(term,)).any()
