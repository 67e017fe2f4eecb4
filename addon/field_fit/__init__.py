"""Fit of an object as a distance field, whose topology may change."""

from .replacement import FieldRequest, Replacement, replace_by_field

__all__ = ["FieldRequest", "Replacement", "replace_by_field"]
