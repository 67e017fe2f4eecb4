"""What sees what: visibility of objects, light and shadow linking."""

from __future__ import annotations

from typing import Any

import bpy

from . import stage
from .case import case


def _collection(name: str, *objects: Any) -> Any:
    made = bpy.data.collections.new(name)
    for ob in objects:
        made.objects.link(ob)
    return made


@case("Light linking and shadow linking, included and excluded")
def light_linking() -> None:
    """Lamps that light, or are shadowed by, some objects only."""
    stage.studio()
    balls = stage.row([stage.diffuse("A", (0.8, 0.3, 0.3)), stage.diffuse("B", (0.3, 0.8, 0.3)),
                       stage.principled("C", (0.3, 0.3, 0.8), Roughness=0.3), stage.diffuse("D")])  # fmt: skip
    only = stage.lamp("AREA", "Only B and C", 60.0, (0, -2.5, 2.5), (0, 0, 0.5), size=0.6)
    only.light_linking.receiver_collection = _collection("Lit", balls[1], balls[2])
    free = stage.lamp(
        "SPOT", "No shadow of D", 200.0, (3.5, -2.0, 3.0), (1.8, 0.5, 0), spot_size=0.9, shadow_soft_size=0.0
    )
    others = [ob for ob in bpy.context.scene.objects if ob.type == "MESH" and ob != balls[3]]
    free.light_linking.blocker_collection = _collection("Blockers", *others)
    sun = stage.lamp("SUN", "Not A", 0.6, (0, 0, 5), (1.0, 2.0, 0), angle=0.1)
    excluded = _collection("Unlit", balls[0])
    sun.light_linking.receiver_collection = excluded
    excluded.collection_objects[0].light_linking.link_state = "EXCLUDE"


@case("Objects hidden from the camera, reflections, shadows or diffuse light", bounces=4)
def object_visibility() -> None:
    """Ray visibility of meshes, beside a mirror."""
    stage.studio()
    balls = stage.row([stage.diffuse("Camera", (0.8, 0.3, 0.3)), stage.diffuse("Shadow", (0.3, 0.8, 0.3)),
                       stage.diffuse("Reflection", (0.3, 0.3, 0.8)), stage.diffuse("Diffuse", (0.8, 0.7, 0.2)),
                       stage.diffuse("Nothing")])  # fmt: skip
    balls[0].visible_camera = False
    balls[1].visible_shadow = False
    balls[2].visible_glossy = False
    balls[3].visible_diffuse = False
    mirror = stage.simple(
        "Mirror", "ShaderNodeBsdfGlossy", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.05}, distribution="GGX"
    )
    stage.add("Mirror", stage.plane("Mirror", mirror, size=7.0), (0, 1.4, 1.0), (1.35, 0, 0))
