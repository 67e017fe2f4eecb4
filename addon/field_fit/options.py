"""The options of a fit as a field on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from ..problem import Problem
from .fitted_values import WORDS
from .replacement import FieldRequest

# Numbers of cells that fields may have along their longest side.
RESOLUTIONS = (16, 512)


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """Return the type of whole numbers from `least` to `most`; None: without an end."""
    allowed = f"{least} or more" if most is None else f"{least} to {most}"

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"must be a whole number, {allowed}, not '{text}'") from None
        if value < least or (most is not None and value > most):
            raise argparse.ArgumentTypeError(f"must be {allowed}, not {value}")
        return value

    return read


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options to a subcommand."""
    parser.add_argument("--field", metavar="OBJECT",
                        help="fit this object as a distance field, whose topology may change; an empty that shows a "
                        "cube is a box in which the shape begins as a ball")  # fmt: skip
    parser.add_argument("--resolution", type=whole(*RESOLUTIONS), metavar="N",
                        help="cells of the field along its longest side (default: 64)")  # fmt: skip
    parser.add_argument("--field-start", choices=["shape", "ball"], help="begin with the shape of the object (default) "
                        "or with a ball in its bounding box")  # fmt: skip
    parser.add_argument("--field-values", nargs="+", choices=list(WORDS.values()), metavar="VALUE",
                        help=f"values of the field's material to fit too, where they vary: {', '.join(WORDS.values())}")


def field_request(arguments: argparse.Namespace) -> FieldRequest | None:
    """Return what the options ask for; None: no field.

    Raises
    ------
    Problem
        If they contradict each other.
    """
    if arguments.field is None:
        for option in ("resolution", "field_start", "field_values"):
            if getattr(arguments, option) is not None:
                raise Problem(f"--{option.replace('_', '-')}: there is no --field; name the object to fit as a field")
        return None
    if arguments.field in arguments.vertices:
        raise Problem(f"object '{arguments.field}': is named by --field and --vertices; leave one of them out")
    values = tuple(key for key, word in WORDS.items() if word in (arguments.field_values or ()))
    return FieldRequest(arguments.field, arguments.resolution or 64, (arguments.field_start or "shape").upper(), values)
