"""Copies of the node trees of a baked material, which may be changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..nodes.constants import Place, Values
from ..nodes.links import by_identifier


class Trees:
    """The node tree of a copied material, and copies of its groups, each made once.

    Parameters
    ----------
    keep
        Owns the copies (`bake.Temporary`).
    """

    def __init__(self, material: Any, keep: Any) -> None:
        self._root = material.node_tree
        self._keep = keep
        self._own: set[tuple[str, ...]] = set()

    def around(self, groups: tuple[str, ...]) -> Iterator[tuple[Any, Any]]:
        """Yield the group nodes on the way to a node with these groups around it, each after its tree."""
        tree = self._root
        for depth, name in enumerate(groups, 1):
            node = tree.nodes[name]
            if groups[:depth] not in self._own:
                node.node_tree = self._keep(node.node_tree.copy())
                self._own.add(groups[:depth])
            yield tree, node
            tree = node.node_tree

    def inside(self, groups: tuple[str, ...]) -> Any:
        """Return the tree of a node with these groups around it."""
        tree = self._root
        for _, node in self.around(groups):
            tree = node.node_tree
        return tree


def insert(values: Mapping[Place, Values], trees: Trees) -> None:
    """Link constants to all that reads these outputs in the copies of trees."""
    for (groups, name, identifier), value in values.items():
        tree = trees.inside(groups)
        output = by_identifier(tree.nodes[name].outputs, identifier)
        targets = [link.to_socket for link in output.links]
        if not targets:
            continue
        kind = {"RGBA": "ShaderNodeRGB", "VECTOR": "ShaderNodeCombineXYZ"}.get(output.type, "ShaderNodeValue")
        node = tree.nodes.new(kind)
        if output.type == "VECTOR":
            for socket, number in zip(node.inputs, value, strict=False):
                socket.default_value = number
        else:
            node.outputs[0].default_value = (*value[:3], 1.0) if output.type == "RGBA" else value[0]
        for socket in targets:
            tree.links.new(node.outputs[0], socket)
