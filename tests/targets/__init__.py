"""Tests of target pictures."""
