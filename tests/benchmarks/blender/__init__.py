"""Benchmarks of the add-on."""
