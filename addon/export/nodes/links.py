"""Traversal of shader node links; reroutes, muted nodes and node groups are followed to the actual source."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import bpy

# Nodes that Cycles does not have, among them those of add-ons. It ignores their links, so that a linked input keeps its
# own value.
NOT_IN_CYCLES = ("SHADERTORGB", "UVALONGSTROKE", "SQUEEZE", "CUSTOM", "UNDEFINED")
# Nodes that Blender 5 computes itself if all their inputs are constant. Cycles gets the number in their place.
COMPUTED_BY_BLENDER = frozenset((
    "BLACKBODY", "CLAMP", "COMBXYZ", "CURVE_FLOAT", "CURVE_RGB", "CURVE_VEC", "GAMMA", "MAP_RANGE", "MATH", "MIX",
    "MIX_RGB", "SEPXYZ", "TEX_BRICK", "TEX_CHECKER", "TEX_GABOR", "TEX_GRADIENT", "TEX_MAGIC", "TEX_NOISE",
    "TEX_VORONOI", "TEX_WAVE", "TEX_WHITE_NOISE", "VALTORGB", "VALUE", "VECTOR_ROTATE", "VECT_MATH",
))  # fmt: skip
PASSED_THROUGH = 256  # largest number of reroutes, muted nodes and groups that are followed

Groups = tuple[Any, ...]  # group nodes around a node, outermost first


class Feed(NamedTuple):
    """Source of the value of an input.

    Attributes
    ----------
    output
        Output socket that is linked to the input; None: there is none.
    input
        Without `output`: input socket whose own value is used; None: the value is zero.
    groups
        Group nodes around this socket, outermost first.
    through
        Types of the sockets on the way, starting at the requested input; each of them converts the value.
    """

    output: Any
    input: Any
    groups: Groups
    through: tuple[str, ...]


def feed(socket: Any, groups: Groups = ()) -> Feed:
    """Find the source of an input socket of a node inside these groups."""
    through: list[str] = []
    # The input whose own value is used if only reroutes and muted nodes lie before it, and what was known there.
    own = Feed(None, socket, groups, ())
    for _ in range(PASSED_THROUGH):
        link = next((link for link in socket.links if _is_used(link)), None)
        if link is None:
            return own
        output = link.from_socket
        node = output.node
        if node.type == "REROUTE":
            socket = node.inputs[0]
            continue
        if node.mute:
            # Internal links connect inputs of a muted node to its outputs.
            inner = next((pass_.from_socket for pass_ in node.internal_links if pass_.to_socket == output), None)
            if inner is None:
                return own
            through.append(output.type)
            socket = inner
            continue
        if node.type == "GROUP":
            end = group_output(node)
            inner = None if end is None else by_identifier(end.inputs, output.identifier)
            groups = (*groups, node)
        elif node.type == "GROUP_INPUT" and groups:
            inner = by_identifier(groups[-1].inputs, output.identifier)
            groups = groups[:-1]
        elif node.type == "MENU_SWITCH" and output == node.outputs[0]:
            chosen = getattr(feed(node.inputs[0], groups).input, "default_value", "")
            inner = next((one for one in node.inputs[1:] if one.name == chosen), None)
        else:
            return Feed(output, None, groups, tuple(through))
        if inner is None:
            return Feed(None, None, groups, tuple(through))
        through.append(output.type)
        socket = inner
        own = Feed(None, socket, groups, tuple(through))
    return Feed(None, None, groups, tuple(through))


def _is_used(link: Any) -> bool:
    """Whether Cycles follows a link. It ignores shaders that are linked to values, and sockets that a node hides."""
    unknown = link.from_node.type in NOT_IN_CYCLES or link.from_node.bl_idname == "NodeUndefined"
    mixed = link.from_socket.type == "SHADER" and link.to_socket.type != "SHADER"
    hidden = link.from_socket.is_unavailable or link.to_socket.is_unavailable
    return bool(link.is_valid and not link.is_muted and not unknown and not mixed and not hidden)


def is_implicit(socket: Any, found: Feed) -> bool:
    """Whether an input without a value, as Normal, keeps its default: the shading normal, or texture coordinates.

    Parameters
    ----------
    socket, found
        The input, and its source.
    """
    if found.output is not None or found.input is None:
        return False
    if found.input == socket:
        return True
    if bpy.app.version < (5, 0, 0):  # Cycles drops any value of a group that is not linked
        return True
    return bool(found.input.hide_value and all(kind == socket.type for kind in found.through))


def is_computed_by_blender(node: Any, groups: Groups) -> bool:
    """Whether Blender replaces a node by the constants that its outputs have, before Cycles sees it."""
    todo, seen = [(node, groups)], set()
    while todo:
        node, groups = todo.pop()
        if node.type not in COMPUTED_BY_BLENDER:
            return False
        for socket in node.inputs:
            if (node, groups, socket) in seen or not socket.enabled or socket.is_unavailable:
                continue
            seen.add((node, groups, socket))
            found = feed(socket, groups)
            if found.output is not None:
                todo.append((found.output.node, found.groups))
            elif found.input == socket and socket.hide_value and node.type.startswith("TEX_"):
                return False  # texture coordinates
    return True


def upstream(node: Any, groups: Groups) -> Iterator[tuple[Any, Groups]]:
    """Yield the outputs that a node depends on, each with the groups around it."""
    todo, seen = [(node, groups)], set()
    while todo:
        node, groups = todo.pop()
        for socket in node.inputs:
            found = feed(socket, groups)
            if found.output is None or (found.output, found.groups) in seen:
                continue
            seen.add((found.output, found.groups))
            yield found.output, found.groups
            todo.append((found.output.node, found.groups))


def group_output(node: Any) -> Any:
    """Return the node whose inputs are the outputs of a group node; None if there is none."""
    if node.node_tree is None:
        return None
    return next((n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None)


def by_identifier(sockets: Any, identifier: str) -> Any:
    """Return the socket of this identifier, else of this name (Blender versions rename sockets, not identifiers)."""
    found = next((s for s in sockets if s.identifier == identifier), None)
    return found if found is not None else next((s for s in sockets if s.name == identifier), None)


def source(socket: Any) -> Any:
    """Return the output socket that is linked to an input at the outermost level of a tree; None if there is none."""
    return feed(socket).output


def reached(tree: Any) -> Iterator[Any]:
    """Yield the nodes of a tree, and of the groups in it, that are not muted."""
    for node in tree.nodes:
        if not node.mute:
            yield node
            if node.type == "GROUP" and node.node_tree is not None:
                yield from reached(node.node_tree)


def label(node: Any, groups: Groups = ()) -> str:
    """Return the name of a node, preceded by the names of the groups around it."""
    return " / ".join([*(group.name for group in groups), node.name])


def own_value_of(socket: Any) -> float | tuple[float, ...]:
    """Return the value that is set at a socket, even if it is linked; zero for a socket without a value."""
    value = getattr(socket, "default_value", 0.0)
    if isinstance(value, (bool, int, float)):
        return float(value)
    return 0.0 if isinstance(value, str) or value is None else tuple(float(c) for c in value)
