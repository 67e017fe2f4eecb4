"""Sheets that pass through spheres and disks that light a floor."""

from __future__ import annotations

from copy import deepcopy

import numpy as np

import edgegrad
from edgegrad._check import RAYS
from tests.support.small_scenes import camera, matte, rectangle

PLACE = np.array([0.1, 1.5, 0.0])
LAMPS: dict[str, edgegrad.PointLight | edgegrad.SpotLight] = {
    "sphere": edgegrad.PointLight(PLACE, 60.0, 0.4, True),
    "disk": edgegrad.PointLight(PLACE, 60.0, 0.4, False),
    "sphere spot": edgegrad.SpotLight(PLACE, np.array([0.3, -1.0, 0.1]), 60.0, 1.6, 0.6, 0.4, True),
    "disk spot": edgegrad.SpotLight(PLACE, np.array([0.3, -1.0, 0.1]), 60.0, 1.6, 0.6, 0.4, False),
}


def sheet_through(lamp: str) -> edgegrad.Scene:
    """A floor under a round lamp that an upright black sheet passes through, which the camera doesn't see."""
    scene = edgegrad.Scene(
        camera((0, 2.6, 3.0), (0, 0, 0.1), 24, 0.6),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 4), (4, 0, 0), "floor"),
            "sheet": rectangle((0.15, 1.6, 0.0), (0.3, 1.0, 0.1), (0.0, 0.0, 2.5), "black"),
        },
        {"floor": matte(0.6, 0.7, 0.5), "black": matte(0.0, 0.0, 0.0)},
        {"lamp": deepcopy(LAMPS[lamp])},
    )
    scene.meshes["sheet"].visible_to = frozenset(RAYS) - {"camera"}
    return scene


def veiled(lamp: str) -> edgegrad.Scene:
    """A sheet that lets a part of the light pass."""
    scene = sheet_through(lamp)
    scene.materials["black"] = edgegrad.Material(np.zeros(3), alpha=0.6)
    return scene
