"""Values that an instance has of its instancer: attributes of instances of geometry nodes, and properties."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

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
    _read: dict[tuple[str, str], NDArray[Any] | None] = field(default_factory=dict)
    _rows: dict[str, _Rows] = field(default_factory=dict)

    def attribute(self, instancer: Any, name: str) -> NDArray[Any] | None:
        """Return the values (n, c) of an attribute of instances of geometry nodes; None: there is none.

        They keep their type, since ids of scattered points are too large for single precision.
        """
        key = (instancer.name_full, name)
        if key not in self._read:
            self._read[key] = _attribute(instancer, name)
        return self._read[key]

    def of(self, instance: Any) -> InstancerValues | None:
        """Return what an instance of Blender's iterator has of its instancer; None: it is no instance.

        To be called for all instances in their order.
        """
        if not instance.is_instance or instance.parent is None:
            return None
        numbers = [number for number in instance.persistent_id if number != _NO_NUMBER]
        row = self._row(instance.parent, numbers[-1] if numbers else 0)
        return InstancerValues(self, instance.parent, row, particle_of(instance, self.frame))

    def _row(self, instancer: Any, number: int) -> int | None:
        """Row of an instance's values, by its number: that of the outermost instance, if instances are nested."""
        rows = self._rows.get(instancer.name_full)
        if rows is None:
            rows = self._rows[instancer.name_full] = _Rows.of(self.attribute(instancer, "id"))
        return rows.of_number(number)


@dataclass
class _Rows:
    """Rows of instances by their numbers. Where instances have an attribute "id", their numbers are these.

    Instances that repeat an id have other numbers, which Blender makes up. They come in the order of their rows.
    """

    by_number: dict[int, int] | None  # None: the numbers are the rows
    repeated: list[int]  # rows, the last one first

    @classmethod
    def of(cls, ids: NDArray[Any] | None) -> _Rows:
        if ids is None:
            return cls(None, [])
        known: dict[int, int] = {}
        repeated = [row for row, number in enumerate(ids[:, 0].tolist()) if known.setdefault(number, row) != row]
        return cls(known, repeated[::-1])

    def of_number(self, number: int) -> int | None:
        if self.by_number is None:
            return number
        if number not in self.by_number and self.repeated:
            self.by_number[number] = self.repeated.pop()
        return self.by_number.get(number)


@dataclass(frozen=True)
class InstancerValues:
    """An instance's values.

    Attributes
    ----------
    instancer
        The evaluated object; valid only during its step of Blender's iterator.
    row
        Of the instance's values among those of the instancer; None: it cannot be told.
    particle
        Values of the particle that it is.
    """

    instancers: Instancers
    instancer: Any
    row: int | None
    particle: dict[str, tuple[float, ...]]

    def value(self, name: str) -> tuple[float, ...] | None:
        """Return the attribute of the instance, or else the property of its instancer; None if there is neither."""
        values = self.instancers.attribute(self.instancer, name)
        if values is None:
            return property_of((self.instancer, self.instancer.data), name)
        if self.row is None or self.row >= len(values):
            self.instancers.report.warn(f"object '{self.instancer.original.name}'", f"attribute '{name}' of its "
                                        "instances is left out, since their ids do not tell them apart")  # fmt: skip
            return None
        return tuple(map(float, values[self.row]))


def _attribute(instancer: Any, name: str) -> NDArray[Any] | None:
    if not hasattr(instancer, "evaluated_geometry"):  # before Blender 5.0
        return None
    geometry = instancer.evaluated_geometry()  # which owns what it returns
    points = geometry.instances_pointcloud()
    return None if points is None else layer_values(points.attributes.get(name))
