"""Distance fields: from meshes and to meshes, made true distances again, and measures of their smoothness."""
