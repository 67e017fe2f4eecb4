"""Translation of materials to closures and their weights."""
