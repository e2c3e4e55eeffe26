"""Elastic half-spaces in contact: influence coefficients, pressures, friction."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
