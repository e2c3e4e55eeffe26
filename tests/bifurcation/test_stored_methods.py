"""Options of the methods of periodic orbits as texts for files."""

import numpy as np
import pytest

from fecontact import InputError
from fecontact.bifurcation import Collocation, HarmonicBalance, Shooting
from fecontact.bifurcation.stored_methods import method_from_text, method_text
from fecontact.integrate import Radau, SetValued


@pytest.mark.parametrize("method", [
    Collocation(7, 3, 1e-6, 90, None), Collocation(np.int64(12), state_tolerance=2e-4),
    Shooting(3, 1e-8, 1e-2), Shooting(2, solver=Radau()),
    Shooting(1, solver=SetValued(restitution=0.4)),
    HarmonicBalance(11, 64, 1e-4, 40, None, 3e-3), HarmonicBalance([1, 3, 5])])
def test_methods_are_stored_with_all_their_options(method):
    assert method_from_text(method_text(method)) == method


@pytest.mark.parametrize("text", ["", "3", "[]", "{}", '{"name": "guess"}', '{"name": []}',
                                  '{"name": "shooting", "segments": 0}',
                                  '{"name": "shooting", "solver": {"name": "none"}}',
                                  '{"name": "shooting", "solver": 3}'])
def test_texts_that_are_no_methods_are_refused(text):
    with pytest.raises(InputError):
        method_from_text(text)
