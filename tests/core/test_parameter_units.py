"""Labels of parameters, with the units that the docstrings of their classes name."""

import pytest

from fecontact.system.parameter_labels import parameter_label


@pytest.mark.parametrize(("name", "label"), [
    ("ground.speed", "ground speed [m/s]"),
    ("ground.profile.amplitude", "ground profile amplitude [m]"),
    ("drive.angular_frequency", "drive angular frequency [rad/s]"),
    ("contact.SOLE.friction.smoothing_slope", "SOLE friction smoothing slope [s/m]"),
    ("normal.roughness_height", "normal roughness height [m]"),
    ("load.normal", "load normal [N]"),
    ("gap", "gap [m]"),
    # The laws do not agree: N/m of rough surfaces, N/m^n of powers.
    ("normal.stiffness", "normal stiffness"),
    ("friction.friction_coefficient", "friction coefficient"),
    ("B", "B"),
])
def test_labels(name, label):
    assert parameter_label(name) == label
