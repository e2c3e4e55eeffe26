"""Parameter sweeps of a study: cases, execution on many cores, storage, results as a table."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
