"""Objects that are not meshes when Blender has evaluated them: hair, point clouds, and what cannot be rendered."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from edgegrad import Camera
from edgegrad import expression as e
from edgegrad.expression import nodes_of
from edgegrad.scene.placement import stretches

from ...problem import Report
from ..materials.material import MaterialReading
from .attributes import ALONG, PARAMETRIC
from .group import Placed
from .hair import Hair, HairMeshes, hair_of
from .meshes import PlacedMeshes
from .points import build_points

# Types of evaluated objects that are rendered. Curves, surfaces, text and metaballs are evaluated to meshes.
RENDERED = ("MESH", "LIGHT", "CURVES", "POINTCLOUD")
# Types that Cycles does not render either.
INVISIBLE = ("CURVE", "SURFACE", "FONT", "META", "ARMATURE", "LATTICE", "EMPTY", "LIGHT_PROBE", "CAMERA", "SPEAKER")
THROUGH = ("GLASS", "REFRACTION", "TRANSPARENT", "TRANSLUCENT")  # kinds of materials
LEFT_OUT = {"VOLUME": "is a volume, which can't be rendered; it is left out",
            "GREASEPENCIL": "is a grease pencil drawing, which can't be rendered; it is left out",
            "GPENCIL": "is a grease pencil drawing, which can't be rendered; it is left out"}  # fmt: skip


def _lets_light_through(reading: MaterialReading) -> bool:
    """Whether light passes through surfaces of a material."""
    return any(one.kind in THROUGH or one.alpha < 1.0 or one.transmission > 0.0
               or not one.textures.keys().isdisjoint(("alpha", "transmission"))
               for one in reading.shaders())  # fmt: skip


def _warn_about_points(placed: Placed, names: set[str], reading: MaterialReading, report: Report) -> None:
    """Warn of what the material of a point cloud reads and points do not have as in Cycles."""
    where = f"object '{placed.source.object}'"
    if any(name.startswith(ALONG) for name in names):
        report.warn(where, "the tangent that its material reads is 0 on points")
    sides = (e.Coordinates("TRUE_NORMAL"), e.Backfacing())
    read = {node for expression in reading.expressions() for node in nodes_of(expression)}
    if not read.isdisjoint(sides) and stretches(placed.source.matrix[:3, :3]):
        report.warn(where, "its scale differs between axes, so its points are ellipsoids: their true normals and back "
                    "sides are those of ellipsoids, in Cycles those of spheres")  # fmt: skip


def _warn_about_strands(placed: Placed, names: set[str], reading: MaterialReading, ribbons: bool,
                        report: Report) -> None:  # fmt: skip
    """Warn of what the material of hair reads and strands do not have as in Cycles."""
    where = f"object '{placed.source.object}'"
    for name, what in ((PARAMETRIC, "the output 'Parametric'"), (ALONG, "the tangent")):
        if any(one.startswith(name) for one in names):
            report.warn(where, f"{what} that the material of its hair reads is 0 there")
    if ribbons and any(e.Coordinates("TRUE_NORMAL") in nodes_of(one) for one in reading.expressions()):
        report.warn(where, "the true normal that the material of its hair reads is that of tubes; Cycles' ribbons face "
                    "the viewer")  # fmt: skip


def warn_about_type(ob: Any, report: Report) -> None:
    """Warn of an evaluated object that cannot be rendered because of its type."""
    if ob.type not in RENDERED and ob.type not in INVISIBLE:
        unknown = f"is of type {ob.type}, which can't be rendered; it is left out"
        report.warn(f"object '{ob.original.name}'", LEFT_OUT.get(ob.type, unknown))


class OtherGeometry:
    """Adds hair and point clouds to the meshes of an export.

    Parameters
    ----------
    camera
        Decides how finely they are tessellated.
    """

    def __init__(self, meshes: PlacedMeshes, camera: Camera, depsgraph: Any, report: Report) -> None:
        self._meshes = meshes
        self._camera = camera
        self._use_hair = bool(getattr(depsgraph.view_layer, "use_strand", True))
        shape = getattr(getattr(depsgraph.scene, "cycles_curves", None), "shape", "RIBBONS")
        self._linear, self._ribbons = shape == "THICK_LINEAR", shape == "RIBBONS"
        self._report = report
        self._strands = 0
        self._built: dict[Any, Any] = {}

    def shows(self, instance: Any) -> bool:
        """Whether an instance shows hair or points; counts strands, whose number `add` needs."""
        if instance.object.type == "POINTCLOUD":
            return bool(instance.show_self)
        hair = self._hair(instance)
        self._strands += sum(one.number for one in hair)
        return bool(hair)

    def _hair(self, instance: Any) -> list[Hair]:
        ob = instance.object
        shown = instance.show_self if ob.type == "CURVES" else instance.show_particles
        return list(hair_of(ob, self._report)) if shown and self._use_hair else []

    def add(self, instance: Any, placed: Placed, needed: dict[str, set[str]],
            materials: Mapping[str, MaterialReading]) -> None:  # fmt: skip
        """Add the hair or the points of an instance; `needed` has the attributes that each material reads."""
        ob, slots = placed.object, placed.slots
        if ob.type == "POINTCLOUD" and instance.show_self:
            _warn_about_points(placed, needed[slots[0]], materials[slots[0]], self._report)
            self._place(placed, "", slots[0], needed[slots[0]],
                        partial(build_points, ob, self._camera, report=self._report,
                                translucent=_lets_light_through(materials[slots[0]])))  # fmt: skip
            return
        make = HairMeshes(self._camera, self._linear, self._report, self._strands, self._ribbons)
        for hair in self._hair(instance):
            slot = slots[hair.slot(len(slots))]
            _warn_about_strands(placed, needed[slot], materials[slot], self._ribbons, self._report)
            through = _lets_light_through(materials[slot])
            self._place(placed, hair.part, slot, needed[slot], partial(make.build, hair, translucent=through))

    def _place(self, placed: Placed, part: str, slot: str, names: set[str], build: Callable[..., Any]) -> None:
        values = placed.values
        key = (placed.object.data.as_pointer(), part, frozenset(names))
        if key not in self._built:
            self._built[key] = build(values=values, names=names)
        if self._built[key] is None:
            return
        arrays, attributes = self._built[key]
        # A part of an object is none of its mesh, whose vertices can be written back.
        source = replace(placed.source, part=part, instance=True)
        self._meshes.place(replace(placed, source=source, slots=(slot,)), key, arrays, 0, names, lambda _: attributes)
