"""Values that an instance has of its instancer: attributes of instances of geometry nodes, and properties."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...problem import Report
from .layers import layer_values, property_of
from .particles import particle_of

# What Blender fills the rest of an instance's numbers with.
_NO_NUMBER = 2**31 - 1


@dataclass
class Instancers:
    """Attributes of the instances that instancers make, by instancer and name, each read once; at a frame."""

    report: Report
    frame: float
    _read: dict[tuple[str, str], NDArray[np.float32] | None] = field(default_factory=dict)

    def attribute(self, instancer: Any, name: str) -> NDArray[np.float32] | None:
        """Return the values (n, c) of an attribute of instances of geometry nodes; None: there is none."""
        key = (instancer.name_full, name)
        if key not in self._read:
            self._read[key] = _attribute(instancer, name)
        return self._read[key]

    def of(self, instance: Any) -> InstancerValues | None:
        """Return what an instance of Blender's iterator has of its instancer; None: it is no instance."""
        if not instance.is_instance or instance.parent is None:
            return None
        numbers = [number for number in instance.persistent_id if number != _NO_NUMBER]
        return InstancerValues(self, instance.parent, numbers[-1] if numbers else 0, particle_of(instance, self.frame))


@dataclass(frozen=True)
class InstancerValues:
    """An instance's values.

    Attributes
    ----------
    instancer
        The evaluated object; valid only during its step of Blender's iterator.
    number
        Of the instance among those of the instancer: the outermost ones, if instances are nested.
    particle
        Values of the particle that it is.
    """

    instancers: Instancers
    instancer: Any
    number: int
    particle: dict[str, tuple[float, ...]]

    def value(self, name: str) -> tuple[float, ...] | None:
        """Return the attribute of the instance, or else the property of its instancer; None if there is neither."""
        values = self.instancers.attribute(self.instancer, name)
        if values is None:
            return property_of((self.instancer, self.instancer.data), name)
        row = self._row()
        if row is None or row >= len(values):
            self.instancers.report.warn(f"object '{self.instancer.original.name}'", f"attribute '{name}' of its "
                                        "instances is left out, since their ids do not tell them apart")  # fmt: skip
            return None
        return tuple(map(float, values[row]))

    def _row(self) -> int | None:
        """The instance's row. Where instances have an attribute "id", their numbers are these."""
        ids = self.instancers.attribute(self.instancer, "id")
        if ids is None:
            return self.number
        found = np.flatnonzero(ids[:, 0] == self.number)
        return int(found[0]) if len(found) == 1 else None


def _attribute(instancer: Any, name: str) -> NDArray[np.float32] | None:
    if not hasattr(instancer, "evaluated_geometry"):  # before Blender 5.0
        return None
    geometry = instancer.evaluated_geometry()  # which owns what it returns
    points = geometry.instances_pointcloud()
    values = None if points is None else layer_values(points.attributes.get(name))
    return None if values is None else values.astype(np.float32)
