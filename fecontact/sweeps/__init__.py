"""Many cases of one study: which ones, run by any executor, kept in a folder, as one table."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
