"""Columns of results of compiled functions: contact quantities of nodes, powers of a system."""

# Quantities of each contact node; the last two in space only.
(NORMAL_FORCE, FRICTION_FORCE, PENETRATION, PENETRATION_RATE, SLIP_VELOCITY, GROUND_RATE,
 FRICTION_ACROSS, SLIP_ACROSS) = range(8)
STATE_COLUMNS, SPACE_STATE_COLUMNS = 6, 8

# Powers: five that are put in, by stiffness that is not symmetric too, four that are lost, and what
# is stored in bristles at constant normal force.
POWERS = ("drive", "belt_normal", "belt_friction", "load", "circulatory", "modal_damping",
          "dashpots", "contact_damping", "friction", "bristles")
