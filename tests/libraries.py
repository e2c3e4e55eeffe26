"""Libraries of extras that tests use."""

import pytest

from fecontact.core.errors import MissingLibraryError
from fecontact.core.extras import optional


def library(module):
    """A module, imported as fecontact does; what needs it is skipped where it is missing."""
    try:
        return optional(module, "This test")
    except MissingLibraryError as error:
        pytest.skip(str(error), allow_module_level=True)
