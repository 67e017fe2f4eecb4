"""Walking through shader nodes: reroutes, muted nodes and node groups are looked through."""

from __future__ import annotations

from typing import Any, NamedTuple

PASSED_THROUGH = 256  # sockets in a row, after which the walk gives up

Groups = tuple[Any, ...]  # group nodes around a node, outermost first


class Feed(NamedTuple):
    """What feeds an input.

    Attributes
    ----------
    output
        The socket of the node that does; None: nothing.
    input
        Without one, the input whose own value counts; None: none does, the value is zero.
    groups
        Group nodes around either of them.
    through
        Types of the sockets between, from the asking input on; each converts the value.
    """

    output: Any
    input: Any
    groups: Groups
    through: tuple[str, ...]


def feed(socket: Any, groups: Groups = ()) -> Feed:
    """What feeds an input socket of a node inside these groups."""
    through: list[str] = []
    for _ in range(PASSED_THROUGH):
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return Feed(None, socket, groups, tuple(through))
        output = link.from_socket
        node = output.node
        if node.type == "REROUTE":
            socket = node.inputs[0]
            continue
        if node.mute:
            # Internal links run from a muted node's input to its output.
            inner = next((pass_.from_socket for pass_ in node.internal_links if pass_.to_socket == output), None)
        elif node.type == "GROUP":
            end = group_output(node)
            inner = None if end is None else by_identifier(end.inputs, output.identifier)
            groups = (*groups, node)
        elif node.type == "GROUP_INPUT" and groups:
            inner = by_identifier(groups[-1].inputs, output.identifier)
            groups = groups[:-1]
        else:
            return Feed(output, None, groups, tuple(through))
        if inner is None:
            return Feed(None, None, groups, tuple(through))
        through.append(output.type)
        socket = inner
    return Feed(None, None, groups, tuple(through))


def group_output(node: Any) -> Any:
    """The node whose inputs are a group node's outputs; None: it has none."""
    if node.node_tree is None:
        return None
    return next((n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None)


def by_identifier(sockets: Any, identifier: str) -> Any:
    """The socket of this identifier, else of this name (identifiers stay when Blender renames sockets)."""
    found = next((s for s in sockets if s.identifier == identifier), None)
    return found if found is not None else next((s for s in sockets if s.name == identifier), None)


def source(socket: Any) -> Any:
    """The output socket that feeds an input of a tree's outermost level; None if there is none."""
    return feed(socket).output


def label(node: Any, groups: Groups = ()) -> str:
    """A node's name with those of the groups around it."""
    return " / ".join([*(group.name for group in groups), node.name])


def own_value_of(socket: Any) -> float | tuple[float, ...]:
    """A socket's own number, vector or colour, whatever is linked to it; zero where it has none."""
    value = getattr(socket, "default_value", 0.0)
    if isinstance(value, (bool, int, float)):
        return float(value)
    return 0.0 if isinstance(value, str) or value is None else tuple(float(c) for c in value)
