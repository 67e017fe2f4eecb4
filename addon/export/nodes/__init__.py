"""Translation of node trees to expressions: links, values, colours, textures, normals and images."""
