"""Files: bases, branches and tables, matrices of other programs, and exports."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
