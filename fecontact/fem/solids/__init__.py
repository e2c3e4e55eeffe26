"""Solids described by their dimensions, and their meshes."""
