"""Tests of the boundary terms."""
