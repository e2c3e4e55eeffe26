"""Section 4.4 of the source: bifurcations of two masses on a belt."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import two_mass_friction as example
from comparison import Comparison, comparisons, table
from pictures import save
from scipy.optimize import brentq

from fecontact.bifurcation import Branch, amplitude
from fecontact.plot import plot_basins, plot_branches

SPEED = 3.8  # between the folds
KINDS = (("Hopf", "Hopf points of steady sliding"), ("fold", "turning points of the orbits"),
         ("period doubling", "period doublings"))


def section(images: Path) -> str:
    """Text with tables; pictures into a folder."""
    over_B, over_speed = example.diagram_over_B(), example.diagram_over_speed()
    height = amplitude(example.oscillator().displacement_row(1))
    motions = example.attractors(SPEED, over_speed)
    for name, branches, label in (("B", over_B, "B [m]"), ("v0", over_speed, "v0 [m/s]")):
        figure = plot_branches(list(branches.values()), height, x_label=label,
                               y_label="amplitude of x3 [m]", names=list(branches))
        save(figure, images / f"two-masses-{name}.png")
    save(example.phase_figure(motions, SPEED), images / "two-masses-attractors.png")
    found, axes = example.basins_of_attraction(SPEED)
    save(plot_basins(found, x_label="x3 at the start [m]", y_label="x3' at the start [m/s]",
                     rows=axes), images / "two-masses-basins.png")
    rows = [(what, printed, f"{value:.4f}", deviation(printed, value))
            for what, printed, value in example.table(over_B, over_speed)]
    rows.append((f"stable motions at v_0 = {SPEED:g} m/s", 3, len(motions), ""))
    return TEXT.format(
        printed=table(("", "printed", "computed", "deviation from the print"), rows),
        attractors=", ".join(name for name, _ in motions), shares=example.shares(found),
        exact=comparisons(hopf_points(over_B["steady sliding"])),
        damping=table(("", "B = 10 m", "B = 20 m"),
                      list(zip(*map(over_damping, (None, 10.0, 20.0)), strict=True))))


def deviation(printed: str, value: float) -> str:
    """Relative to what is printed, where that is a number."""
    try:
        return f"{value / float(printed) - 1.0:+.1e}"
    except ValueError:
        return ""


def hopf_points(sliding: Branch) -> list[Comparison]:
    """Both, by the Jacobian of the equations (4.4-1) written out."""

    def growth(B: float) -> float:
        # Slope of (4.4-9) at v_0 = 1 with a_1 = 0.14, a_2 = 1.14, b_1 = 2, b_2 = 100.
        fall = 1.14 * np.exp(-2.0)
        slope = 0.14 * B * (100.0 * (1.0 + fall) / 10001.0 - 2.0 * fall * np.arctan(100.0))
        values = np.linalg.eigvals([[0.0, 1.0, 0.0, 0.0],
                                    [-1.2, (-0.4 - slope) / 2.5, 0.4, 0.08],
                                    [0.0, 0.0, 0.0, 1.0], [1.0, 0.2, -1.0, -0.2 - slope]])
        pairs = values[values.imag > 0.0].real
        return float(pairs[np.argmin(np.abs(pairs))])

    return [Comparison(f"{name}, against the eigenvalues of the equations: B [m]",
                       brentq(growth, *around, xtol=1e-13), point.parameter)
            for name, around, point in zip(("H1", "H2"), ((1.0, 1.4), (6.8, 7.3)),
                                           sliding.of_kind("Hopf"), strict=True)]


def over_damping(B: float | None) -> list[str]:
    """Places of all special points over D; their names without B."""
    if B is None:
        return [words for _, words in KINDS]
    branches = example.diagram_over_damping(B)
    return [places(branches, kind) for kind, _ in KINDS]


def places(branches: Mapping[str, Branch], kind: str) -> str:
    """Values of D at the points of a kind on all branches, each once."""
    found = np.sort([point.parameter for branch in branches.values()
                     for point in branch.of_kind(kind)])
    distinct = found[np.diff(found, prepend=-1.0) > 1e-6]
    return ", ".join(f"{value:.4f}" for value in distinct) or "none"


TEXT = """## Section 4.4: bifurcations of two masses on a belt

A chain of two masses, each pressed on the belt, friction falling with the slip velocity:
`two_mass_friction.py`. The print leaves out the ratio of the masses in (4.4-1), a
parenthesis in the friction law, its constants and the base values of the diagrams; the ones taken
were found by fitting the printed results: v_0 = 1 m/s and D = 0.1 over B, B = 20 m and D = 0.1
over v_0.

{printed}

The first Hopf point and the fold of the orbits that emerge there lie 5.7 % and 1.2 % above the
printed values. These two values seem to be misprints: with the same constants all others agree to
the last digit, except the third doubling, which rounds to 9.37. Between T1 and H1 steady sliding
and a stable orbit coexist, as the source says; the unstable orbit between them separates their
basins. The three stable motions at 3.8 m/s, found by runs of 400 s: {attractors}. Of the starts of
the second mass in the last picture, the first one resting at its place in steady sliding, lead to
them: {shares}.

{exact}

Marks in the pictures are numbered along the branches: F1 over B is T1, F2 and F3 over v_0 are the
ends of the range with three attractors.

![Amplitude over B](images/validation/two-masses-B.png)

![Amplitude over v_0](images/validation/two-masses-v0.png)

![The three stable motions at v_0 = 3.8 m/s](images/validation/two-masses-attractors.png)

![Basins of attraction at v_0 = 3.8 m/s](images/validation/two-masses-basins.png)

Over D the source shows turning points, Hopf points and period doublings, but the values of B and
v_0 of this diagram cannot be recovered. Computed instead at v_0 = 1 m/s, values of D, on the
branches from both Hopf points down to D = 0.06:

{damping}
"""
