"""Tests of the engines: equal bits, instruction sets, updates, limits, loading."""
