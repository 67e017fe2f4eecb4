"""Edgegrad's tests."""
