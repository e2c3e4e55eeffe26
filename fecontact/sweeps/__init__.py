"""Parameter sweeps of a study: cases, execution on many cores, storage, results as a table."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
