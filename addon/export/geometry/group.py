"""Evaluated objects as Blender's iterator lists them, and groups of those that become one mesh."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..exported import Source
from .attributes import ObjectValues
from .instancers import InstancerValues
from .mesh import MeshArrays

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class Placed:
    """An evaluated object or instance.

    Attributes
    ----------
    object
        Valid only during its step of Blender's iterator.
    source, holder
        Origin in Blender, and name of the object or of its instancer.
    slots
        Names of the materials.
    visible
        Kinds of rays that can hit the object.
    holdout
        Whether the camera sees black in its place.
    random_id
        Blender's random number of the instance.
    instancer
        What it has of its instancer; None: the object is not an instance.
    apart
        Whether instances of different holders need separate meshes, since lights are linked to holders.
    single
        Whether a mesh that reads values of the object cannot be shared by instances, since its materials are baked or
        displace it by these values.
    """

    object: Any
    source: Source
    holder: str
    slots: tuple[str, ...]
    visible: frozenset[str]
    holdout: bool
    random_id: int
    instancer: InstancerValues | None
    apart: bool
    single: bool

    @property
    def values(self) -> ObjectValues:
        """What its attributes are read from."""
        return ObjectValues(self.object, self.source.matrix, self.random_id, self.instancer)


class Terminator(NamedTuple):
    """Blender's offsets of the shadow terminator."""

    geometry: float = 0.0
    shading: float = 0.0


@dataclass
class Group:
    """Instances of one mesh with equal materials and settings.

    `attributes` has all attributes, with the values of the first object; `own` has those that differ between objects,
    for each object. `corner_count` is the number of corners of Blender's mesh. `singular`: with a scale of zero along
    an axis; `flattened`: a body with such a scale; `shadowed`: one whose faces are all in each other's shadow in
    Cycles. `own_space`: Cycles renders the mesh in its own space; `framed`: a material has a normal map in tangent
    space.
    """

    arrays: MeshArrays
    attributes: dict[str, F32]
    slots: tuple[str, ...]
    visible: frozenset[str]
    terminator: Terminator
    holdout: bool = False
    sources: list[Source] = field(default_factory=list)
    holders: list[str] = field(default_factory=list)
    own: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    corner_count: int = 0
    singular: bool = False
    flattened: bool = False
    shadowed: bool = False
    own_space: bool = False
    framed: bool = False
