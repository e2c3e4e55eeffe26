"""Equilibria, periodic orbits, their stability and bifurcations, followed over parameters."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
