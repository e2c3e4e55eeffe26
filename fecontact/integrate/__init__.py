"""Solvers and what goes with them: events, ensembles, initial states, sensitivities."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
