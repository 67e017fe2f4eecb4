"""Between which meshes the direction of light is held where they nearly touch, by the native engine."""

from __future__ import annotations

from dataclasses import dataclass

from ..derivatives.motion import Motion
from ..scene.light import turns_with_point
from ..scene.scene import Scene
from .fixed_direction_light import HeldLight, lets_light_pass
from .primary import is_stepped
from .shadow import bent_meshes
from .specular import specular_materials


@dataclass(frozen=True)
class Touching:
    """On which meshes light of which others may be held, as something moves: names, `givers` are among `receivers`."""

    receivers: tuple[str, ...] = ()
    givers: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.givers) and len(self.receivers) > 1


def touching_meshes(scene: Scene, moves: Motion, held: HeldLight, max_depth: int) -> Touching:
    """Between which meshes light may be held, as something of `moves` moves.

    Where surfaces nearly touch and move along each other, derivatives of light that rides on one of them have no
    variance on the other (native/scene/contact.h; the engine follows the same rule, contact_meshes.cpp). `held` is
    light that holds its direction everywhere.
    """
    if max_depth < 2 or held.meshes or lets_light_pass(scene) or not (moves.meshes or moves.camera):
        return Touching()
    perfect = set(specular_materials(scene))
    jumping = {name for name in scene.materials
               if any(is_stepped(texture) for closure in scene.closures(name) for texture in closure.textures.values())}
    bent = set(bent_meshes(scene)) if any(map(turns_with_point, scene.lights.values())) else set()
    left_out = {*scene.meshes_with(perfect), *bent}
    plain = tuple(name for name in scene.meshes if name not in left_out)
    dark = set(scene.meshes_with(jumping))
    return Touching(plain, tuple(name for name in plain
                                 if name not in dark and (max_depth > 2 or scene.emits(name))))
