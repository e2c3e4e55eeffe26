"""Libraries of extras: what their import leaves behind."""

import numpy as np

from fecontact.core.extras import optional


def test_arrays_are_printed_as_before(tmp_path, monkeypatch):
    """As by pyYeti, whose import sets how NumPy prints for all."""
    (tmp_path / "changes_print.py").write_text(
        "import numpy\nnumpy.set_printoptions(legacy='1.13', precision=3)\n")
    monkeypatch.syspath_prepend(tmp_path)
    before = np.get_printoptions()
    assert optional("changes_print", "This test").numpy is np
    assert np.get_printoptions() == before
    assert str(np.array([0.12, 0.06])) == "[0.12 0.06]"
