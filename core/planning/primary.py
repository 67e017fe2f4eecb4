"""What the primary boundary term of a scene consists of, in words; the native engine follows the same rules."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..derivatives.motion import Motion
from ..expression.nodes import Expression, ImageTexture, nodes_of
from ..geometry.mesh_edges import MeshEdges
from ..geometry.placed_meshes import PlacedMeshes
from ..geometry.shape import star_shaped
from ..scene import parameters
from ..scene.mesh import Mesh
from ..scene.names import listed
from ..scene.scene import Scene
from .curves import crossing_lines, seen_curves

# Meshes of more faces are not searched for self-intersections (native/boundary/curves/intersections.h).
SELF_CROSSING_FACES = 50_000
# Of the camera's parameters, those that change the picture of what stands still only by depth of field.
_LENS = ("aperture_radius", "focus_distance", "aperture_rotation", "aperture_ratio")


@dataclass(frozen=True)
class PrimaryRules:
    """Candidate edges, whether there is anything to compute, and why, in words."""

    computed: bool
    edges: int
    of: int
    why: tuple[str, ...]


def mesh_edges(scene: Scene, placed: Mapping[str, Mesh]) -> dict[str, MeshEdges]:
    """The edges of each mesh of the tables."""
    textured = {name for name, material in scene.materials.items()
                if any(part.textures for part in [material, *scene.closures(name)])}
    return dict(zip(placed, MeshEdges.of_all(list(placed.values()), textured), strict=True))


def primary_rules(
    scene: Scene, placed: PlacedMeshes, edges: Mapping[str, MeshEdges], moves: Motion, wrt: Sequence[str]
) -> PrimaryRules:
    """Which edges can move in the picture and carry a jump there, with respect to some parameters.

    Parameters
    ----------
    placed, edges
        The meshes as the tables have them, and their edges.
    moves
        What moves with the parameters `wrt`.
    """
    camera = moves.camera and any(path.startswith("camera.") and _moves_rays(scene, path) for path in wrt)
    total = sum(e.count for e in edges.values())
    seen = seen_curves(scene, placed, moves, camera)
    if not moves.meshes and not camera:
        fixed = "no vertex is a parameter and the camera stands still"
        return PrimaryRules(bool(seen), 0, total, (fixed, *seen))
    swept = list(placed) if camera else list(moves.meshes)
    unseen = {name for name in placed if "camera" not in placed[name].visible_to}
    if camera:
        why = ["the camera moves, and so do all edges on its picture"]
    else:
        why = [f"moving meshes: {len(swept)} of {len(edges)} ({listed(swept)})"]
    moving = set(swept)
    still = sum(e.count for name, e in edges.items() if name not in moving)
    if still:
        why.append(f"skipped: {edge_count(still)} of meshes that stand still")
    hidden = [name for name in swept if name in unseen]
    if hidden:
        why.append(f"skipped: {edge_count(sum(edges[name].count for name in hidden))} of meshes that camera rays "
                   f"don't meet ({listed(hidden)})")
    swept = [name for name in swept if name not in unseen]
    plain = sum(edges[name].plain for name in swept)
    if plain:
        why.append(f"skipped: {edge_count(plain)} between two faces of one plane and one material, where nothing jumps")
    seams = sum(edges[name].shading_seams for name in swept)
    if seams:
        why.append(f"kept: {edge_count(seams)} inside of one plane where normals or attributes of a textured material "
                   "jump")
    moving -= unseen
    why += crossing_lines(placed, [pair for pair in placed.crossing
                                   if unseen.isdisjoint(pair) and not moving.isdisjoint(pair)])
    why += seen
    kept = sum(edges[name].count for name in swept) - plain
    return PrimaryRules(kept > 0 or bool(seen), kept, total, tuple(why))


def edge_count(edges: int) -> str:
    """A number of edges in words."""
    return f"{edges:,} edge{'' if edges == 1 else 's'}"


def _moves_rays(scene: Scene, path: str) -> bool:
    field = parameters.split(path)[2]
    c = scene.camera
    if field in _LENS:
        turns = field != "aperture_rotation" or c.aperture_blades >= 3
        return c.kind != "EQUIRECTANGULAR" and turns and c.aperture_radius > 0.0
    kinds = {"fov_x": ("PERSPECTIVE",), "ortho_width": ("ORTHOGRAPHIC",), "longitude": ("EQUIRECTANGULAR",),
             "latitude": ("EQUIRECTANGULAR",), "shift": ("PERSPECTIVE", "ORTHOGRAPHIC"),
             "pixel_aspect": ("PERSPECTIVE", "ORTHOGRAPHIC")}
    return c.kind in kinds.get(field, (c.kind,))


def missing_jumps(scene: Scene, placed: PlacedMeshes, moves: Motion) -> Iterator[str]:
    """Sentences on jumps that the camera may see and that are no edges: nothing computes them."""
    moving = set(placed) if moves.camera else set(moves.meshes)
    large = [name for name in moves.meshes if len(placed[name].faces) > SELF_CROSSING_FACES
             and not star_shaped(placed[name])]
    if large:
        yield (f"surfaces that pass through themselves: not looked for in {listed(large)} of more than "
               f"{SELF_CROSSING_FACES:,} faces, and left out")
    cut = [name for name in _near_clip_ends(scene, placed) if name in moving and _is_cut(scene, placed[name])]
    if cut:
        yield f"the borders that the camera's clip distances cut into {listed(cut)}: they are no edges"
    stepped = stepped_materials(scene)
    hard = [name for name in placed if name in moving and not stepped.isdisjoint(placed[name].materials)]
    if hard:
        yield (f"borders inside of the faces of {listed(hard)} that an image without interpolation draws: they are "
               "no edges")


def _near_clip_ends(scene: Scene, placed: PlacedMeshes) -> list[str]:
    """Meshes that a clip distance may cut, by their boxes."""
    camera = scene.camera
    low, high = placed.boxes
    middle, half = 0.5 * (low + high) - camera.to_world[:3, 3], 0.5 * (high - low)
    if camera.kind == "EQUIRECTANGULAR":
        nearest = np.linalg.norm(np.maximum(np.abs(middle) - half, 0.0), axis=1)
        farthest = np.linalg.norm(np.abs(middle) + half, axis=1)
    else:
        ahead = -camera.to_world[:3, 2]
        nearest, farthest = middle @ ahead - half @ np.abs(ahead), middle @ ahead + half @ np.abs(ahead)
    rounding = 1e-9 * (np.abs(nearest) + np.abs(farthest))
    cut = np.zeros(len(low), bool)
    for clip in (camera.clip_start, camera.clip_end):
        cut |= (nearest - rounding <= clip) & (clip <= farthest + rounding)
    return [name for name, near in zip(placed, cut, strict=True) if near]


def _is_cut(scene: Scene, mesh: Mesh) -> bool:
    """Whether the camera may see where a clip distance cuts the mesh."""
    camera = scene.camera
    seen = (mesh.vertices - camera.to_world[:3, 3]) @ camera.to_world[:3, :3]
    if mesh.instances is not None:
        return False
    depth = np.linalg.norm(seen, axis=1) if camera.kind == "EQUIRECTANGULAR" else -seen[:, 2]
    ends = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    for clip in (camera.clip_start, camera.clip_end):
        a, b = ends[(depth[ends] < clip).sum(axis=1) == 1].T
        share = ((clip - depth[a]) / (depth[b] - depth[a]))[:, None]
        at = seen[a] + share * (seen[b] - seen[a])
        if camera.kind == "EQUIRECTANGULAR" and len(at):
            return True
        place = camera.focal * at[:, :2] * (1.0 if camera.kind == "ORTHOGRAPHIC" else 1.0 / max(clip, 1e-9))
        # A line between two such places may cross the picture though they are outside of it.
        if len(at) and (place.min(axis=0) < camera.width).all() and (place.max(axis=0) > -camera.width).all():
            return True
    return False


def missing_texel_borders(scene: Scene, wrt: Sequence[str]) -> Iterator[str]:
    """Sentences on images without interpolation that slide over meshes which stand still: nothing computes that."""
    slid = {}
    stepped = stepped_materials(scene)
    for path in wrt:
        collection, name, field = parameters.split(path)
        if field.startswith(parameters.ATTRIBUTES):
            slid[f"{collection}.{name}"] = not stepped.isdisjoint(scene.meshes[name].materials)
        elif field.startswith(parameters.TEXTURES):
            texture = scene.materials[name].textures[field.removeprefix(parameters.TEXTURES)]
            slid[f"{collection}.{name}"] = is_stepped(texture)
    found = [name for name, stepped in slid.items() if stepped]
    if found:
        yield (f"the borders of texels of images without interpolation, where {listed(found)} may "
               "move them: they are no edges")


def stepped_materials(scene: Scene) -> set[str]:
    """Names of the materials that have an image without interpolation anywhere."""
    return {name for name, material in scene.materials.items()
            if any(map(is_stepped, (t for part in [material, *scene.closures(name)] for t in part.textures.values())))}


def is_stepped(texture: Expression) -> bool:
    """Whether an image without interpolation is a part of it."""
    return any(isinstance(node, ImageTexture) and node.interpolation == "CLOSEST" for node in nodes_of(texture))
