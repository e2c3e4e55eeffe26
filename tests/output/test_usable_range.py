"""Tables and plots of frequencies end where the basis ends."""

import numpy as np
import pytest
from systems import beam

from fecontact import simulate
from fecontact.analysis import receptance
from fecontact.bifurcation import equilibrium_branch, vector_field
from fecontact.cli.branch_results import special_table
from fecontact.cli.plot_kinds import PlotRequest, redraw
from fecontact.plot import plot_eigenvalues, plot_receptance
from fecontact.reduction import BasisReport
from fecontact.reduction.report import usable_hz


def test_a_receptance_ends_where_the_basis_is_usable():
    system = beam()
    basis = system.basis
    usable = usable_hz(basis)
    assert usable == pytest.approx(basis.frequencies_hz[-1] / 1.5)
    assert f"up to about {usable:.4g} Hz" in str(BasisReport(basis)) or (
        "too stiff" in str(BasisReport(basis)))
    run = simulate(system, 1e-3, outputs=11)
    figure = redraw(run, "receptance")
    assert figure.axes[0].get_xlim()[1] == pytest.approx(usable, rel=1e-3)
    whole = redraw(run, "receptance", PlotRequest(beyond=True))
    assert whole.axes[0].get_xlim()[1] == pytest.approx(1.2 * basis.frequencies_hz[-1], rel=1e-3)
    legend = [text.get_text() for text in whole.axes[0].get_legend().get_texts()]
    assert "beyond the basis" in legend
    f = np.linspace(10.0, 0.5 * usable, 20)
    below = plot_receptance(receptance(basis, f, [("B", "x")]), usable_hz=usable)
    assert below.axes[0].get_legend() is None


def test_special_points_beyond_the_basis_are_marked():
    """A Hopf point at 1 rad/s, z' = (r + i - |z|^2) z."""
    def form(t, x, p, out):
        size = x[0] * x[0] + x[1] * x[1]
        out[0] = (p[0] - size) * x[0] - x[1]
        out[1] = x[0] + (p[0] - size) * x[1]

    branch = equilibrium_branch(vector_field(form, {"r": -0.5}, 2), parameter="r",
                                bounds=(-1.0, 1.0))
    hertz = branch.of_kind("Hopf")[0].frequency_hz
    assert hertz == pytest.approx(0.5 / np.pi)

    def remarks(usable):
        return " ".join(map(str, special_table(branch, usable).columns[-1].cells))

    assert "beyond 0.1 Hz, where the basis ends" in remarks(0.1)
    assert "beyond" not in remarks(1.0)
    assert not plot_eigenvalues(branch, range_hz=(0.0, 0.1)).axes[0].texts
    assert plot_eigenvalues(branch).axes[0].texts
