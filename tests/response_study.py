"""A block held by friction with memory, driven through a spring: a study with a response."""

from fecontact import Study

STUDY = """
geometry = { shape = "block", contact_length = 0.08, element_size = 0.02 }
body = { material = "steel", thickness = 0.1 }
basis = { modes = 3, select = [0, 1], contact_nodes = 1, B = "B", C = "top" }
normal = { law = "linear", stiffness = 10e6, damping = 40.0 }
friction = { law = "jenkins", stiffness = 2e4, friction_coefficient = 0.4 }
load = { normal = 14.0 }
drive = { stiffness_x = 5610.0, damping_x = 30.0, amplitude_x = 1e-4, frequency_hz = 7.95775 }

[response]
bounds = [8.0, 13.0]
levels = { "drive.amplitude_x" = [2e-5, 3e-4] }
harmonics = 3
samples = 128
largest_step = 0.1
"""


def linear_amplitude(w, amplitude, study):
    """Amplitude of the stuck block [m]: m x'' + b x' + (c + k) x = c x_0 sin w t."""
    mass = 1.0 / study.modal_basis().T[0, 0, 0] ** 2
    return 5610.0 * amplitude / abs(5610.0 + 2e4 - mass * w**2 + 30.0j * w)


def study():
    return Study.from_toml(STUDY)
