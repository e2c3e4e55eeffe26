"""Words of the field for commands, for command lines that name none."""

from collections.abc import Mapping

# Command lines, and the words of the field for what they do.
_WORDS: Mapping[str, tuple[str, ...]] = {
    "init": ("new", "create", "template"),
    "import": ("deck", "abaqus", "calculix", "ansys", "nastran", "inp"),
    "mesh": ("generate", "gmsh", "geometry"),
    "modes": ("modal", "eigen", "eigenvalues", "frequencies", "eigenfrequencies", "reduce"),
    "modes --complex": ("cea", "complex-eigenvalues", "complex-modes", "squeal", "flutter",
                        "stability"),
    "modes --nonlinear": ("backbone", "nnm", "nonlinear-modes", "epmc"),
    "campbell": ("rotor", "critical-speeds", "whirl"),
    "buckling": ("buckle", "critical-load"),
    "preload": ("bolts", "pretension", "static", "quasistatic", "quasi-static"),
    "run": ("simulate", "solve", "transient", "integrate", "dynamic", "stick-slip"),
    "wear": ("fretting", "archard"),
    "sweep": ("brute-force", "monte-carlo", "parameter-study", "sensitivity", "sobol", "doe"),
    "fit": ("identify", "identification", "calibrate", "calibration", "update", "inverse"),
    "data": ("measurement", "measurements", "uff", "ring-down"),
    "measure": ("sensors", "accelerometer", "accelerometers", "virtual"),
    "branch": ("bifurcation", "bifurcations", "continuation", "continue", "limit-cycles",
               "periodic-orbits", "matcont", "auto"),
    "response": ("frf", "hbm", "harmonic-balance", "frequency-response", "forced-response",
                 "steady-state", "resonance"),
    "render": ("movie", "animate", "animation", "video", "picture"),
    "open": ("show", "view", "paraview"),
    "export": ("convert", "csv", "matlab"),
    "doctor": ("check", "info", "test"),
}
_COMMANDS = {word: command for command, words in _WORDS.items() for word in words}


def command_called(word: str) -> str | None:
    """The command line for what a word of the field means, such as ``modes --complex``."""
    return _COMMANDS.get(word.lower().replace("_", "-"))
