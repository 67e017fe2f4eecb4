"""Export of Blender's materials to `edgegrad.Material`s and `edgegrad.Mixture`s."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Expression, Operand, images_of, nodes_of, replaced
from edgegrad.scene.material import SMOOTH_NORMAL

from ...problem import Report
from ..approximated.volumes import Volume, describe_volume, read_volume
from ..geometry import attributes
from ..nodes import links as nodes
from ..nodes.camera_view import CameraView
from ..nodes.constants import Place, attributes_of, constants_of
from ..nodes.expressions import Reader, Unreadable, number
from ..nodes.images import Images
from ..nodes.read_displacement import displaced_normal
from .coats import separate_coat
from .shader_nodes import read_shader
from .shaders import Closure, Part, mixture, parts, product

PART = "/shader "  # separates the name of a mixture from that of its part
# Inputs for (base colour, emission colour, emission strength) that a fit may write, by type of shader node.
WRITABLE = {"BSDF_PRINCIPLED": ("Base Color", "Emission Color", "Emission Strength"), "BSDF_DIFFUSE": ("Color", "", ""),
            "EMISSION": ("", "Color", "Strength")}  # fmt: skip


@dataclass
class SocketPath:
    """An input of a node by names, since references to nodes become invalid after an undo."""

    node: str
    socket: str

    def find(self, material: Any) -> Any:
        """Return the socket in the node tree of the material."""
        return material.node_tree.nodes[self.node].inputs[self.socket]


@dataclass(frozen=True)
class BakedOutput:
    """An output of a node that must be baked, by names.

    Attributes
    ----------
    groups
        Names of the group nodes around the node.
    node, output
        Name of the node, and identifier of its output.
    normal
        Whether the output is a normal, which is baked as a normal map.
    tangents
        Tangent nodes that it depends on and that read the active UV map, with the names of the groups around them.
    """

    groups: tuple[str, ...]
    node: str
    output: str
    normal: bool
    tangents: tuple[tuple[tuple[str, ...], str], ...] = ()


@dataclass
class MaterialReading:
    """An exported material, and the sockets from which its values were read.

    Attributes
    ----------
    value
        The exported material.
    parts
        The parts of a mixture by name.
    material
        Name of Blender's material; None for faces without one.
    base_color, emission_color, emission_strength
        Sockets for fitted values; None: the material has no such socket.
    fed
        Maps a field to the node that is linked to its socket.
    baked
        Outputs that must be baked before the material can be rendered.
    constants
        Values of the whole object, and of the view layer, that they depend on.
    scatters
        Whether light scatters below the surface.
    bumped
        Whether its displacement is rendered as bump alone.
    """

    value: edgegrad.Material | edgegrad.Mixture
    parts: dict[str, edgegrad.Material] = field(default_factory=dict)
    material: str | None = None
    base_color: SocketPath | None = None
    emission_color: SocketPath | None = None
    emission_strength: SocketPath | None = None
    fed: dict[str, str] = field(default_factory=dict)
    baked: list[BakedOutput] = field(default_factory=list)
    constants: dict[Place, Operand] = field(default_factory=dict)
    scatters: bool = False
    bumped: bool = False

    def stand_in(self, baked: BakedOutput) -> str:
        """Name of the placeholder image that expressions read for an output that must be baked."""
        return f"{self.material} (baked {self.baked.index(baked)})"

    def with_images(self, names: Mapping[str, str], name: str) -> MaterialReading:
        """Return a copy with another name, whose expressions read other images.

        Parameters
        ----------
        names
            Maps placeholders to images. Expressions with a placeholder that has no image are dropped.
        """
        known = {self.stand_in(one) for one in self.baked} - set(names)

        def kept(one: Any) -> Any:
            textures = {key: renamed(value, names) for key, value in one.textures.items()
                        if not images_of(value) & known}  # fmt: skip
            return replace(one, textures=textures)

        value = kept(self.value)
        if isinstance(value, edgegrad.Material):
            return replace(self, value=value)
        keys = tuple(name + key[key.rindex(PART) :] for key in value.parts)
        parts = {new: kept(self.parts[key]) for new, key in zip(keys, value.parts, strict=True)}
        return replace(self, value=replace(value, parts=keys), parts=parts)

    def shaders(self) -> list[edgegrad.Material]:
        """Return the closures of the material."""
        return [self.value] if isinstance(self.value, edgegrad.Material) else list(self.parts.values())

    def fill(self, volume: Volume | None) -> None:
        """Give all closures the material's volume: as a medium, or as absorption, which has derivatives.

        A volume without a surface is often a room that holds cameras, lamps and objects, which absorption within a mesh
        does not reach.
        """
        if volume is None or not np.any(volume.scattering + volume.absorption > 0.0):
            return
        for one in self.shaders():
            if np.any(volume.scattering > 0.0) or one.kind == "TRANSPARENT":
                one.medium = volume.medium
            else:
                one.absorption = volume.absorption.copy()

    def expressions(self) -> Iterator[Expression]:
        """Yield all expressions of the material."""
        for one in (self.value, *self.parts.values()):
            yield from one.textures.values()

    def maps_normals(self) -> bool:
        """Whether the material has a normal map in tangent space."""
        own = any("normal" in one.textures and one.normal_space == "TANGENT" for one in self.shaders())
        return own or any(isinstance(node, e.NormalMap) for one in self.expressions() for node in nodes_of(one))

    def attributes(self) -> set[str]:
        """Return the names of the attributes that the material reads from meshes."""
        found = [node for expression in self.expressions() for node in nodes_of(expression)]
        names = {node.name for node in found if isinstance(node, e.Attribute)} | attributes_of(self.constants)
        for node in found:
            if isinstance(node, e.NormalMap):
                names |= {node.uv, node.uv + attributes.TANGENT}
        for one in self.shaders():
            turned = "anisotropy" in one.textures or one.anisotropy != 0.0
            mapped = "normal" in one.textures and one.normal_space == "TANGENT"
            if mapped or turned:
                names |= {one.normal_uv, one.normal_uv + attributes.TANGENT}
        return names


def read_material(material: Any, images: Images, report: Report, view: CameraView | None = None,
                  stretched: bool = False) -> MaterialReading:  # fmt: skip
    """Read a material; report a warning for each approximation, and a line on what was read.

    Parameters
    ----------
    material
        Blender's evaluated material, or None for faces without one.
    images
        Receives the images that the material reads.
    view, stretched
        As in `Reader`.
    """
    if material is None:
        return MaterialReading(_default_surface())
    where = f"material '{material.name}'"
    tree = material.node_tree
    # From 5.0 on, materials always have nodes, and `use_nodes` is deprecated.
    if tree is None or (bpy.app.version < (5, 0, 0) and not material.use_nodes):
        color = np.clip(np.array(material.diffuse_color[:3], np.float64), 0.0, 1.0)
        return MaterialReading(edgegrad.Material(color, kind="DIFFUSE"), material=material.name)
    reading = MaterialReading(_black(), material=material.name)
    output = tree.get_output_node("CYCLES")
    if output is None:
        report.tell(where, "has no output that Cycles uses; it is black, as in Cycles")
        return reading
    volume = nodes.feed(output.inputs["Volume"])
    filling = None
    if volume.output is not None:
        filling = read_volume(volume)
        for text in (describe_volume(volume),) if filling is None else filling.remarks:
            report.warn(where, text)
        if nodes.source(output.inputs["Surface"]) is None:
            reading.value = edgegrad.Material(np.ones(3), kind="TRANSPARENT")
            reading.fill(filling)
            return reading
    reader = _Reading(material, images, view, reading, stretched)
    reader.displace(output)
    reader.read(output, report)
    reading.scatters = reader.reader.scatters
    reading.fill(filling)
    return reading


def renamed(value: Expression, names: Mapping[str, str]) -> Expression:
    """Rename the images of an expression."""
    return replaced(value, lambda node: replace(node, image=names[node.image])
                    if isinstance(node, e.ImageTexture) and node.image in names else node)  # fmt: skip


def _default_surface() -> edgegrad.Material:
    """Return what Cycles renders for faces without a material: up to 4.5 Diffuse, then Principled with its defaults."""
    if bpy.app.version < (5, 0, 0):
        return edgegrad.Material(np.full(3, 0.8), kind="DIFFUSE")
    return edgegrad.Material(np.full(3, 0.8), specular_ior_level=0.5)


def _black() -> edgegrad.Material:
    return edgegrad.Material(np.zeros(3), kind="DIFFUSE")


class _Reading:
    """The translation of the node tree of one material."""

    def __init__(self, material: Any, images: Images, view: CameraView | None, reading: MaterialReading,
                 stretched: bool = False) -> None:  # fmt: skip
        self.material = material
        self.reading = reading
        self.normal: Expression | None = None  # of the displaced surface
        self.reader = Reader(images, self._bake, material.pass_index, view, owner=material, stretched=stretched)

    def displace(self, output: Any) -> None:
        """Read the displacement of the material as bump, unless it only moves vertices (`displacement`)."""
        if self.material.displacement_method == "DISPLACEMENT":
            return
        try:
            self.normal = displaced_normal(self.reader, nodes.feed(output.inputs["Displacement"]),
                                           self.material.displacement_method == "BOTH")  # fmt: skip
        except Unreadable as error:
            self.reader.note(f"the bump of its displacement is left out, since {error} can't be read")
        self.reader.displaced = self.normal is not None
        self.reading.bumped = self.reader.displaced and self.material.displacement_method == "BUMP"

    def read(self, output: Any, report: Report) -> None:
        found = list(parts(self.reader, nodes.feed(output.inputs["Surface"])))
        closures = [layer for part in found for layer in separate_coat(self.reader, part, self._closure(part))]
        if not _has_transparent_shadow(self.material):
            closures = [_opaque_to_light(*one) for one in closures]
        merged = _merge_emission(closures)
        name = self.material.name_full
        if len(merged) == 1 and merged[0][0].weight == 1.0:
            self.reading.value = merged[0][1]
            self._note_sockets([part for part in found if not part.groups])
        elif merged:
            keys = [f"{name}{PART}{k}: {nodes.label(part.node, part.groups)}" for k, (part, _) in enumerate(merged)]
            self.reading.parts = dict(zip(keys, (closure for _, closure in merged), strict=True))
            layers = dict(zip(keys, (part.weight for part, _ in merged), strict=True))
            if len(keys) == 1:  # the weight of a single part counts only beside another part
                black, weight = f"{name}{PART}1: black", merged[0][0].weight
                rest = 0.5 if isinstance(weight, Expression) else max(1.0 - (number(weight) or 0.0), 0.0)
                self.reading.parts[black], layers[black] = _black(), rest
            self.reading.value = mixture(layers)
        where = f"material '{self.material.name}'"
        for note in self.reader.notes:
            report.warn(where, note)
        report.tell(where, self._summary([part for part, _ in merged]))

    def _closure(self, part: Part) -> edgegrad.Material:
        textures = {} if self.normal is None else {SMOOTH_NORMAL: self.normal}
        material = edgegrad.Material(textures=textures)
        return read_shader(Closure(self.reader, part.node, part.groups, material, part.output,
                                   self._bake_normal))  # fmt: skip

    def _bake(self, output: Any, groups: nodes.Groups, normal: bool = False) -> Expression | None:
        if output.type not in ("VALUE", "INT", "BOOLEAN", "VECTOR", "RGBA"):
            return None
        path = tuple(group.name for group in groups)
        before = [(output, groups), *nodes.upstream(output.node, groups)]
        tangents = dict.fromkeys((tuple(group.name for group in around), one.node.name) for one, around in before
                                 if one.node.type == "TANGENT" and one.node.direction_type == "UV_MAP"
                                 and not one.node.uv_map)  # fmt: skip
        baked = BakedOutput(path, output.node.name, output.identifier, normal, tuple(tangents))
        self.reading.constants |= constants_of(self.reader, output, groups)
        if baked not in self.reading.baked:
            self.reading.baked.append(baked)
        image = self.reading.stand_in(baked)
        value = e.ImageTexture(image, attributes.layer(attributes.BAKED_UV), extension="EXTEND", alpha="NONE")
        return e.Channel(value, 0) if output.type in ("VALUE", "INT", "BOOLEAN") else value

    def _bake_normal(self, feed: nodes.Feed) -> Expression | None:
        return self._bake(feed.output, feed.groups, normal=True)

    def _note_sockets(self, found: list[Part]) -> None:
        """Record the sockets of the outermost tree that a fit may write."""
        for part in found:
            color, emission, strength = WRITABLE.get(part.node.type, ("", "", ""))
            if color:
                self.reading.base_color = SocketPath(part.node.name, color)
                self._note_feed("base_color", part.node.inputs[color])
            taken = self.reading.emission_color is not None and part.node.type != "EMISSION"
            if emission and not taken:
                self.reading.emission_color = SocketPath(part.node.name, emission)
                self.reading.emission_strength = SocketPath(part.node.name, strength)
                for name in (emission, strength):
                    self._note_feed("emission", part.node.inputs[name])

    def _note_feed(self, fieldname: str, socket: Any) -> None:
        fed_by = nodes.source(socket)
        if fed_by is not None:
            self.reading.fed.setdefault(fieldname, fed_by.node.name)

    def _summary(self, merged: list[Part]) -> str:
        kinds = " + ".join(dict.fromkeys(part.node.bl_label for part in merged)) or "black"
        textured = sorted({key for one in self.reading.shaders() for key in one.textures})
        if isinstance(self.reading.value, edgegrad.Mixture) and self.reading.value.textures:
            textured.append("mix")
        out = [f"read as {kinds}"]
        if textured:
            out.append(f"varying {', '.join(textured).replace('_', ' ')}")
        if self.reading.baked:
            out.append("baked " + ", ".join(f"'{' / '.join([*b.groups, b.node])}'" for b in self.reading.baked))
        if self.reader.notes:
            out.append("approximated as warned")
        return "; ".join(out)


def _has_transparent_shadow(material: Any) -> bool:
    """Read whether light passes transparent surfaces: a property of Blender from 4.2 on, of Cycles before."""
    cycles = getattr(material, "cycles", None)
    return bool(getattr(material, "use_transparent_shadow", getattr(cycles, "use_transparent_shadow", True)))


def _opaque_to_light(part: Part, closure: edgegrad.Material) -> tuple[Part, edgegrad.Material]:
    """Change a closure so that it blocks light, though paths pass through it, as without transparent shadows."""
    shadow = e.LightPath("SHADOW")
    if closure.kind == "TRANSPARENT":
        return replace(part, weight=product(part.weight, e.Math("SUBTRACT", 1.0, shadow))), closure
    if closure.kind == "PRINCIPLED" and (closure.alpha < 1.0 or "alpha" in closure.textures):
        alpha = e.Math("MAXIMUM", closure.textures.get("alpha", closure.alpha), shadow)
        return part, replace(closure, textures={**closure.textures, "alpha": alpha})
    return part, closure


def _merge_emission(closures: list[tuple[Part, edgegrad.Material]]) -> list[tuple[Part, edgegrad.Material]]:
    """Merge Emission nodes that are added to one other shader into the emission of that shader."""
    emissive = [(part, closure) for part, closure in closures if part.node.type == "EMISSION"]
    rest = [(part, closure) for part, closure in closures if part.node.type != "EMISSION"]
    if len(rest) > 1 or any(part.weight != 1.0 for part, _ in closures) or (rest and not _takes_emission(rest[0][1])):
        return closures
    textured = any("emission" in closure.textures for _, closure in closures)
    if not emissive or (textured and len(closures) > 1):
        return closures
    part, first = rest[0] if rest else emissive[0]
    total = np.sum([closure.emission for _, closure in closures], axis=0)
    return [(part, replace(first, emission=total))]


def _takes_emission(closure: edgegrad.Material) -> bool:
    """Whether emission added to a shader equals emission by the shader itself: no coat or sheen lies above it."""
    covered = ("coat_weight", "sheen_weight")
    plain = all(getattr(closure, key) == 0.0 and key not in closure.textures for key in covered)
    opaque = closure.alpha == 1.0 and "alpha" not in closure.textures
    return plain and opaque and closure.kind in ("PRINCIPLED", "DIFFUSE", "GLOSSY")
