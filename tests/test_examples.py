"""Every example runs as it stands, is short, prints what it should, and draws its pictures."""

import ast

import pytest
from scripts_for_tests import ROOT, check_numbers, run_script

from fecontact import read_case
from fecontact.cli import execute
from fecontact.plot import rendering_problem

LINES = 60
RENDERED = ("sliding_beam", "disc_brake", "platform_damper")

# Patterns, numbers and tolerances; files.
EXAMPLES = {
    "squeal": ([(r"coefficient of (\S+) on", 0.3108, 2e-4), (r"at (\S+) Hz,", 646.0, 0.1)],
               {"squeal_map.png", "squeal_modes.png"}),
    # Frequency of the squealing disc by complex modes; growth is the squeal's own.
    "disc_brake": ([(r"mode of (\S+) Hz", 8277.82, 0.01), (r"grows by (\S+) 1/s", 148.487, 0.01),
                    (r"^it squeals at (\S+) Hz", 8000.0, 80.0)],
                   {"disc_brake.png", "disc_brake_modes.png"}),
    "beam_stick_slip": ([(r"above (\S+) mm/s", 8.3365, 1e-3),
                         (r"after (\S+) ms", 55.617, 2e-3)], {"beam_stick_slip.png"}),
    # Shares of the time of sticking from the runs of the validation page.
    "friction_oscillator": ([(r"^rigid modes: sticks (\d+)%", 94.0, 1.0),
                             (r"^elastic mode: sticks (\d+)%", 94.0, 1.0)],
                            {"friction_oscillator.png", "spectrogram.png"}),
    "two_mass_friction": ([(r"Hopf at B = (7\S+)", 7.0865, 1e-4),
                           (r"fold at B = (\S+)", 0.890687, 1e-4),
                           (r"doubling at B = (8\S+)", 8.092192, 1e-4)],
                          {"two_masses_over_B.png"}),
    # The Neimark-Sacker point by collocation.
    "beating_friction": ([(r"^tori from waves of (\S+) um", 32.7298, 2e-3),
                          (r"^waves of 2 um: \S+ Hz and (\S+) Hz", 4.957, 2e-3)],
                         {"tori.png", "tori_section.png"}),
    "sliding_beam": ([(r"off by (\S+)$", 0.0, 1e-8)],
                     {"contact.png", "energies.png", "friction_work.png", "history.png",
                      "sliding_beam.mp4"}),
    # The closed form of the validation page at a dashpot of 0.1.
    "sliding_borders": ([(r"ends at V = (\S+),", 0.5490463, 1e-6)],
                        {"sliding_borders.png", "stick_slip.png"}),
    # Periods reported by the source: 1, 2, 4, none, and 1 with chatter.
    "impact_oscillator": ([(r"^ 10.237 +(\d+)", 1.0, 0.0), (r"^  4.908 +(\d+)", 2.0, 0.0),
                           (r"^  5.954 +(\d+)", 4.0, 0.0), (r"^  1.567 +(\d+)", 1.0, 0.0)],
                          {f"pendulum_{name}_hz.png" for name in ("10.24", "4.91", "5.95", "3.76",
                                                                  "1.57")}),
    "impact_map": ([(r"^up: .* at (\d+)%", 38.0, 3.0)], {"impact_map.png"}),
    # Other branches double too; runs lie upon these.
    "impact_orbits": ([(r"^one period: period doubling at (6.2\S+) Hz", 6.21155, 1e-3)],
                      {"impact_orbits.png"}),
    "million_starts": ([(r"^periodic, 2 states .* (\S+)% of", 81.8, 1.0)], {"million_starts.png"}),
    # Waves and a stiff spring between the ends, see the validation page.
    "colliding_bars": ([(r"^1 m on 1 m: restitution (\S+)", 0.99793, 2e-3),
                        (r"^1 m on 2 m: restitution (\S+)", 0.53, 2e-3)], {"colliding_bars.png"}),
    # Hertz.
    "line_contact": ([(r"^p_0 = (\S+) GPa", 1.32637, 2e-3)], {"line_contact.png"}),
    "two_bodies": ([(r"^at 3600 N (\d+)% of", 73.0, 3.0)],
                   {"two_bodies.png", "two_bodies_stress.png"}),
    # Hertz; Mindlin's loss, with the elements' error.
    "pressed_sphere": ([(r"^radius of contact (\S+) mm", 1.0, 5e-3),
                        (r"takes (\S+) mJ", 6.3035, 0.5)],
                       {"pressed_sphere_loop.png", "pressed_sphere_shear.png"}),
    # What no longer touches at 0.6 and 0.2 of the load (Jaeger, Ciavarella).
    "half_space": ([(r"^at .* force (\S+) and", 36.66, 1.5),
                    (r" and (\S+) % of it slide", 75.11, 1.5)], {"half_space.png"}),
    # Slip theory: 4.01786 J.
    "clamped_layers": ([(r"^mu p b h / P = 0.375: (\S+) J", 4.01786, 0.01)],
                       {"clamped_layers.png"}),
    # Two bolts of 2e8 N/m, shortened by 10 um: at most 4 kN.
    "lap_joint": ([(r"^the bolts press with (\S+) N", 3250.0, 2.0),
                   (r"^stuck: (\S+),", 79.206, 0.01)], {"lap_joint_loop.png"}),
    "friction_damper": ([(r"^best load (\S+) N", 0.3927, 0.03)],
                        {"friction_damper.png", "friction_damper_responses.png"}),
    # Folds as published for this oscillator.
    "frequency_response": ([(r"^  1\.00 +\S+ +(\S+)$", 6.23, 0.03),
                            (r"^P = 0.18: .*, (\S+)$", 1.115700, 1e-5)],
                           {"friction_damper_response.png", "hardening_response.png"}),
    # A stuck and a sliding damper of 2000 N/m on one mode of the mass m / 4 and 92.806 Hz.
    "nonlinear_modes": ([(r"^(\S+) Hz sticking", 95.09, 0.1),
                         (r"sticking, (\S+) Hz sliding", 92.806, 0.03),
                         (r"resonance at (\S+) Hz", 0.2240, 1e-3)],
                        {"damped_beam_mode.png", "internal_resonance.png"}),
    # The coefficient of friction times the height of 30 mm, on any belt.
    "tipping_pad": ([(r"^friction 0.25.* resultant (\S+) mm", 7.5, 1e-4),
                     (r"^friction 0.45, belt at 35 .* resultant (\S+) mm", 13.5, 1e-4)],
                    {"tipping_pad.png"}),
    # v / (mu g).
    "thrown_block": ([(r"^sticks after (\S+) s", 0.3799, 2e-4)], {"thrown_block.png"}),
    "own_law": ([(r"^logarithmic: sticks (\d+)%", 0.0, 0.5),
                 (r"^falling: sticks (\d+)%", 26.0, 4.0)], {"own_law.png"}),
    "from_other_programs": ([(r"^Abaqus: (\S+),", 17433.0, 0.5), (r"^MATLAB: (\S+),", 17433.0, 0.5),
                             (r"^universal file: (\S+),", 17433.0, 0.5)],
                            {"from_other_programs.png"}),
    # Stuck: the springs of both contacts; Coriolis forces against the whole wheel.
    "bladed_wheel": ([(r"^1000.0 N: peak \S+ um at (\S+) Hz", 504.39, 0.02),
                      (r"^diameter 4: .* (\S+) Hz backwards", 785.9, 0.5)],
                     {"wheel_diameters.png", "wheel_modes.png", "blade_tips.png"}),
    # Stuck: a blade with the springs of both contacts, in closed form.
    "platform_damper": ([(r"^  3000 N: (\S+) um", 102.47, 0.1),
                         (r"^  3000 N: .* (\S+) Hz", 702.29, 0.03)],
                        {"platform_damper.png", "platform_damper.mp4"}),
    # Of a clamped strip: 22.373 h / (2 pi L^2) (E / (12 rho))^(1/2) = 59.073 Hz.
    "bolted_panel": ([(r"^held: (\S+) Hz", 59.1, 0.4), (r"^400 N: .* at 2 mm (\S+) Hz", 61.45, 0.5),
                      (r"^400 N: .* ratio of (\S+)%", 4.23, 0.2)], {"bolted_panel.png"}),
    # The 2nd mode of the receptance of the beam with the masses of gauge and accelerometer.
    "shaken_beam": ([(r"^highest peak at (\S+) Hz", 560.4, 0.6), (r"off by (\S+) %", 0.0, 1.0)],
                    {"shaken_beam.png"}),
    "sweep": ([(r"^(\d+) cases, 0 failed", 60.0, 0.0), (r"0.600: .* to +(\S+) mm/s", 4.0, 0.0)],
              {"sweep_map.png"}),
}
# These need a file that is not part of the package.
WITHOUT_FILE = {"brake_reuss_beam": "Put the deck of the Brake-Reuss beam beside this"}


