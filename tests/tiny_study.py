"""A study that runs in a moment."""

TINY = """
geometry = { shape = "beam", length = 0.1, height = 0.01, element_size = 0.01 }
body = { material = "steel", thickness = 0.02 }
basis = { modes = 5, contact_nodes = 4, damping = 0.01 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
ground = { speed = 0.1 }
load = { normal = 10.0 }
simulation = { t_end = 5e-4, outputs = 11 }
output = { frames = 3 }
render = { frames = 2, size = [320, 180] }
"""
