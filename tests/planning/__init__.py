"""Tests of plans and of the decisions that they describe."""
