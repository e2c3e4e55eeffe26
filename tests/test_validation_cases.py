"""The cases of the validation page run in their short form and print what they should."""

import numpy as np
import pytest
from scripts_for_tests import ROOT, check_numbers, run_script

# Spring of the drive and elastic mode with the contact held: w^2 of the one motion that is left.
_w = 2.0 * np.pi * 30.0
HELD_HZ = np.sqrt((_w**2 + 5610.0 / 5.632 * (0.5 + 0.5) ** 2) / 1.25) / (2.0 * np.pi)

# Arguments; patterns, numbers and tolerances; files.
CASES = {
    "impact_calibration": ((), [(r"4 mm: (\S+) kg", 0.092, 1e-5), (r"kg, (\S+) Hz", 230.0, 0.02),
                                (r"Hz, (\S+)$", 0.6, 1e-4)], set()),
    # The middle fifth carries most of 5 kN; both tables as in docs/convergence.md.
    "contact_convergence": ((), [(r"^\| 10 \| 10 \|[^|]*\| (\S+) \|", 20.71, 0.01),
                                 (r"^\| 5 \| 20 \|[^|]*\| (\S+) \|", 20.43, 0.01)], set()),
    # Hertz: 1.2121 GPa; Cattaneo: sqrt(1/2).
    "line_contact": (("out",), [(r"^nu = 0.3: p_0 = (\S+) GPa", 1.21207, 1e-3),
                                (r"^nu = 0.49: .* c / b = (\S+)$", 0.70711, 1e-3)],
                     {"out/line_contact.png"}),
    # Hertz: 0.8571 GPa; Cattaneo: sqrt(1/2).
    "two_bodies": (("out",), [(r"^steel on steel: p_0 = (\S+) GPa", 0.85707, 1e-3),
                              (r"c / b = (\S+) ", 0.70711, 0.01)], {"out/two_bodies.png"}),
    # The closed form of sliding_borders.py at a dashpot of 0.1; the linear response.
    "sliding_borders": ((), [(r"^stick-slip ends at V = (\S+),", 0.5490463, 1e-6),
                                   (r"largest difference (\S+)$", 0.0, 1e-7),
                                   (r"^grazing-sliding at V = (\S+)", 1.191452, 1e-5)],
                        set()),
    "stacked_blocks": ((), [(r"^matching meshes: stress to (\S+) of", 0.0, 1e-11),
                            (r"5 segments: stress to (\S+) of", 0.0, 1e-11)], set()),
    "colliding_bars": ((), [(r"^1 m on 1 m: restitution (\S+) ", 0.99793, 2e-3),
                            (r"^contact time (\S+) us", 399.66, 0.4),
                            (r"^1 m on 2 m: restitution (\S+) ", 0.53, 2e-3)], set()),
    "clamped_layers": (("out",), [(r"^mu p b h / P = 0.375: (\S+) J", 4.01786, 0.01)],
                       {"out/clamped_layers.png"}),
    # Sextro prints 7.09 and 8.09; the others see the example itself.
    "disc_and_pads": ((), [(r"coefficient of (\S+) on", 0.1988, 2e-4),
                                 (r"at (\S+) Hz, supercritical", 4688.1, 0.2),
                                 (r"grows by (\S+) 1/s;", 1012.95, 0.5),
                                 (r"; a run by (\S+) 1/s", 1012.95, 1.0),
                                 (r"^limit cycle at (\S+) Hz", 4550.0, 40.0)],
                      set()),
    "friction_damper": ((), [(r"^free: .* at (\S+) Hz", 92.80, 0.01),
                                   (r"^stuck: .* at (\S+) Hz", 113.18, 0.02),
                                   (r"^best load (\S+) N", 5.0, 0.5)], set()),
    # Frequencies and amplitudes of blades with the best load, and with twice as much.
    "blade_pair": (("out",), [(r"^load   5.24 N: \S+ Hz, (\S+) um", 10.309, 0.02),
                              (r"^load   5.24 N: .* harmonic (\S+) um", 10.472, 1e-3),
                              (r"^load  10.47 N: \S+ Hz, (\S+) um", 13.868, 0.03)],
                   {"out/blade_pair.png"}),
    # Two bolts of 2e8 N/m, shortened by 10 um: at most 4 kN.
    "lap_joint": ((), [(r"^the bolts press with (\S+) N", 3250.0, 2.0),
                             (r"^stuck: (\S+) Hz", 79.206, 0.01),
                             (r"^struck, 0.10 mm: (\S+) Hz", 79.206, 0.01),
                             (r"^struck, 2.01 mm: (\S+) Hz", 78.631, 0.02)],
                  set()),
    # Shakedown and microslip: the loop and the run, each by itself.
    "bolted_plate": (("out",), [(r"^stuck: (\S+) Hz", 71.2742, 1e-3),
                                (r"^end 0.976 mm: (\S+) Hz", 71.068, 0.005),
                                (r"damping ratio (\S+);", 0.00232, 3e-5),
                                (r"; loop (\S+) Hz", 71.06, 0.015)],
                     {"out/bolted_plate.png"}),
    "disc_brake": (("out",), [(r"^friction 0.3: a mode of (\S+) Hz", 8277.82, 0.01),
                              (r"grows by (\S+) 1/s;", 148.487, 0.01),
                              (r"; a run by (\S+) 1/s", 148.487, 0.01),
                              (r"^it squeals at (\S+) Hz", 8000.0, 80.0)],
                   {"out/disc_brake.png"}),
    # The resultant moves by the coefficient of friction times the height of 30 mm, on any belt.
    "tipping_pad": (("out",), [(r"^friction 0.25.* resultant (\S+) mm", 7.5, 1e-5),
                               (r"^friction 0.45, belt at 0 .* resultant (\S+) mm", 13.5, 1e-5),
                               (r"^friction 0.45, belt at 35 .* resultant (\S+) mm", 13.5, 1e-5),
                               (r"at 0 degrees: .* ahead, (2\d)% lifted", 20.0, 0.0),
                               (r"^a run from rest ends (\S+) of", 0.0, 1e-3)],
                    {"out/tipping_pad.png"}),
    # Folds as published for this oscillator.
    "frequency_response": ((), [(r"^  1\.00 +\S+ +(\S+)$", 6.23, 0.03),
                                      (r"^  0\.18 .* (\S+)$", 1.115700, 1e-5)],
                           set()),
    # A stuck and a sliding damper of 2000 N/m on one mode of the mass m / 4 and 92.806 Hz.
    "nonlinear_modes": (("out",), [(r"^beam: (\S+) Hz sticking", 95.09, 0.1),
                                   (r"sticking, (\S+) Hz sliding", 92.806, 0.03),
                                   (r"^free decay: frequency off by (\S+) %", 0.0, 0.01),
                                   (r"damping by (\S+) %", 0.0, 1.5),
                                   (r"^ 0\.10 N: peak (\S+) mm", 0.1580, 5e-4),
                                   (r"of the mode (\S+) mm", 0.1580, 5e-4),
                                   (r"^best load (\S+) N", 0.3927, 0.03),
                                   (r"resonance at (\S+) Hz", 0.2240, 1e-3)],
                        {f"out/{name}.png" for name in (
                            "damped_beam_mode", "damped_beam_responses", "internal_resonance")}),
    "two_mass_friction": ((), [(r"Hopf at B = (7\S+)", 7.0865, 1e-4),
                                     (r"fold at B = (\S+)", 0.890687, 1e-4),
                                     (r"doubling at B = (\S+)", 8.092192, 1e-4)],
                          set()),
    "friction_oscillator": (("out",), [(r"vibrate at (\S+) Hz", HELD_HZ, 0.006),
                                       (r"^c: three modes .* (\S+) Hz", HELD_HZ, 0.05),
                                       (r"equilibrium: (\S+) N", 14.0, 1e-6)],
                            {"out/phase.png", "out/inclined.png"}),
    "impact_oscillator": ((), [(r"\| 2 \| period (\d)", 1.0, 0.0),
                               (r"\| 2 \|.* ([-+][\d.]+) \|$", -6.254, 0.01)], set()),
    "impact_figures": (("out",), [(r"phase.png: (\d+) diagrams", 6.0, 0.0)],
                       {f"out/impact-{name}.png" for name in ("phase", "chatter", "sections")}),
    "impact_map": (("out",), [(r"up to (\d) of 5", 4.0, 1.0)],
                   {"out/impact-bifurcation.png", "out/impact-map.png"}),
    "impact_orbits": (("out",), [(r"^(\d+) runs that repeat", 8.0, 0.0)],
                      {"out/impact_orbits.png"}),
    # The orbit that is followed and the run have one period.
    "beam_stick_slip": (("out.png",), [(r"stable above (\S+) mm/s", 8.3365, 1e-3),
                                       (r"50.0000 mm/s: (\S+) ms", 55.619, 2e-3),
                                       (r"run at 50 mm/s: (\S+) ms", 55.619, 2e-3)], {"out.png"}),
    "sliding_beam": ((), [(r"off by (\S+)\.$", 0.0, 1e-8), (r"^   10 +(\S+)%", 4.0, 1.0)],
                     set()),
    "sliding_box": (("out",), [(r"^transverse \(1, 1, 1\): (\S+) Hz", 18711.342, 1e-3),
                               (r"^Q2, transverse \(1, 1, 0\): .* h\^(\S+)$", 4.0, 0.05),
                               (r"^Q1, transverse \(1, 1, 0\): .* h\^(\S+)$", 2.0, 0.05),
                               (r"Hz, at most (\S+) % off", 2.5, 2.5)], {"out/sliding_box.png"}),
    # The smoothing lets the block stick 44 us too late, by 2 SPEED / (pi k_s mu g).
    "thrown_block": (("out",), [(r"^closed form: sticks after (\S+) s", 0.3798960, 1e-7),
                                (r"^mass: .* y = (\S+) m", 0.1899480, 3e-6),
                                (r"^block: .* x = (\S+),", 0.0949740, 2e-5),
                                (r"^block: .* y = (\S+) m", 0.1899480, 3e-5),
                                (r"of the block (\S+) mm ahead", 3.0, 1e-3),
                                (r"^arctan, .*: (\S+) m too far", 2.43014e-4, 1e-8)],
                     {"out/thrown_block.png"}),
    "dithered_friction": (("out",), [(r"^dither across, V = 0.1 a: (\S+) ", 0.2344157, 2e-6),
                                     (r"^dither across, V = 1 a: (\S+) ", 0.8346268, 2e-6),
                                     (r"^dither along, V = 0.5 a: (\S+) ", 1.0 / 3.0, 5e-5)],
                          {"out/dithered_friction.png"}),
    # Hertz: 40 um, 1 mm; Cattaneo: (1/4)^(1/3); Mindlin: 0.75 mu P and 3.584 mJ.
    "two_spheres": (("out",), [(r"^11 rings: approach (\S+) um", 40.0, 0.04),
                               (r" a = (\S+) mm", 1.0, 5e-3), (r"c / a = (\S+) ", 0.63, 0.02),
                               (r" Q = (\S+) mu P", 0.75, 2e-3),
                               (r", loss (\S+) mJ", 3.584, 0.036)], {"out/two_spheres.png"}),
    # Half of these: the plane is that of symmetry.
    "pressed_sphere": (("out",), [(r"^2 elements: approach (\S+) um", 20.0, 0.06),
                                  (r" a = (\S+) mm", 1.0, 5e-3),
                                  (r"c / a = (\S+) ", 0.4642, 0.03),
                                  (r"displacement (\S+) um", 6.9687, 0.05),
                                  (r", loss (\S+) mJ", 6.3035, 0.5)],
                       {"out/pressed_sphere.png", "out/pressed_sphere_displacement.png",
                        "out/pressed_sphere_shear.png"}),
    # A clamped panel whose pull reaches friction; cycles of slip begin at 2^(1/2) times that.
    "bolted_panel": ((), [(r"^400 N: slips at (\S+) mm", 0.821, 0.05),
                                (r"each cycle from (\S+) mm", 1.161, 0.06),
                                (r"^held: \S+ Hz, (\S+) Hz", 65.1, 0.3)],
                     set()),
    "bladed_wheel": ((), [(r"^1000.0 N: peak \S+ um at (\S+) Hz", 504.39, 0.02),
                                (r"stuck (\S+) Hz", 504.39, 0.01),
                                (r"^diameter 4 at .* (\S+) Hz backwards", 785.9, 0.5)],
                     set()),
    # A stuck blade with the springs of both contacts, in closed form.
    "platform_damper": (("out",), [(r"^ 3000.0 N: peak \S+ um at (\S+) Hz", 702.29, 0.03),
                                   (r"^ 3000.0 N: peak (\S+) um", 102.47, 0.1),
                                   (r"stuck: \S+ um at (\S+) Hz", 702.29, 0.02)],
                        {"out/platform_damper.png"}),
    # The deck is not part of the package.
    "brake_reuss_beam": ((), [], set()),
}


def test_every_case_is_here():
    assert {path.stem for path in (ROOT / "docs" / "validation" / "cases").glob("*.py")} == set(
        CASES)


@pytest.mark.parametrize("name", CASES)
def test_case(name, tmp_path, monkeypatch, capsys):
    arguments, numbers, files = CASES[name]
    printed, left = run_script(f"docs/validation/cases/{name}.py", arguments, tmp_path, monkeypatch,
                               capsys)
    check_numbers(printed, numbers)
    assert left == files


def test_a_case_without_its_deck_asks_for_it(tmp_path, monkeypatch, capsys):
    printed, _ = run_script("docs/validation/cases/brake_reuss_beam.py", (), tmp_path, monkeypatch,
                            capsys)
    assert printed.startswith("Give the deck of the Brake-Reuss beam")
    assert printed.count("\n") == 1
