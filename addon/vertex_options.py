"""What the vertices of objects may do in a fit, in Blender's terms: vertex groups, locked axes, symmetry."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import VertexRules
from edgegrad.fitting.vertices.mirror import partners

from .export.geometry.mesh import positions
from .problem import Problem

AXES = "XYZ"


@dataclass(frozen=True)
class VertexOptions:
    """Options of the vertices of one object; all axes are those of the object.

    Attributes
    ----------
    group
        Name of the vertex group whose weights scale the moves; empty: all vertices move fully.
    locked
        The axes along which vertices keep their places, such as "XZ".
    symmetry
        "X", "Y" or "Z": the shape is mirrored along this axis; empty: sides are independent.
    """

    group: str = ""
    locked: str = ""
    symmetry: str = ""

    def rules(self, ob: Any, frame: NDArray[np.float64]) -> VertexRules | None:
        """Return the rules of a fit; None: there are none.

        Parameters
        ----------
        ob
            The mesh object.
        frame
            (4, 4) transform from the object's space to that of the fitted vertices.

        Raises
        ------
        Problem
            For an unknown group, a group without vertices, and a mesh that is not symmetric; names the object.
        """
        if self == VertexOptions():
            return None
        if set(self.locked) >= set(AXES):
            raise Problem(f"object '{ob.name}': X, Y and Z are locked, so none of its vertices may move; unlock one")
        return VertexRules(
            _weights(ob, self.group) if self.group else None,
            (AXES[0] in self.locked, AXES[1] in self.locked, AXES[2] in self.locked),
            self.symmetry.lower() or None,
            frame,
            _partners(ob, AXES.index(self.symmetry)) if self.symmetry else None,
        )


def _weights(ob: Any, name: str) -> NDArray[np.float64]:
    group = ob.vertex_groups.get(name)
    if group is None:
        known = ", ".join(f"'{one.name}'" for one in ob.vertex_groups) or "none"
        raise Problem(f"object '{ob.name}': has no vertex group '{name}' (it has: {known}); choose one of "
                      "them, or none")  # fmt: skip
    out = np.zeros(len(ob.data.vertices))
    for vertex in ob.data.vertices:
        for one in vertex.groups:
            if one.group == group.index:
                out[vertex.index] = one.weight
    if not out.any():
        raise Problem(f"object '{ob.name}': no vertex has a weight in the vertex group '{name}', so none may move; "
                      "assign vertices to it, or choose another group")  # fmt: skip
    return out


def _partners(ob: Any, axis: int) -> NDArray[np.int64]:
    mesh = ob.data
    found = partners(positions(mesh).astype(np.float64), axis, (polygon.vertices for polygon in mesh.polygons))
    alone = np.flatnonzero(found < 0)
    if len(alone):
        letter = AXES[axis]
        mirror = any(one.type == "MIRROR" and one.show_render for one in ob.modifiers)
        cure = ("its Mirror modifier keeps it symmetric, so switch the symmetry of its vertices off" if mirror
                else "use Mesh > Symmetrize in Edit Mode, or switch the symmetry of its vertices off")  # fmt: skip
        raise Problem(f"object '{ob.name}': is not symmetric: {len(alone):,} of {len(found):,} vertices, such as "
                      f"{alone[0]}, have no partner across {letter}; {cure}")  # fmt: skip
    return found


def add_arguments(fit: argparse.ArgumentParser) -> None:
    """Add the options to a command."""
    fit.add_argument("--vertex-group", metavar="GROUP",
                     help="vertex group whose weights scale the moves of the vertices")  # fmt: skip
    fit.add_argument("--lock", type=_axes, metavar="AXES", help="axes of the object along which vertices stay: XZ")
    fit.add_argument("--symmetry", choices=list(AXES), help="axis of the object along which the shape is mirrored")


def of_arguments(
    arguments: argparse.Namespace, objects: Sequence[str], stored: Mapping[str, VertexOptions]
) -> dict[str, VertexOptions]:
    """Return the options of all objects whose vertices are fitted; what the arguments leave out is as stored.

    Raises
    ------
    Problem
        If there are options and no such object.
    """
    given = {"group": arguments.vertex_group, "locked": arguments.lock, "symmetry": arguments.symmetry}
    given = {name: one for name, one in given.items() if one is not None}
    if given and not objects:
        raise Problem("--vertex-group, --lock and --symmetry need vertices to fit; name an object by --vertices")
    return {name: replace(stored.get(name, VertexOptions()), **given) for name in objects}


def _axes(text: str) -> str:
    if not text or not set(text.upper()) <= set(AXES):
        raise argparse.ArgumentTypeError(f"must be some of X, Y and Z, not '{text}'")
    return text.upper()
