"""Fitting: losses, optimisers, and the loop that makes a scene match pictures."""
