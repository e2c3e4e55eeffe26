"""Letters and markers of the special points of branches."""

SPECIAL = {
    "Hopf": ("H", "o"), "fold": ("F", "s"), "branch point": ("BP", "D"),
    "period doubling": ("PD", "^"), "Neimark-Sacker": ("NS", "v"), "cusp": ("CP", "P"),
    "Bogdanov-Takens": ("BT", "*"), "Bautin": ("GH", "X"), "zero-Hopf": ("ZH", "<"),
    "double Hopf": ("HH", ">"), "unresolved": ("?", "x"),
    "generalised period doubling": ("GPD", "p"), "Chenciner": ("CH", "h"),
    "resonance 1:1": ("R1", "1"), "resonance 1:2": ("R2", "2"), "resonance 1:3": ("R3", "3"),
    "resonance 1:4": ("R4", "4"), "fold-flip": ("FPD", "d"),
    "fold-Neimark-Sacker": ("FNS", "d"), "flip-Neimark-Sacker": ("PDNS", "d"),
    "double Neimark-Sacker": ("NSNS", "d"), "neutral saddle": ("NSS", "d"),
    "stable double eigenvalue": ("DRS", "d"), "unstable double eigenvalue": ("DRU", "d"),
    "stable orbit flip": ("OFS", "d"), "unstable orbit flip": ("OFU", "d"),
    "stable inclination flip": ("IFS", "d"), "unstable inclination flip": ("IFU", "d"),
    "extremum": ("", "o"),
    # Borders of contact states: one marker for all.
    "grazing": ("G", "d"), "grazing-sliding": ("GS", "d"), "crossing-sliding": ("CS", "d"),
    "switching-sliding": ("SS", "d"), "adding-sliding": ("AS", "d"), "lift-off": ("LO", "d"),
    "impact-sliding": ("IS", "d"), "corner": ("CC", "d"),
}
