"""The command line ``fecontact``: commands are plain functions, listed in ``app.COMMANDS``."""

import sys
from collections.abc import Sequence


def main() -> None:
    """Run the command line and exit Python with its exit code."""
    try:
        from fecontact.cli.entry import main as run
    except KeyboardInterrupt:
        # Ctrl-C while modules are loaded.
        print("error: interrupted.", file=sys.stderr)
        sys.exit(130)
    run()


def execute(tokens: Sequence[str]) -> int:
    """Run one command line; see :func:`fecontact.cli.entry.execute`."""
    from fecontact.cli.entry import execute as run

    return run(list(tokens))
