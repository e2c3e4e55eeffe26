"""Laws of contact and friction, profiles and motions of the ground, signals, laws of your own."""

from fecontact.core.namespace import namespace

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
