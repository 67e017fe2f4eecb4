"""Fitting: losses, optimisers, and the loop that changes a scene until its pictures match target pictures."""
