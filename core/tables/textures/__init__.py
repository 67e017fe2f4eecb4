"""Expressions as programs of a small machine: the native interpreter runs them at each surface point."""
