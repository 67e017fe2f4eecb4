"""Translation of the nodes of worlds and lights, which rays of one kind see: Light Path nodes are constants then."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from edgegrad import expression as e

from .expressions import Reader
from .images import Images
from .links import Groups, label

# Outputs of a Light Path node that are not 0, by the kind of the ray that arrives.
LIGHT_PATHS: Mapping[str, Mapping[str, float]] = {
    "camera": {"Is Camera Ray": 1.0},
    "diffuse": {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0},
    "glossy": {"Is Glossy Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Glossy Depth": 1.0},
    "transmission": {"Is Transmission Ray": 1.0, "Ray Depth": 1.0, "Transmission Depth": 1.0},
}
# Cycles evaluates lights at points that it samples on them; such a ray is of no kind.
SAMPLED: Mapping[str, float] = {"Ray Depth": 1.0}
APPROXIMATE = ("Ray Length", "Ray Depth", "Diffuse Depth", "Glossy Depth", "Transmission Depth", "Transparent Depth")


class RayReader(Reader):
    """A `Reader` for rays for which the outputs of Light Path nodes have the values of `path`, and else 0.

    Attributes
    ----------
    approximations
        One short text for each output that is not the same for all rays of the kind.
    """

    def __init__(self, images: Images | None, path: Mapping[str, float]) -> None:
        super().__init__(images)
        self.path = path
        self.approximations: dict[str, None] = {}

    def _read(self, output: Any, groups: Groups) -> e.Operand:
        if output.node.type != "LIGHT_PATH":
            return super()._read(output, groups)
        value = self.path.get(output.identifier, 0.0)
        if output.identifier in APPROXIMATE:
            self.approximations[f"'{output.identifier}' of node '{label(output.node, groups)}' is replaced by "
                                f"{value:g}"] = None  # fmt: skip
        return value
