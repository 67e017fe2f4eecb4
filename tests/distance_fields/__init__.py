"""Tests of distance fields."""
