"""Names and colours of contact states in pictures."""

from fecontact.integrate.trajectory import Trajectory

# Colours that people with colour-blindness tell apart; 'open' takes that of the background.
STATE_COLOURS = {"stick": "#0072b2", "slip": "#e69f00", "contact": "#009e73"}


def state_names(trajectory: Trajectory) -> tuple[str, ...]:
    """Open, stick, slip by their numbers; open and contact in a run without friction forces."""
    return ("open", "stick", "slip") if trajectory.friction_force.any() else ("open", "contact")
