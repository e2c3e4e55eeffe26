"""Archives as Ansys writes them by CDWRITE, and their materials."""


def archive(path, kind, nodes, cells, further="", option=None):
    """An archive as CDWRITE writes it; cells are rows of nodes from 1 on, with material 1."""
    lines = ["/PREP7", f"ET,        1,{kind}"]
    if option is not None:
        lines.append(f"KEYOP,        1, 2,        {option}")
    lines += [f"NBLOCK,6,SOLID,{len(nodes):10d},{len(nodes):10d}", "(3i9,6e21.13e3)"]
    lines += [f"{k:9d}{0:9d}{0:9d}" + "".join(
        f"{x:20.13E}".replace("E+", "E+0").replace("E-", "E-0") for x in node)
        for k, node in enumerate(nodes, 1)]
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{len(cells):10d},{len(cells):10d}",
              "(19i9)"]
    for k, cell in enumerate(cells, 1):
        row = [1, 1, 1, 1, 0, 0, 0, 0, len(cell), 0, k, *cell]
        lines.append("".join(f"{n:9d}" for n in row[:19]))
        if len(row) > 19:
            lines.append("".join(f"{n:9d}" for n in row[19:]))
    path.write_text("\n".join([*lines, "       -1", further, "FINISH", ""]))
    return path


def material(number=1, **values):
    return "\n".join(f"MPTEMP,R5.0, 1, 1,  0.00000000    ,\n"
                     f"MPDATA,R5.0, 1,{name:4s},{number:8d}, 1, {value:.9E}    ,"
                     for name, value in values.items())
