"""What a fit has found, and how well it knows it."""
