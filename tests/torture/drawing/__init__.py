"""Parts of random scenes, each drawn from a seed."""
