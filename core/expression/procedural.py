"""Procedural textures (Blender's Texture nodes): expressions without an image or a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .nodes import Expression, Operand

GRADIENTS = ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "RADIAL", "QUADRATIC_SPHERE", "SPHERICAL")
NOISES = ("FBM", "MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "HETERO_TERRAIN")
DIMENSIONS = ("1D", "2D", "3D", "4D")
VORONOI_FEATURES = ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS")
VORONOI_METRICS = ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI")


@dataclass(frozen=True)
class Checker(Expression):
    """A 3D checkerboard of two colours. Blender's Fac output is this node with the colours 1 and 0."""

    vector: Operand
    color1: Operand = 1.0
    color2: Operand = 0.0
    scale: Operand = 5.0


@dataclass(frozen=True)
class Gradient(Expression):
    """A number in [0, 1] that grows with the position.

    Attributes
    ----------
    kind
        One of `GRADIENTS`, in Blender's names.
    """

    vector: Operand
    kind: str = "LINEAR"
    choices: ClassVar = {"kind": GRADIENTS}


@dataclass(frozen=True)
class WhiteNoise(Expression):
    """A random number or colour in [0, 1] for each value of the coordinates.

    Attributes
    ----------
    w
        The only coordinate in 1D, the fourth coordinate in 4D.
    output
        ``"VALUE"`` or ``"COLOR"``.
    """

    vector: Operand = 0.0
    w: Operand = 0.0
    dimensions: str = "3D"
    output: str = "VALUE"
    choices: ClassVar = {"dimensions": DIMENSIONS, "output": ("VALUE", "COLOR")}


@dataclass(frozen=True)
class Noise(Expression):
    """Fractal Perlin noise.

    Attributes
    ----------
    w
        The only coordinate in 1D, the fourth coordinate in 4D.
    kind
        One of `NOISES`.
    normalize
        Whether the range of FBM is mapped to [0, 1].
    output
        ``"FAC"`` (a number) or ``"COLOR"``.
    """

    vector: Operand = 0.0
    w: Operand = 0.0
    scale: Operand = 5.0
    detail: Operand = 2.0
    roughness: Operand = 0.5
    lacunarity: Operand = 2.0
    distortion: Operand = 0.0
    offset: Operand = 0.0
    gain: Operand = 1.0
    dimensions: str = "3D"
    kind: str = "FBM"
    normalize: bool = True
    output: str = "FAC"
    choices: ClassVar = {"dimensions": DIMENSIONS, "kind": NOISES, "output": ("FAC", "COLOR")}


@dataclass(frozen=True)
class Voronoi(Expression):
    """Distances, colours and positions of the cells around random points (Worley noise).

    Attributes
    ----------
    feature
        One of `VORONOI_FEATURES`.
    metric
        One of `VORONOI_METRICS`; only MINKOWSKI uses `exponent`.
    output
        ``"DISTANCE"`` (also for DISTANCE_TO_EDGE), ``"COLOR"``, ``"POSITION"``, ``"W"``, or ``"RADIUS"`` (only for
        N_SPHERE_RADIUS).
    """

    vector: Operand = 0.0
    w: Operand = 0.0
    scale: Operand = 5.0
    detail: Operand = 0.0
    roughness: Operand = 0.5
    lacunarity: Operand = 2.0
    smoothness: Operand = 1.0
    exponent: Operand = 0.5
    randomness: Operand = 1.0
    dimensions: str = "3D"
    feature: str = "F1"
    metric: str = "EUCLIDEAN"
    normalize: bool = False
    output: str = "DISTANCE"
    choices: ClassVar = {"dimensions": DIMENSIONS, "feature": VORONOI_FEATURES, "metric": VORONOI_METRICS,
                         "output": ("DISTANCE", "COLOR", "POSITION", "W", "RADIUS")}


@dataclass(frozen=True)
class Wave(Expression):
    """Bands or rings in [0, 1].

    Attributes
    ----------
    kind
        ``"BANDS"`` or ``"RINGS"``.
    direction
        ``"X"``, ``"Y"``, ``"Z"``, ``"DIAGONAL"`` (bands) or ``"SPHERICAL"`` (rings).
    profile
        ``"SIN"``, ``"SAW"`` or ``"TRI"``.
    """

    vector: Operand
    scale: Operand = 5.0
    distortion: Operand = 0.0
    detail: Operand = 2.0
    detail_scale: Operand = 1.0
    detail_roughness: Operand = 0.5
    phase: Operand = 0.0
    kind: str = "BANDS"
    direction: str = "X"
    profile: str = "SIN"
    choices: ClassVar = {"kind": ("BANDS", "RINGS"), "direction": ("X", "Y", "Z", "DIAGONAL", "SPHERICAL"),
                         "profile": ("SIN", "SAW", "TRI")}

    def __post_init__(self) -> None:
        super().__post_init__()
        wrong = "SPHERICAL" if self.kind == "BANDS" else "DIAGONAL"
        if self.direction == wrong:
            raise ValueError(f"expression Wave: direction must not be {wrong} for {self.kind}")


@dataclass(frozen=True)
class Magic(Expression):
    """Blender's Magic texture, a colour; the Fac output of the node is its `Average`.

    Attributes
    ----------
    depth
        Iterations, 0 to 10.
    """

    vector: Operand
    scale: Operand = 5.0
    distortion: Operand = 1.0
    depth: int = 2


@dataclass(frozen=True)
class Brick(Expression):
    """A wall of bricks.

    Attributes
    ----------
    output
        ``"COLOR"`` or ``"FAC"`` (1 in the mortar).
    offset_frequency, squash_frequency
        Every n-th row is shifted by `offset`, or its bricks' width is multiplied by `squash`; >= 1.
    """

    vector: Operand
    color1: Operand = 0.8
    color2: Operand = 0.2
    mortar: Operand = 0.0
    scale: Operand = 5.0
    mortar_size: Operand = 0.02
    mortar_smooth: Operand = 0.1
    bias: Operand = 0.0
    brick_width: Operand = 0.5
    row_height: Operand = 0.25
    offset: float = 0.5
    offset_frequency: int = 2
    squash: float = 1.0
    squash_frequency: int = 2
    output: str = "COLOR"
    choices: ClassVar = {"output": ("COLOR", "FAC")}
