"""What a picture and its derivative consist of in a given scene: what is computed, what is skipped and why.

Reading the plan costs a pass over the vertices and edges and no ray. It is written for people: the
engines follow the same rules by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import narrow_derivatives, parameters, topology
from ._check import whole
from .bounces import MAX_DEPTH
from .differentiable import obstacles
from .light import AreaLight, PointLight, SunLight
from .mesh import Mesh
from .picture_plan import picture_plan
from .placement import placed_meshes
from .renderer import MAX_DERIVATIVE_DEPTH, TERMS
from .scene import Scene
from .shape import convex, face_normals, pierces
from .table_derivatives import asked_tables, wanted_tables
from .tables import flatten

# Two faces whose normals differ by less than this many radians lie in one plane.
COPLANAR = 1e-5

_WORDS = {
    "interior": "Interior (shading that changes smoothly)",
    "primary": "Primary boundary (edges that the camera sees)",
    "shadow": "Shadow boundary (edges between a lit point and a light)",
}
_LIGHTS = ((AreaLight, "area lights"), (PointLight, "point lights"), (SunLight, "suns"))


@dataclass(frozen=True)
class Term:
    """One term of the derivative.

    Attributes
    ----------
    name
        As in `edgegrad.TERMS`.
    computed
        False: it is zero in this scene.
    edges, of
        Candidate edges, and all edges (of the meshes that rays can hit); 0 for the interior.
    why
        What is computed or skipped, and the reason, in words.
    """

    name: str
    computed: bool
    edges: int
    of: int
    why: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """The picture's needs, the terms of a derivative, and what is left out of it though it may not be zero."""

    picture: tuple[str, ...]
    terms: tuple[Term, ...]
    missing: tuple[str, ...]

    @property
    def needed(self) -> tuple[str, ...]:
        """Names of the terms that can be non-zero, as `render_backward` takes them."""
        return tuple(term.name for term in self.terms if term.computed)

    def __str__(self) -> str:
        lines = ["Picture", *(f"  - {sentence}" for sentence in self.picture)]
        for term in self.terms:
            count = f": {term.edges:,} of {term.of:,} edges" if term.computed and term.of else ""
            lines.append(f"{_WORDS[term.name]}{count}{'' if term.computed else ': skipped, it is zero'}")
            lines += [f"  - {reason}" for reason in term.why]
        if not self.terms:
            return "\n".join(lines)
        lines.append("Not computed by this version" + ("" if self.missing else ": nothing that matters here"))
        lines += [f"  - {reason}" for reason in self.missing]
        return "\n".join(lines)


def plan(scene: Scene, wrt: Sequence[str] = (), *, max_depth: int = MAX_DERIVATIVE_DEPTH) -> Plan:
    """Say what the picture, and its derivatives with respect to some parameters, need.

    Parameters
    ----------
    scene
        The scene.
    wrt
        Parameter paths; none: of the picture alone.
    max_depth
        Path segments, as for `edgegrad.render`; derivatives have at most two.

    Raises
    ------
    ValueError
        For a wrong scene or path, or one that has no derivative.
    """
    if isinstance(wrt, str):
        raise ValueError("plan: wrt must be a list of parameter paths, not one string")
    max_depth = whole("plan", "max_depth", max_depth, 1, MAX_DERIVATIVE_DEPTH if wrt else MAX_DEPTH)
    scene.validate()
    picture = picture_plan(scene, max_depth)
    if not wrt:
        return Plan(picture, (), ())
    wanted_tables(scene, asked_tables(scene, flatten(scene), wrt), wrt)  # raises for each that has no derivative
    narrow_derivatives.check(wrt)
    moving = [parameters.split(path)[1] for path in wrt if parameters.split(path)[2] == "vertices"]
    placed = dict(zip(scene.meshes, placed_meshes(scene), strict=True))
    edges = {name: _MeshEdges.of(mesh) for name, mesh in placed.items()}
    made = {
        "interior": _interior(scene, wrt, moving, max_depth),
        "primary": _primary(moving, edges),
        "shadow": _shadow(scene, moving, edges, max_depth),
    }
    return Plan(picture, tuple(made[name] for name in TERMS), _missing(scene, placed, moving, max_depth))


@dataclass(frozen=True)
class _MeshEdges:
    """Numbers of a mesh's edges."""

    count: int
    flat: int  # two faces, one plane, one orientation
    flat_seams: int  # of those, between two materials

    @staticmethod
    def of(mesh: Mesh) -> _MeshEdges:
        found = topology.edges(mesh.faces, topology.weld(mesh.vertices))
        first = found.face_first.astype(np.int64)
        pair = np.flatnonzero(np.diff(first) == 2)
        a, b = found.faces[first[pair]], found.faces[first[pair] + 1]
        normal = face_normals(mesh)
        # |n_a - n_b| is the angle between them; face windings decide the orientation.
        flat = np.linalg.norm(normal[a] - normal[b], axis=1) < COPLANAR
        material = np.zeros(len(mesh.faces), np.int32) if mesh.face_material is None else mesh.face_material
        return _MeshEdges(len(found), int(flat.sum()), int((flat & (material[a] != material[b])).sum()))


