"""The modules that build the site, from docs/site."""

import sys
from importlib import import_module
from pathlib import Path

SITE = Path(__file__).parents[1] / "docs" / "site"


def site_module(name):
    """One of these modules, by name."""
    if str(SITE) not in sys.path:
        sys.path.append(str(SITE))
    return import_module(name)
