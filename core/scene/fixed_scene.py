"""A scene that does not change while it is queried, so that answers can be cached."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import fields
from functools import cached_property

from .scene import Scene


class FixedScene(Scene):
    """A validated scene that computes queries over all its meshes once."""

    @staticmethod
    def of(scene: Scene) -> FixedScene:
        """Wrap the objects of a scene without copying them; they must not change while the result is in use."""
        return FixedScene(**{f.name: getattr(scene, f.name) for f in fields(Scene)})

    @cached_property
    def shape_names(self) -> Sequence[str]:
        """Names of the meshes, then of the fields: the order in which the engine numbers them."""
        return [*self.meshes, *self.fields]

    @cached_property
    def used_materials(self) -> list[str]:
        """As `Scene.used_materials`."""
        of_fields = {one.material for one in self.fields.values()}
        return [name for name in self.materials if name in self._users or name in of_fields]

    @cached_property
    def emitters(self) -> list[str]:
        """As `Scene.emitters`."""
        return Scene.emitters.fget(self)  # type: ignore[attr-defined]

    @cached_property
    def slots(self) -> list[str]:
        """As `Scene.slots`."""
        return Scene.slots.fget(self)  # type: ignore[attr-defined]

    def emits(self, mesh_name: str) -> bool:
        """As `Scene.emits`."""
        return mesh_name in self._emitting

    def meshes_with(self, materials: Collection[str]) -> list[str]:
        """As `Scene.meshes_with`."""
        if not materials:
            return []
        users = [self._users[name] for name in frozenset(materials) if name in self._users]
        if len(users) == 1:
            return users[0]
        found = {name for some in users for name in some}
        return [name for name in self.meshes if name in found]

    @cached_property
    def _emitting(self) -> frozenset[str]:
        return frozenset(self.emitters)

    @cached_property
    def _users(self) -> dict[str, list[str]]:
        """For each material, the meshes with faces of this material, in the order of `meshes`."""
        out: dict[str, list[str]] = {}
        for name, mesh in self.meshes.items():
            for material in dict.fromkeys(mesh.used_materials):
                out.setdefault(material, []).append(name)
        return out
