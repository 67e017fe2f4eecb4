"""The borders of the cones of spots without blend, for every motion, compared with central differences."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

import edgegrad
from tests.support.block_statistics import check_noticed
from tests.support.motions import camera_moves, lamp_changes
from tests.support.picture_differences import agreement, check_agreement, check_transpose, need_every_table
from tests.support.scenes.box_under_lights import mesh_moves
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along, camera, matte, rectangle

POINT = edgegrad.SpotLight(np.array([0.3, 2.0, -0.2]), np.array([-0.2, -1.0, 0.1]), 90.0, 0.7, 0.0)
SPOTS = {
    "point": POINT,
    "linear": replace(POINT, falloff="LINEAR"),
    "sphere": replace(POINT, radius=0.15, sphere=True),
    "disk": replace(POINT, radius=0.15, sphere=False),
    "dim close by": replace(POINT, power=30.0, decay="CONSTANT", smooth=1.0),
}


def spot_scene(kind: str) -> edgegrad.Scene:
    """A floor under a spot whose border is in the picture."""
    return edgegrad.Scene(
        camera((0, 2.6, 3.0), (0, 0, 0.1), 24, 0.6),
        {"floor": rectangle((0, 0, 0), (0.1, 0.2, 4), (4, 0, 0), "floor")},
        {"floor": matte(0.6, 0.7, 0.5)},
        {"lamp": deepcopy(SPOTS[kind])},
    )


def spot_changes(kind: str, field: str, rate: ArrayLike) -> tuple[Make, list[str]]:
    return lamp_changes(lambda: spot_scene(kind), field, rate)


def floor_moves(kind: str) -> tuple[Make, list[str]]:
    return mesh_moves(lambda: spot_scene(kind), "floor", np.array([0.3, 0.8, -0.2])), ["meshes.floor.vertices"]


def view_moves(kind: str) -> tuple[Make, list[str]]:
    return camera_moves(lambda: spot_scene(kind), (0.2, 0.3, 0.1)), ["camera.to_world"]


def by_way_of_a_wall(theta: float) -> edgegrad.Scene:
    """The spot shines on a wall outside the picture, which lights the floor."""
    scene = spot_scene("point")
    scene.meshes["wall"] = rectangle((1.6, 0.6, 0.0), (0, 0, 0.9), (0, 0.7, 0), "wall")
    scene.materials["wall"] = matte(0.9, 0.8, 0.4)
    at = np.array([0.5, 0.8, 0.0]) + theta * np.array([0.5, 0.3, 0.4])
    scene.lights["lamp"] = replace(POINT, position=at, direction=np.array([1.0, 0.0, 0.0]), angle=0.9)
    return scene


MOVE, TURN = np.array([1.0, -0.4, 0.3]), np.array([0.5, 0.0, 0.6])
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{kind}: light moves": spot_changes(kind, "position", MOVE) for kind in SPOTS},
    **{f"{kind}: light turns": spot_changes(kind, "direction", TURN) for kind in SPOTS},
    **{f"{kind}: cone opens": spot_changes(kind, "angle", 0.8) for kind in SPOTS},
    **{f"{kind}: floor moves": floor_moves(kind) for kind in SPOTS},
    **{f"{kind}: camera moves": view_moves(kind) for kind in ("point", "disk")},
    "sphere: light grows": spot_changes("sphere", "radius", 0.3),
}
DEEP: dict[str, tuple[Make, list[str]]] = {"by way of a wall": (by_way_of_a_wall, ["lights.lamp.position"])}
QUICK = ("point: light moves", "linear: cone opens", "sphere: light turns", "disk: light moves", "point: camera moves",
         "disk: floor moves", "dim close by: light moves")


@pytest.mark.parametrize("name", slow_but(CASES, QUICK))
def test_borders_of_spots_agree_with_central_differences(name: str) -> None:
    # The reference has few samples near a border: it takes many, and of few seeds it looks surer than it is.
    need_every_table()
    check_agreement(along(*CASES[name]), spp=128, reference_spp=2048, reference_seeds=48)


def test_borders_by_way_of_a_wall_agree_with_central_differences() -> None:
    need_every_table()
    check_agreement(along(*DEEP["by way of a wall"]), max_depth=3)


def test_without_the_term_the_comparison_fails() -> None:
    """Nothing hides light from the floor: the border is all of the term."""
    need_every_table()
    outcome = agreement(along(*CASES["point: light moves"]), terms=("interior", "primary", "indirect"))
    check_noticed(outcome)


@pytest.mark.parametrize("name", ["point: light moves", "linear: cone opens", "disk: light turns", "disk: camera moves",
                                  "sphere: floor moves", "by way of a wall"])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*{**CASES, **DEEP}[name], spp=16, terms=("shadow",), max_depth=3)
