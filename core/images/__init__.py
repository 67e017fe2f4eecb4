"""Image files: conversion of OpenEXR, PNG and JPEG to and from linear Rec.709 arrays, and pictures of derivatives."""

from .derivative_picture import derivative_image, write_derivative
from .files import READABLE, WRITABLE, linear_to_srgb, read_image, srgb_to_linear, write_image

__all__ = [
    "READABLE",
    "WRITABLE",
    "derivative_image",
    "linear_to_srgb",
    "read_image",
    "srgb_to_linear",
    "write_derivative",
    "write_image",
]
