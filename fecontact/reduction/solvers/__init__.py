"""Iterative solvers for the vibration modes and deflections of large solids."""