def code_lines(path):
    """Lines of a script that are neither blank nor comments nor its docstring."""
    text = path.read_text(encoding="utf-8")
    first = ast.parse(text).body[0].end_lineno
    return [line for line in text.splitlines()[first:] if line.strip() and not
            line.lstrip().startswith("#")]


def test_every_example_is_here():
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} == {*EXAMPLES, *WITHOUT_FILE}


@pytest.mark.parametrize("name", [*EXAMPLES, *WITHOUT_FILE])
def test_examples_are_short_and_go_straight_on(name):
    lines = code_lines(ROOT / "examples" / f"{name}.py")
    assert 15 <= len(lines) <= LINES
    assert not any("argv" in line or "def main" in line for line in lines)


@pytest.mark.parametrize("name", EXAMPLES)
def test_example(name, tmp_path, monkeypatch, capsys):
    if name in RENDERED and (reason := rendering_problem()) is not None:
        pytest.skip(reason)
    numbers, files = EXAMPLES[name]
    printed, left = run_script(f"examples/{name}.py", (), tmp_path, monkeypatch, capsys)
    check_numbers(printed, numbers)
    assert {file for file in left if not file.startswith("sweep/")} == files


@pytest.mark.parametrize("name", WITHOUT_FILE)
def test_an_example_without_its_file_asks_for_it(name, tmp_path, monkeypatch, capsys):
    with pytest.raises(SystemExit, match=WITHOUT_FILE[name]):
        run_script(f"examples/{name}.py", (), tmp_path, monkeypatch, capsys)



@pytest.mark.parametrize("study", sorted(
    set((ROOT / "examples").glob("*.toml")) - {ROOT / "examples" / "wheel.toml"}),
    ids=lambda x: x.stem)
def test_study_of_the_examples(study, tmp_path, capsys):
    assert execute(["run", str(study), "-o", str(tmp_path), "--set", "simulation.t_end=0.05",
                    "--set", "simulation.outputs=11", "--set", "output.frames=2"]) == 0
    run = read_case(tmp_path / f"{study.stem}.vtkhdf").trajectory
    assert run.time[-1] == 0.05
    assert run.energies.imbalance < 1e-4