def _interior(scene: Scene, wrt: Sequence[str], moving: list[str], max_depth: int) -> Term:
    why, computed = [], False
    lit = [name for name in scene.meshes if _reflects(scene, name)]
    for name in moving:
        if max_depth < 2:
            why.append(f"vertices of '{name}': zero, since emission alone does not change as a surface moves")
        elif name in lit:
            computed = True
            why.append(f"vertices of '{name}': its shading changes as it moves and turns")
        elif _emits(scene, name) and lit:
            computed = True
            why.append(f"vertices of '{name}': it only emits, so its own radiance stays; the light it gives changes")
        else:
            what = "emits and lights nothing" if _emits(scene, name) else "is black"
            why.append(f"vertices of '{name}': zero, since it {what}")
    for path in wrt:
        collection, name, fieldname = parameters.split(path)
        if collection == "meshes":
            continue
        users = [mesh for mesh in scene.meshes if name in _used(scene, mesh)]
        if collection == "materials" and not users:
            why.append(f"'{path}': zero, since no face has this material")
        elif max_depth < 2 and (fieldname == "base_color" or collection == "lights"):
            why.append(f"'{path}': zero, since only light seen directly is rendered")
        elif collection == "lights" and not lit:
            why.append(f"'{path}': zero, since every surface is black")
        else:
            computed = True
            why.append(f"'{path}': changes radiance and moves no edge")
    return Term("interior", computed, 0, 0, tuple(why))


def _primary(moving: list[str], edges: dict[str, _MeshEdges]) -> Term:
    total = sum(e.count for e in edges.values())
    if not moving:
        return Term("primary", False, 0, total, ("no vertex is a parameter and the camera stands still",))
    kept = sum(edges[name].count - edges[name].flat + edges[name].flat_seams for name in moving)
    why = [f"moving meshes: {len(moving)} of {len(edges)} ({', '.join(moving)})"]
    still = sum(e.count for name, e in edges.items() if name not in moving)
    if still:
        why.append(f"skipped: {_edges(still)} of meshes that stand still")
    plain = sum(edges[name].flat - edges[name].flat_seams for name in moving)
    if plain:
        why.append(f"skipped: {_edges(plain)} between two faces of one plane and one material, where nothing jumps")
    return Term("primary", kept > 0, kept, total, tuple(why))


def _shadow(scene: Scene, moving: list[str], edges: dict[str, _MeshEdges], max_depth: int) -> Term:
    total = sum(e.count for e in edges.values())
    zero = ""
    if max_depth < 2:
        zero = "only light seen directly is rendered, and it has no shadows"
    elif not moving:
        zero = "no vertex is a parameter and lights stand still: no shadow moves"
    elif not any(_reflects(scene, name) for name in scene.meshes):
        zero = "every surface is black: nothing shows a shadow"
    elif len(scene.meshes) == 1 and convex(next(iter(scene.meshes.values()))):
        zero = f"'{moving[0]}' is alone and convex: it hides no light from itself"
    if zero:
        return Term("shadow", False, 0, total, (zero,))
    kept = total - sum(e.flat for e in edges.values())
    why = ["edges of all meshes, since a shadow also moves over a moving surface when its caster stands still"]
    if total - kept:
        why.append(f"skipped: {_edges(total - kept)} between two faces of one plane, never a silhouette")
    absent = [words for kind, words in _LIGHTS if not any(isinstance(light, kind) for light in scene.lights.values())]
    if not np.any(scene.world.color * scene.world.strength):
        absent.append("environment")
    if not any(_emits(scene, name) for name in scene.meshes):
        absent.append("emissive meshes")
    if absent:
        why.append(f"no shadows of {', '.join(absent)}: there are none")
    return Term("shadow", kept > 0, kept, total, tuple(why))


def _missing(scene: Scene, placed: dict[str, Mesh], moving: list[str], max_depth: int) -> tuple[str, ...]:
    out = [f"for exact derivatives the scene is too rich: {simplified}" for simplified in obstacles(scene)]
    names = list(scene.meshes)
    for k, a in enumerate(names):
        for b in names[k + 1 :]:
            if (a in moving or b in moving) and pierces(placed[a], placed[b]):
                out.append(
                    f"'{a}' and '{b}' may pass through each other: the curve where they do is no edge, "
                    "and what its motion changes is left out"
                )
    if moving and not all(convex(scene.meshes[name]) for name in moving):
        out.append("surfaces that pass through themselves: not looked for, and left out as well")
    if max_depth >= 2 and any(_reflects(scene, name) for name in names):
        out.append("light that surfaces pass on to each other (more than one bounce): neither rendered nor derived")
    return tuple(out)


def _edges(count: int) -> str:
    return f"{count:,} edge{'' if count == 1 else 's'}"


def _used(scene: Scene, mesh_name: str) -> list[str]:
    """Names of the materials that faces of the mesh have."""
    mesh = scene.meshes[mesh_name]
    slots: NDArray[np.int32] | list[int] = [0] if mesh.face_material is None else np.unique(mesh.face_material)
    return [mesh.materials[k] for k in slots]


def _reflects(scene: Scene, mesh_name: str) -> bool:
    return any(np.any(leaf.base_color > 0.0) for name in _used(scene, mesh_name) for leaf in scene.leaves(name))


def _emits(scene: Scene, mesh_name: str) -> bool:
    return any(np.any(leaf.emission > 0.0) for name in _used(scene, mesh_name) for leaf in scene.leaves(name))
