"""The command line ``fecontact``: commands are plain functions, listed in ``app.COMMANDS``."""

from fecontact.cli.entry import execute, main

__all__ = ["execute", "main"]
