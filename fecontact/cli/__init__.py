"""The command line ``fecontact``: commands are plain functions, listed in :mod:`fecontact.cli.app`."""

from fecontact.cli.entry import execute, main

__all__ = ["execute", "main"]
