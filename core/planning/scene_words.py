"""A scene's objects by their places in the tables, as sentences name them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..derivatives.decisions import Decision, Decisions
from ..scene.names import MOST_NAMED, listed, sentence_each
from ..scene.scene import Scene
from ..tables.tables import Tables


@dataclass(frozen=True)
class SceneWords:
    """The decisions on a derivative, with the names of what they are about. Fields are numbered behind the meshes."""

    scene: Scene
    tables: Tables
    meshes: Sequence[str]
    lights: Sequence[str]
    materials: Sequence[str]
    by_part: Mapping[str, Decision]

    @staticmethod
    def of(scene: Scene, tables: Tables, decided: Decisions) -> SceneWords:
        """Of the decisions on a derivative of a scene with these tables."""
        meshes = tables.mesh_names + tuple(scene.fields)
        return SceneWords(scene, tables, meshes, list(scene.lights), list(scene.materials),
                          {decision.part: decision for decision in decided})

    @cached_property
    def emissive(self) -> bool:
        """Whether any mesh may emit light (`Scene.emitters`)."""
        table = self.tables.materials
        if not table.emits.any():
            return False
        before = np.append(0, np.cumsum(table.emits))
        materials = before[table.first_closure[1:]] > before[table.first_closure[:-1]]
        faces = self.tables.face_material[: self.tables.mesh_first_face[len(self.scene.meshes)]]
        return bool(materials[faces].any())

    def computed(self, part: str) -> Decision | None:
        """The decision on a part that is computed; else None."""
        found = self.by_part.get(part)
        return found if found is not None and found.computed else None

    def mesh_names(self, decision: Decision) -> str:
        """The meshes that a decision is about."""
        return _named(decision.meshes, self.meshes)

    def light_names(self, decision: Decision) -> str:
        """Likewise its lights."""
        return _named(decision.lights, self.lights)

    def material_names(self, decision: Decision) -> str:
        """Likewise its materials."""
        return _named(decision.materials, self.materials)

    def sentence(self, part: str, sentence: str) -> list[str]:
        """The sentence, if a part is computed, with the names of what it is about: {meshes}, {lights}, {materials}."""
        found = self.computed(part)
        return [] if found is None else [sentence.format(
            meshes=self.mesh_names(found), lights=self.light_names(found), materials=self.material_names(found))]

    def pairs(self, part: str, sentence: str) -> list[str]:
        """A sentence for each pair of meshes of a part, whose names take the place of {}."""
        found = self.computed(part)
        return [] if found is None else self.each_pair(found.pairs, sentence)

    def each_pair(self, pairs: Sequence[tuple[int, int]], sentence: str) -> list[str]:
        """Likewise of some pairs."""
        words = [f"'{self.meshes[a]}' and '{self.meshes[b]}'" if a != b else f"parts of '{self.meshes[a]}'"
                 if self.scene.meshes[self.meshes[a]].instances is None else f"instances of '{self.meshes[a]}'"
                 for a, b in pairs[:MOST_NAMED]]
        return sentence_each(words, sentence.format, "pairs of meshes", len(pairs))

    def pierced(self, part: str, sentence: str) -> list[str]:
        """A sentence for each light of a part with the meshes that pass through it: {light} and {meshes}."""
        found = self.by_part.get(part)
        through: dict[int, list[str]] = {}
        for light, mesh in () if found is None or found.outcome == "zero" else found.pierced:
            through.setdefault(light, []).append(self.meshes[mesh])
        return [sentence.format(light=self.lights[light], meshes=listed(names)) for light, names in through.items()]


def _named(places: Sequence[int], names: Sequence[str]) -> str:
    return listed([names[k] for k in places[:MOST_NAMED]], len(places))
