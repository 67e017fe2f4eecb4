"""An exported scene and what its parts are in Blender."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..problem import Report
from .materials.material import MaterialReading
from .surroundings.settings import RenderSettings


@dataclass
class Source:
    """Origin in Blender of an exported mesh or light.

    Attributes
    ----------
    object, data
        Name of Blender's object, and name of its original data.
    matrix
        (4, 4) transform from object space to world space.
    instance
        Whether an instancer made it, or whether it represents several objects.
    objects
        Names of all objects that it represents.
    holder
        Full name of the object, or of its instancer.
    part
        Name of a part of the object that is a mesh of its own: a hair system, the body of a lamp, a world's backdrop.
    displaced
        Whether its material has moved its vertices.
    """

    object: str
    data: str
    matrix: NDArray[np.float64]
    instance: bool
    objects: tuple[str, ...] = ()
    holder: str = ""
    part: str = ""
    displaced: bool = False


@dataclass
class Export:
    """An exported scene and the origin of its parts, by their names in the scene.

    `views` are all exported cameras; the scene is seen by the first of them.
    """

    scene: edgegrad.Scene
    settings: RenderSettings = field(default_factory=RenderSettings)
    meshes: dict[str, Source] = field(default_factory=dict)
    materials: dict[str, MaterialReading] = field(default_factory=dict)
    lights: dict[str, Source] = field(default_factory=dict)
    baked: dict[str, MaterialReading] = field(default_factory=dict)
    report: Report = field(default_factory=Report)
    views: list[edgegrad.Camera] = field(default_factory=list)


def unused_name(source: Source, holder: str, taken: Any) -> str:
    """Return the name of the object, or "instancer/object", with a number if the name is in use."""
    # Blender lists the mesh of a text or curve as an instance of the object itself.
    base = f"{holder}/{source.object}" if source.instance and holder != source.object else source.object
    if source.part:
        base = f"{base} ({source.part})"
    name, number = base, 1
    while name in taken:
        name, number = f"{base}#{number}", number + 1
    return name
