"""Finite elements: kinds of cells, shape functions, geometry of straight and curved cells."""
