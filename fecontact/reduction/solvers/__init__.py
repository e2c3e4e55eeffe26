"""Solvers for modes and deflections: factors, and multigrid for large solids."""
