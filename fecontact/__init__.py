"""fecontact: elastic bodies in contact with friction."""

__version__ = "0.1.0"
