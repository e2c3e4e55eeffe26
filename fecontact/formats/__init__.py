"""Mesh file formats that are read without meshio, and what all readers hand on."""
