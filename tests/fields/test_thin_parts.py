"""Parts of distance fields that are thinner than a cell: their outlines and surfaces, and their derivatives.

Signs at the corners of cells do not show them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from edgegrad import Field, Material, PointLight, Scene, World, plan
from tests.support.fields.outline_probes import length, outline, surface, unmatched, volume
from tests.support.fields.outlined import bent, over_a_sheet
from tests.support.fields.splines import Floats, exact_sphere, sampled
from tests.support.picture_differences import check_agreement, need_every_table
from tests.support.small_scenes import camera, rectangle


@pytest.fixture(autouse=True)
def _native_engine() -> None:
    need_every_table()


def speck(radius: float, size: int = 12) -> Field:
    """A ball away from the corners of cells: the middle of a cell is at 0."""
    return exact_sphere(radius, size)


def sheet(half: float, size: int = 12) -> Field:
    """An ellipsoid x^2 + y^2 + (z/half)^2 = 0.36 s^2, s its scale; splines have quadratic functions exactly."""
    spacing, scale = 2.0 / (size - 3), np.array([1.0, 1.0, 1.0 / half])
    return sampled(lambda p: np.sum((p**2 - spacing**2 / 3.0) * scale**2, axis=-1) - 0.36, size)


def needle(size: int = 20) -> Field:
    """A ball with a needle along x that is thinner than a cell, and a speck beside them."""
    bodies = (((-0.45, 0.0, 0.0), (1.0, 1.0, 1.0), 0.35), ((-0.1, 0.0, 0.0), (0.06, 1.0, 1.0), 0.045),
              ((0.3, 0.6, 0.5), (1.0, 1.0, 1.0), 0.04))
    spacing = 2.0 / (size - 3)

    def least(p: Floats) -> Floats:
        return np.asarray(np.min([np.sum(((p - centre)**2 - spacing**2 / 3.0) * np.square(scale), axis=-1) - radius**2
                                  for centre, scale, radius in bodies], axis=0))  # fmt: skip

    return sampled(least, size)


@pytest.mark.parametrize("radius", [0.02, 0.04, 0.09])
def test_a_speck(radius: float) -> None:
    """A ball within one cell has the outline, the area and the volume of a ball."""
    viewer = np.array([0.3, -0.5, 0.8])
    found = outline(speck(radius), viewer)
    ring = radius * np.sqrt(1.0 - radius**2 / np.sum(viewer**2))
    assert length(found) == pytest.approx(2 * np.pi * ring, rel=1e-3)
    assert unmatched(found["ends"]) == 0
    points = surface(speck(radius))
    assert points["area"].sum() == pytest.approx(4 * np.pi * radius**2, rel=0.01)
    assert volume(points) == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.01)


@pytest.mark.parametrize("half", [0.05, 0.1])
def test_a_sheet(half: float) -> None:
    """Thinner than a cell all over."""
    field = sheet(half)
    assert volume(surface(field)) == pytest.approx(4 / 3 * np.pi * half * 0.6**3, rel=0.01)
    found = outline(field, np.array([0.3, -0.5, 0.8]))
    assert unmatched(found["ends"]) == 0
    assert length(found) > 4 * 0.6


def test_a_needle_on_a_ball() -> None:
    """The surface of a thin part continues on a thick one without a gap: the integral of its normal vanishes."""
    found = surface(needle())
    by_normal = (found["area"][..., None] * found["normal"]).sum(axis=(0, 1))
    assert np.allclose(by_normal, 0.0, atol=1e-3)
    assert found["position"][..., 0].max() > 0.6 and found["position"][..., 2].max() > 0.5
    assert unmatched(outline(needle(), np.array([0.6, -2.0, 1.1]))["ends"]) == 0


FIELDS = {"speck": lambda: speck(0.09, 8), "sheet": lambda: sheet(0.1, 8), "needle": needle}


@pytest.mark.parametrize("what", ["values", "transform"])
@pytest.mark.parametrize("name", FIELDS)
def test_outlines_agree_with_differences(name: str, what: str) -> None:
    scene = over_a_sheet({"ball": FIELDS[name]()})
    step = 0.1 if what == "values" else 1.0  # fields of thin parts change fast
    rate = step * next(iter(bent(scene, 0.0, what)[1].values()))

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        field = scene.fields["ball"]
        moved = replace(field, **{what: (getattr(field, what) + theta * rate).astype(getattr(field, what).dtype)})
        return replace(scene, fields={"ball": moved}), {f"fields.ball.{what}": rate}

    check_agreement(at, max_depth=2, eps=0.01, seeds=12, spp=64, reference_spp=512)


@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_shadows_agree_with_differences(radius: float) -> None:
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = 1.0, 0.5, -0.3

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        place = np.eye(4) + theta * tangent
        place[:3, 3] += 0.0, 0.5, 0.0
        return Scene(camera((0.0, 2.0, 2.0), (0.0, 0.0, 0.0), 16, 0.5),
                     {"floor": rectangle((0, 0, 0), (0, 0, 2), (2, 0, 0), "floor")},
                     {"floor": Material(np.full(3, 0.7)), "clay": Material(np.full(3, 0.3))},
                     {"lamp": PointLight(np.array([0.5, 2.0, -0.4]), power=100.0, radius=radius, sphere=True)},
                     World(np.zeros(3)), fields={"ball": replace(speck(0.09, 8), transform=place)},
                     ), {"fields.ball.transform": tangent}  # fmt: skip

    check_agreement(at, max_depth=2, eps=0.01, seeds=12, spp=64, reference_spp=512)


def test_grids_that_are_too_large_for_the_search_are_named() -> None:
    """A thin sheet that fills the box of a large grid; nothing is said of a small one."""
    scene, said = over_a_sheet({}), []
    for size in (140, 20):
        spacing = 2.0 / (size - 3)
        z = np.linspace(-1.0 - spacing, 1.0 + spacing, size) + (size % 2 + 1.6) / 2.0 * spacing
        values = (z**2 - spacing**2 / 3.0 - (0.07 * spacing)**2).astype(np.float32)
        field = Field(np.broadcast_to(values, (size, size, size)).copy(), material="clay")
        made = replace(scene, fields={"sheet": field})
        said.append(any("thinner than a cell" in line for line in plan(made, ["fields.sheet.values"]).missing))
    assert said == [True, False]
