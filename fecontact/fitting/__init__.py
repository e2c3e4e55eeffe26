"""Parameters of a model from measurements: least squares, uncertainties, what cannot be found."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
