"""Tests of fits, losses and optimisers."""
