"""Equilibria, periodic orbits, their stability and bifurcations, followed over parameters."""
