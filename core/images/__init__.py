"""Image files: conversion of OpenEXR, PNG, JPEG and TIFF to and from linear light, and derivatives as pictures."""

from .derivative_picture import derivative_image, labelled_derivative, write_derivative
from .files import READABLE, WRITABLE, image_size, read_image, write_image
from .resampling import resample, same_aspect
from .srgb import linear_to_srgb, srgb_to_linear
from .targets import TargetPicture, made_by_blender, mask_of, read_mask, read_target, target_of_codes
from .view_transform import ViewTransform

__all__ = [
    "READABLE",
    "WRITABLE",
    "TargetPicture",
    "ViewTransform",
    "derivative_image",
    "image_size",
    "labelled_derivative",
    "linear_to_srgb",
    "made_by_blender",
    "mask_of",
    "read_image",
    "read_mask",
    "read_target",
    "resample",
    "same_aspect",
    "srgb_to_linear",
    "target_of_codes",
    "write_derivative",
    "write_image",
]
