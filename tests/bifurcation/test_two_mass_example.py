"""The example of section 4.4 gives the printed values."""


import numpy as np
import pytest
import two_mass_friction as example

from fecontact import simulate
from fecontact.bifurcation import BranchStatus


def test_table_and_attractors():
    over_B, over_speed = example.diagram_over_B(), example.diagram_over_speed()
    rows = {what: (printed, value) for what, printed, value in example.table(over_B, over_speed)}
    # The first two are printed a little off; the reading of the equations gives 1.1834, 0.8907.
    expected = [1.1834, 0.8907, 7.0865, 8.0922, 9.2619, 9.3651, 9.3876, 7.2487, 3.5731, 4.0868]
    assert [value for _, value in rows.values()] == pytest.approx(expected, abs=6e-5)
    for what, (printed, value) in list(rows.items())[2:]:
        if printed != "chaos":
            assert value == pytest.approx(float(printed), abs=6e-3), what
    # From doubling to doubling the distances shrink by a factor that tends to 4.669.
    doublings = np.array(expected[3:7])
    ratios = np.diff(doublings)[:-1] / np.diff(doublings)[1:]
    assert ratios[-1] == pytest.approx(4.67, abs=0.1)
    motions = dict(example.attractors(3.8, over_speed))
    assert len(motions) == 3
    sizes = sorted(np.ptp(motion[:, 0]) / 2.0 for motion in motions.values())
    assert sizes[0] < 1e-3
    assert sizes[1:] == pytest.approx([7.24, 8.53], abs=0.02)
    # The stable orbits stick: the second mass moves with the belt for part of the time.
    for motion in motions.values():
        if np.ptp(motion[:, 0]) > 1.0:
            assert (np.abs(motion[:, 1] - 3.8) < 0.05).mean() > 0.2


def test_basins_where_three_motions_coexist():
    """Each start ends where a run of its own does: at rest, or with the orbit's amplitude."""
    found, (row, rate) = example.basins_of_attraction(3.8, count=7)
    assert sorted(one.kind for one in found.attractors) == ["equilibrium", "periodic", "periodic"]
    assert sum(one.share for one in found.attractors) == pytest.approx(1.0)
    system = example.oscillator(B=20.0, v0=3.8).system()
    first = example.oscillator().displacement_row(0)
    sliding, = (one.points[0] for one in found.attractors if one.kind == "equilibrium")
    amplitudes = []
    for number, one in enumerate(found.attractors):
        i, k = np.argwhere(found.label == number)[-1]
        # The smallest change of modal coordinates moves one mass alone, as the mass matrix is
        # diagonal.
        change = np.linalg.lstsq(np.array([row, rate]), np.array(
            [found.first[i] - row @ sliding, found.second[k]]), rcond=None)[0]
        assert first @ change == pytest.approx(0.0, abs=1e-12)
        run = simulate(system, 400.0, initial=sliding + change, rtol=1e-8,
                       outputs=np.append(0.0, np.linspace(380.0, 400.0, 2000)))
        amplitudes.append(np.ptp(run.states[1:] @ row) / 2.0)
        assert (one.kind == "equilibrium") == (amplitudes[-1] < 1e-3)
    assert sorted(amplitudes)[1:] == pytest.approx([7.24, 8.53], abs=0.02)


def test_doublings_at_which_the_new_branch_is_strongly_bent():
    """The second branch over v_0 doubles close to its fold; it is left with a shorter step."""
    over_speed = example.diagram_over_speed()
    second = over_speed["second branch"]
    close = second.of_kind("period doubling")[0]
    assert second.of_kind("fold")[0].parameter - close.parameter < 1e-3
    options = example.ContinuationOptions(step=0.005, largest_step=0.04, points=3)
    doubled = example.orbit_branch(example.oscillator(B=20.0, v0=8.0), close, options=options,
                                   bounds=(1.2, 8.0))
    assert len(doubled) == 3
    assert doubled.points[0].values["period"] == pytest.approx(2.0 * close.values["period"],
                                                               rel=1e-2)
    # Subcritical: on the side on which the single orbit is the more stable one.
    assert doubled.parameter.max() < close.parameter
    # Both branches of the diagram end at its bounds.
    assert {branch.status for branch in over_speed.values()} == {BranchStatus.BOUND}
