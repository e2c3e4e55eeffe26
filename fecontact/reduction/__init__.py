"""Modal bases: mode shapes, convergence, reports, rows of given degrees of freedom."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
