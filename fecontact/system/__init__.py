"""Contact systems: states at rest, histories of loading, prescribed motion, arrays of kernels."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
