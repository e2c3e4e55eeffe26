"""Elastic bodies beside closed forms: Hertz, a patch test, waves in bars, slip damping."""

from dataclasses import replace

import clamped_layers
import colliding_bars
import numpy as np
import pytest
import stacked_blocks
import two_bodies
from two_bodies import ALUMINIUM, STEEL

from fecontact import LoadPath, load_history
from fecontact.laws import LinearContact
from fecontact.system.quasistatic.sliders import sliders_of


@pytest.mark.parametrize("block", [STEEL, ALUMINIUM], ids=["steel", "aluminium"])
def test_pressure_of_a_cylinder_on_a_block_is_that_of_hertz(block):
    """Six elements per half-width: to 0.2 %."""
    found = two_bodies.pressed(STEEL, block, 6)
    assert found.found_peak_and_width == pytest.approx((found.peak, found.half_width), rel=2e-3)


def test_half_widths_are_those_of_the_tables():
    """E* of two equal bodies is half of that on a rigid plane: b grows by sqrt(2)."""
    b, peak = two_bodies.hertz(STEEL, STEEL)
    assert b == pytest.approx(np.sqrt(2.0) * 5.252319e-4, rel=1e-6)
    assert peak == pytest.approx(1.2120737e9 / np.sqrt(2.0), rel=1e-6)


def test_a_strip_sticks_under_half_of_the_limiting_force():
    """Cattaneo: c / b = sqrt(1 - Q / (mu P)), found to 1 % by its ends and its middle."""
    found = two_bodies.sheared(8)
    assert found.sticking_part == pytest.approx(np.sqrt(0.5), rel=0.01)
    middle = np.abs(found.shear[np.argmin(np.abs(found.x))])
    assert middle == pytest.approx(two_bodies.MU * found.peak * (1.0 - np.sqrt(0.5)), rel=0.01)


@pytest.mark.parametrize(("above", "below", "nodes", "error"), [
    ((8, 3), (8, 4), "all", 1e-11), ((9, 3), (6, 3), 5, 1e-11), ((8, 3), (6, 3), "all", 0.03)])
def test_uniform_pressure_passes_through_both_blocks(above, below, nodes, error):
    """To round-off where meshes match, or on fewer segments than elements; 3 % at nodes else."""
    found = stacked_blocks.pressed(above, below, nodes)
    assert found.stress_error < error
    assert error < 0.01 or found.stress_error > 0.01
    total = stacked_blocks.PRESSURE * stacked_blocks.WIDTH * 0.02
    assert found.force.sum() == pytest.approx(total, rel=1e-12)
    # Action equals reaction: what the contact does on each body, as a force on all its mass.
    basis = found.system.basis
    on_modes = basis.contact_T[:, 1].T @ found.force
    fields = basis.mode_shapes.restriction.tocsr()
    on_nodes = (fields[3 * (2 + np.arange(len(found.force))) + 1].T @ found.force).reshape(-1, 2)
    upper, lower = (on_nodes[part.nodes[0] : sum(part.nodes)].sum(axis=0) for part in basis.parts)
    assert upper == pytest.approx((0.0, total), abs=1e-12 * total)
    assert lower == pytest.approx(-upper, abs=1e-12 * total)
    assert on_modes == pytest.approx(np.einsum("nij,ni->j", basis.mode_shapes.shapes, on_nodes),
                                     abs=1e-9 * np.abs(on_modes).max())


@pytest.mark.parametrize("second", [1.0, 2.0])
def test_bars_part_as_their_waves_say(second):
    """Restitution to 0.2 %, contact time to 0.1 %; momentum to round-off, energy to 1e-8."""
    found = colliding_bars.collision(second, 30)
    restitution, duration = colliding_bars.closed_form(found)
    assert found.restitution == pytest.approx(restitution, rel=2e-3)
    if duration is None:
        # 2 T, within the noise of the truncated series: the long bar's wave separates them.
        assert found.momenta[-1] == pytest.approx((-0.02, 1.02), abs=2e-3)
    else:
        assert found.contact_time == pytest.approx(duration, rel=1e-3)
        assert found.momenta[-1] == pytest.approx((0.0, 1.0), abs=2e-3)
    assert found.momenta.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert found.run.energies.imbalance < 1e-8


