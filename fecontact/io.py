"""Files: bases, branches and tables, matrices of other programs, and exports."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("fecontact", __file__)
