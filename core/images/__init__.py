"""Image files: conversion of OpenEXR, PNG, JPEG and TIFF to and from linear light, and derivatives as pictures."""

from .derivative_picture import derivative_image, labelled_derivative, write_derivative
from .files import READABLE, WRITABLE, read_image, write_image
from .srgb import linear_to_srgb, srgb_to_linear
from .targets import TargetPicture, made_by_blender, read_target
from .view_transform import ViewTransform

__all__ = [
    "READABLE",
    "WRITABLE",
    "TargetPicture",
    "ViewTransform",
    "derivative_image",
    "labelled_derivative",
    "linear_to_srgb",
    "made_by_blender",
    "read_image",
    "read_target",
    "srgb_to_linear",
    "write_derivative",
    "write_image",
]
