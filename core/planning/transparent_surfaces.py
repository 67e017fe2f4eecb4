"""Surfaces that let light through, as shadow rays and paths pass them: what of it changes, in words."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from ..derivatives.motion import Motion
from ..expression.nodes import Attribute, Expression, ImageTexture, nodes_of
from ..scene import parameters
from ..scene.material import Material, Mixture
from ..scene.names import listed
from ..scene.scene import Scene
from ..tables.materials import TRANSPARENCY, flags
from .primary import is_stepped


def changing_shares(scene: Scene, wrt: Sequence[str], moves: Motion) -> str | None:
    """Which materials let through other light than before, in words; None: none does.

    The native engine follows the same rule (native/engine/transparent_closures.cpp).
    """
    found = []
    asked = set(wrt)
    for name in scene.used_materials:
        shares = list(_shares(scene, name, asked))
        textured = any(textures for _, textures in shares)
        if any(not paths.isdisjoint(asked) for paths, _ in shares) or (textured and moves.any):
            found.append(name)
    if not found:
        return None
    return f"what {listed(found)} let through changes, on the way to lights and between surfaces"


def missing_shares(scene: Scene, moves: Motion) -> Iterator[str]:
    """Sentences on jumps of what surfaces let through that are no edges: nothing computes their shadows."""
    def stepped(name: str) -> bool:
        return any(is_stepped(texture) for _, textures in _shares(scene, name) for texture in textures)

    found = [name for name in scene.used_materials if stepped(name)]
    if found and moves.any:
        yield (f"shadows of the borders that an image without interpolation draws in what {listed(found)} let "
               "through: they are no edges")


def _shares(scene: Scene, name: str, wrt: Collection[str] = ()) -> Iterator[tuple[set[str], list[Expression]]]:
    """Of each part of a material that lets light through: the parameters of its share, and its textures."""
    material = scene.materials[name]
    for k, part in enumerate(material.parts if isinstance(material, Mixture) else (name,)):
        closure = scene.materials[part]
        assert isinstance(closure, Material)  # Scene.validate has seen to it
        asked = [field for field in ("alpha", "base_color") if f"materials.{part}.{field}" in wrt]
        if not flags(closure, asked) & TRANSPARENCY:
            continue
        paths: set[str] = set()
        textures = []
        field = "base_color" if closure.kind == "TRANSPARENT" else "alpha"
        values = [(part, field, field, closure.textures.get(field))]
        if isinstance(material, Mixture):
            values.append((name, "weights", str(k), material.textures.get(str(k))))
        for owner, number, key, texture in values:
            if texture is None:
                paths.add(f"materials.{owner}.{number}")
                continue
            textures.append(texture)
            paths.add(f"materials.{owner}.{parameters.TEXTURES}{key}")
            for node in nodes_of(texture):
                if isinstance(node, ImageTexture):
                    paths.add(f"images.{node.image}.pixels")
                if isinstance(node, Attribute):
                    paths.update(f"meshes.{mesh}.{parameters.ATTRIBUTES}{node.name}" for mesh in scene.meshes)
        yield paths, textures
