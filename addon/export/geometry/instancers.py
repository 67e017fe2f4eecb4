"""Values that an instance has of its instancer: attributes of instances of geometry nodes, and properties."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
from numpy.typing import NDArray

from ...problem import Report
from .layers import layer_values, property_of
from .particles import particle_of

# What Blender fills the rest of an instance's numbers with.
_NO_NUMBER = 2**31 - 1
# Types of objects that nodes may place although they have no geometry.
WITHOUT_GEOMETRY = ("EMPTY", "LIGHT", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE")


@dataclass
class _Set:
    """Instances that one set of geometry holds.

    Attributes
    ----------
    by_number
        Rows of the instances by their numbers, if they have an attribute "id", which is their numbers then; None: the
        numbers are the rows.
    repeated
        Rows of instances that repeat an id, the last one first. Blender makes up other numbers for them. They come in
        the order of their rows.
    """

    geometry: Any
    depsgraph: Any
    by_number: dict[int, int] | None = None
    repeated: list[int] = field(default_factory=list)
    inner: list[_Set | _Collection | None] | None = None
    read: dict[str, NDArray[Any] | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # Ids of scattered points are too large for single precision.
        ids = self.attribute("id")
        if ids is not None:
            known: dict[int, int] = {}
            rows = [row for row, number in enumerate(ids[:, 0].tolist()) if known.setdefault(number, row) != row]
            self.by_number, self.repeated = known, rows[::-1]

    def attribute(self, name: str) -> NDArray[Any] | None:
        """Return the values (n, c) of an attribute of the instances; None: there is none."""
        if name not in self.read:
            points = self.geometry.instances_pointcloud()
            self.read[name] = None if points is None else layer_values(points.attributes.get(name))
        return self.read[name]

    def row(self, number: int) -> int | None:
        """Return the row of an instance; None: it cannot be told. To be called for the instances in their order."""
        if self.by_number is None:
            return number
        if number not in self.by_number and self.repeated:
            self.by_number[number] = self.repeated.pop()
        return self.by_number.get(number)

    def within(self, row: int | None) -> _Set | _Collection | None:
        """Return the instances that the instance in a row consists of; None: there are none."""
        if self.inner is None:
            self.inner = [_set_of(one, self.depsgraph) for one in self.geometry.instance_references()]
        references = self.attribute(".reference_index")
        if row is None or references is None or row >= len(references):
            return None
        index = int(references[row, 0])
        return self.inner[index] if 0 <= index < len(self.inner) else None


@dataclass(frozen=True)
class _Collection:
    """Instances of a collection's objects, by the numbers of what these instance themselves."""

    objects: list[Any]
    depsgraph: Any
    inner: dict[int, _Set | _Collection | None] = field(default_factory=dict)

    def attribute(self, name: str) -> None:
        return None

    def row(self, number: int) -> int:
        return number

    def within(self, row: int | None) -> _Set | _Collection | None:
        """Return the instances that the object in a row makes; None: there are none."""
        if row is None or row >= len(self.objects) or self.objects[row] is None:
            return None
        if row not in self.inner:
            self.inner[row] = _set_of(self.objects[row], self.depsgraph)
        return self.inner[row]


def _set_of(made_by: Any, depsgraph: Any) -> _Set | _Collection | None:
    """Return the instances that an object, a collection or a geometry makes; None: there are none, or of particles."""
    if isinstance(made_by, bpy.types.Collection):
        # Blender counts the visible objects. What they instance has the number of the next one.
        shown = _shown(made_by)
        return _Collection([None, *(ob for ob in made_by.all_objects if ob.name_full in shown)], depsgraph)
    if isinstance(made_by, bpy.types.Object):
        if made_by.instance_type == "COLLECTION" and made_by.instance_collection is not None:
            return _Collection(list(made_by.instance_collection.all_objects), depsgraph)
        evaluated = made_by.evaluated_get(depsgraph)
        # Geometry owns what it returns. Before Blender 5.0, Python has none.
        known = made_by.type not in WITHOUT_GEOMETRY and hasattr(evaluated, "evaluated_geometry")
        made_by = evaluated.evaluated_geometry() if known else None
    if not hasattr(made_by, "instances_pointcloud") or made_by.instances_pointcloud() is None:
        return None
    return _Set(made_by, depsgraph)


def _shown(collection: Any) -> set[str]:
    """Names of the objects of a collection that are rendered."""
    names = {ob.name_full for ob in collection.objects if not ob.hide_render}
    return names.union(*(_shown(one) for one in collection.children if not one.hide_render))


@dataclass
class Instancers:
    """Attributes of the instances that instancers make, each read once; at a frame."""

    report: Report
    depsgraph: Any
    _sets: dict[str, _Set | _Collection | None] = field(default_factory=dict)

    def of(self, instance: Any) -> InstancerValues | None:
        """Return what an instance of Blender's iterator has of its instancer; None: it is no instance.

        To be called for all instances in their order.
        """
        if not instance.is_instance or instance.parent is None:
            return None
        rows: list[tuple[_Set | _Collection, int | None]] = []
        inner = self._outermost(instance.parent)
        for number in reversed([number for number in instance.persistent_id if number != _NO_NUMBER]):
            if inner is None:
                break
            row = inner.row(number)
            rows.append((inner, row))
            inner = inner.within(row)
        system = instance.particle_system
        # Blender's coordinates range from -1 to 1, Cycles' from -1 to 0.
        generated = tuple(0.5 * float(c) - 0.5 for c in instance.orco)
        return InstancerValues(self.report, instance.parent, rows[::-1], None if system is None else system.settings,
                               particle_of(instance, self.depsgraph.scene.frame_current_final), generated,
                               tuple(map(float, instance.uv)))  # fmt: skip

    def _outermost(self, instancer: Any) -> _Set | _Collection | None:
        key = instancer.name_full
        if key not in self._sets:
            self._sets[key] = _set_of(instancer, self.depsgraph)
        return self._sets[key]


@dataclass(frozen=True)
class InstancerValues:
    """An instance's values.

    Attributes
    ----------
    instancer
        The evaluated object; valid only during its step of Blender's iterator.
    rows
        Where the instance's attributes are, the innermost instances first; None: the row cannot be told.
    settings
        Those of the particle system that made it, or None.
    particle
        Values of the particle that it is.
    generated, uv
        Coordinates of its place on the instancer.
    """

    report: Report
    instancer: Any
    rows: list[tuple[_Set | _Collection, int | None]]
    settings: Any
    particle: dict[str, tuple[float, ...]]
    generated: tuple[float, ...]
    uv: tuple[float, ...]

    def value(self, name: str) -> tuple[float, ...] | None:
        """Return the attribute of the instance, or else a property of the particle system or instancer, or None."""
        for instances, row in self.rows:
            values = instances.attribute(name)
            if values is not None and row is not None and row < len(values):
                return tuple(map(float, values[row]))
            if values is not None:
                self.report.warn(f"object '{self.instancer.original.name}'", f"attribute '{name}' of its instances is "
                                 "left out, since their ids do not tell them apart")  # fmt: skip
                return None
        owners = (self.settings, self.instancer, self.instancer.data)
        return property_of((owner for owner in owners if owner is not None), name)
