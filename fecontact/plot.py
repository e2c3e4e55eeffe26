"""All plots: each takes what it draws, returns the matplotlib Figure and may write a file."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("fecontact", __file__)