def test_the_force_between_bars_is_half_of_their_impedance_times_speed():
    """The mean force is the momentum (1 + e) / 2 over the contact time."""
    found = colliding_bars.collision(1.0, 30)
    restitution, duration = colliding_bars.closed_form(found)
    period = 2.0 * colliding_bars.LENGTH / colliding_bars.WAVE_SPEED
    touching = found.run.time < found.contact_time
    assert found.force[touching].mean() == pytest.approx(
        0.5 * (1.0 + restitution) * period / duration, rel=3e-3)


@pytest.fixture(scope="module")
def layers():
    return clamped_layers.layers()


@pytest.mark.parametrize("part", [0.1, 0.375, 0.6, 0.7])
def test_loss_between_clamped_layers_is_that_of_slip_theory(layers, part):
    """Over the pressure, with its maximum at 3/8; slip theory of beams to 0.3 %."""
    history = clamped_layers.cycle(layers, part * clamped_layers.END_LOAD, 40)
    wanted = clamped_layers.slip_theory(part * clamped_layers.END_LOAD)
    assert clamped_layers.loss(history) == pytest.approx(wanted, rel=3e-3)
    areas = sum(history.loop(1, -1, f"{name}.end.y").area for name in ("upper", "lower"))
    assert areas == pytest.approx(wanted, rel=5e-3)


def test_layers_do_not_slip_under_enough_pressure(layers):
    """Slip begins at P = 4/3 mu p b h."""
    history = clamped_layers.cycle(layers, 0.78 * clamped_layers.END_LOAD)
    most = float(clamped_layers.slip_theory(0.375 * clamped_layers.END_LOAD))
    assert clamped_layers.loss(history) < 1e-3 * most


def test_the_maximum_of_the_loss_is_where_slip_theory_has_it():
    L, h, b = clamped_layers.LENGTH, clamped_layers.HEIGHT, clamped_layers.WIDTH
    P, E = clamped_layers.END_LOAD, STEEL.youngs_modulus
    best = 1.5 * P**2 * L**3 / (E * b * h**3)
    limits = np.linspace(0.0, P, 4001)
    losses = clamped_layers.slip_theory(limits)
    assert losses.max() == pytest.approx(best, rel=1e-6)
    assert limits[np.argmax(losses)] == pytest.approx(0.375 * P, rel=1e-9)


def test_contact_nodes_on_supports_stick_rigidly():
    """The node at the clamp moves in no mode: its penalty is finite all the same."""
    system = clamped_layers.layers(10, "all")
    assert not system.basis.contact_T[0, :2].any()
    sliders = sliders_of(system, np.inf, None, np.zeros(system.basis.contact_nodes))
    assert np.isfinite(sliders.stiffness).all()
    assert (sliders.stiffness > 0.0).all()


@pytest.mark.parametrize("part", [0.2, 0.3, 0.375])
def test_stiff_normal_law_between_slender_layers(part):
    """At every reversal all sliders are at their limits; nothing jumps, and the loss is that of
    slip theory but for what the normal law gives way."""
    L, W = clamped_layers.LENGTH, clamped_layers.WIDTH
    limit = part * clamped_layers.END_LOAD
    pressure = limit / (clamped_layers.MU * W * clamped_layers.HEIGHT)
    system = replace(clamped_layers.layers(), normal={"joint": LinearContact(1e10 * L * W)})
    half = [0.0, 0.5 * clamped_layers.END_LOAD, -0.5 * clamped_layers.END_LOAD,
            0.5 * clamped_layers.END_LOAD]
    ends = {"upper.end.y": half, "lower.end.y": half}
    history = load_history(system, LoadPath(load_scale=pressure, forces=ends, steps=10),
                           tangential_stiffness=1e12 * L * W, rtol=1e-4)
    assert history.status == "finished"
    assert history.statistics["jumps"] == 0
    assert history.statistics["solved"] < 200
    assert clamped_layers.loss(history) == pytest.approx(
        float(clamped_layers.slip_theory(limit)), rel=0.012)
