"""Universal files of modes: shapes, units, complex modes, and files that are damaged."""

import sys
from pathlib import Path

import numpy as np
import pytest
import pyuff

from fecontact import InputError, MissingLibraryError
from fecontact.io import read_uff

BLOCK = Path(__file__).parents[1] / "data" / "block.uff"
NODES = [11, 12, 40]


def mode(number=1, **changes):
    """A data set 55 with three nodes, displacements in x and y."""
    return {"type": 55, "model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8,
            "load_case": 1, "mode_n": number, "freq": 10.0 * number, "modal_m": 4.0,
            "modal_damp_vis": 0.02, "modal_damp_his": 0.0, "node_nums": np.array(NODES),
            "r1": np.array([1.0, -0.5, 0.25]), "r2": np.array([0.0, 2.0, -1.0]),
            "r3": np.array([0.5, 0.0, 3.0])} | changes


def nodes(kind=2411, places=((0.0, 0.0, 0.0), (0.1, 0.0, 0.2), (0.3, 0.4, 0.5)), labels=NODES):
    x, y, z = np.transpose(places)
    ones = [1] * len(labels)
    return {"type": kind, "node_nums": list(labels), "def_cs": ones, "disp_cs": ones,
            "color": ones, "x": x, "y": y, "z": z}


def units(length, force):
    return {"type": 164, "units_code": 9, "units_description": "user", "temp_mode": 1,
            "length": length, "force": force, "temp": 1.0, "temp_offset": 0.0}


def written(path, *sets):
    pyuff.UFF(str(path)).write_sets([dict(one) for one in sets], mode="add")
    return path


# Reading -----------------------------------------------------------------------------------------

def test_modes_of_a_block():
    modes = read_uff(BLOCK)
    assert modes.shapes.shape == (15, 3, 8)
    assert modes.node_labels.tolist() == list(range(101, 116))
    assert (modes.frequencies_hz[:3] == 0.0).all()
    assert modes.frequencies_hz[3] == pytest.approx(17433.0, rel=1e-5)
    assert np.abs(modes.shapes).max(axis=(0, 1)) == pytest.approx(np.ones(8), abs=1e-5)
    assert modes.coordinates[[0, 14]].tolist() == [[0.0, 0.0, 0.0], [0.1, 0.04, 0.0]]
    assert modes.damping_ratios == pytest.approx([0.0] * 3 + [0.01] * 5)
    # Translations of unit size: the modal mass is the block's, 0.1 x 0.04 x 0.02 x 7850 kg.
    assert modes.modal_masses[:2] == pytest.approx([0.628, 0.628], rel=1e-5)
    # Turned about its middle, unit motion in x or y at the corners: J / r^2.
    inertia = 0.628 * (0.1**2 + 0.04**2) / 12.0
    assert modes.modal_masses[2] == pytest.approx(inertia / 0.05**2, rel=1e-5)
    basis = modes.modal_basis(range(101, 106))
    assert basis.contact_x == pytest.approx([0.0, 0.025, 0.05, 0.075, 0.1])
    assert basis.damping_ratios == pytest.approx(modes.damping_ratios)
    assert (basis.T[:2] == 0.0).all()


def test_shapes_and_points(tmp_path):
    path = written(tmp_path / "a.uff", nodes(), mode(2), mode(1, modal_m=9.0))
    modes = read_uff(path)
    assert modes.frequencies_hz.tolist() == [20.0, 10.0]
    assert modes.shapes[:, :, 0].tolist() == [[1.0, 0.0, 0.5], [-0.5, 2.0, 0.0], [0.25, -1.0, 3.0]]
    assert modes.node(40) == 2
    basis = modes.modal_basis([40, 11], B=12, points={"tip": 40})
    assert basis.frequencies_hz == pytest.approx([10.0, 20.0])
    # Scaled by 1 / sqrt(modal mass), the largest component (at node 40, z is not used) positive.
    assert basis.T[0, :, 0] == pytest.approx(np.array([-0.5, 2.0, 0.0]) / 3.0)
    assert basis.contact_T[0, :, 1] == pytest.approx(np.array([0.25, -1.0, 0.0]) / 2.0)
    assert basis.T[4] == pytest.approx(basis.contact_T[0])
    assert basis.contact_x.tolist() == [0.3, 0.0]
    assert (basis.T[1] == 0.0).all()
    own = modes.modal_basis([40], modal_mass=1.0, damping=0.1, contact_x=[0.7], tributary=[0.02])
    assert own.T[2, :, 1] == pytest.approx([0.25, -1.0, 0.0])
    assert own.damping_ratios == pytest.approx([0.1, 0.1])
    assert own.contact_x.tolist() == [0.7]
    assert own.tributary.tolist() == [0.02]


@pytest.mark.parametrize(("axes", "components", "turn", "x"), [
    (("x", "y"), (1.0, -0.5, 0.25), 0.3, 0.1), (("x", "z"), (1.0, 0.25, 0.5), -0.2, 0.1),
    (("-x", "z"), (-1.0, 0.25, 0.5), 0.2, -0.1), (("y", "z"), (-0.5, 0.25, 0.0), 0.1, 0.2),
    (("z", "x"), (0.25, 1.0, 0.0), 0.2, 0.3), (("y", "-x"), (-0.5, -1.0, 0.0), 0.3, 0.2),
])
def test_axes(tmp_path, axes, components, turn, x):
    """The rotation is the one from the first axis to the second."""
    one = mode(r1=np.array([1.0]), r2=np.array([-0.5]), r3=np.array([0.25]), r4=np.array([0.1]),
               r5=np.array([0.2]), r6=np.array([0.3]), data_ch=3, node_nums=np.array([11]),
               modal_m=1.0)
    path = written(tmp_path / "a.uff", nodes(places=[(0.1, 0.2, 0.3)], labels=[11]), one)
    basis = read_uff(path).modal_basis([11], axes=axes)
    sign = basis.contact_T[0, 0, 0] / components[0]
    assert abs(sign) == pytest.approx(1.0)
    assert basis.contact_T[0, :2, 0] == pytest.approx(sign * np.array(components[:2]))
    assert basis.contact_T[0, 2, 0] == pytest.approx(sign * turn)
    assert basis.contact_x == pytest.approx([x])


@pytest.mark.parametrize("kind", [15, 2411])
def test_units(tmp_path, kind):
    """Equal shape and mass from a file in metres and one in millimetres, newtons and tonnes."""
    places = np.array([(0.0, 0.0, 0.0), (0.1, 0.0, 0.2), (0.3, 0.4, 0.5)])
    metres = read_uff(written(tmp_path / "m.uff", nodes(kind, places), mode()))
    millimetres = read_uff(written(tmp_path / "mm.uff", units(1000.0, 1.0),
                                   nodes(kind, 1000.0 * places), mode(modal_m=4.0e-3)))
    assert millimetres.coordinates == pytest.approx(metres.coordinates)
    expected = metres.modal_basis(NODES).T
    found = millimetres.modal_basis(NODES).T
    assert found == pytest.approx(expected, rel=1e-12)


def test_nodes_that_a_mode_leaves_out_do_not_move(tmp_path):
    short = mode(2, node_nums=np.array([40, 5]), r1=np.array([1.0, 2.0]), r2=np.array([3.0, 4.0]),
                 r3=np.zeros(2))
    modes = read_uff(written(tmp_path / "a.uff", nodes(), mode(), short))
    assert modes.node_labels.tolist() == [5, 11, 12, 40]
    assert modes.shapes[:, 0, 1].tolist() == [2.0, 0.0, 0.0, 1.0]
    assert modes.shapes[0, :, 0].tolist() == [0.0] * 3
    assert np.isnan(modes.coordinates[0]).all()
    # Without the place of a contact node, there are no abscissae.
    assert modes.modal_basis([5, 40]).contact_x.tolist() == [0.0, 0.0]


def test_damping_and_masses_that_are_not_given(tmp_path):
    path = written(tmp_path / "a.uff", mode(modal_m=0.0, modal_damp_vis=0.0, modal_damp_his=0.06))
    modes = read_uff(path)
    assert modes.modal_masses is None
    assert modes.damping_ratios.tolist() == [0.03]
    with pytest.raises(InputError, match=r"a\.uff: the file does not give the modal masses; give "
                                         r"modal_mass"):
        modes.modal_basis([11])
    assert modes.modal_basis([11], modal_mass=4.0).T[2, :, 0] == pytest.approx([0.5, 0.0, 0.0])


# Complex modes -----------------------------------------------------------------------------------

def complex_mode(phase, imaginary=0.0, kind=3):
    """Modal A = 2 i w_d m of a proportionally damped mode: 10 Hz, D = 0.02, m = 4."""
    w, D, m = 20.0 * np.pi, 0.02, 4.0
    damped = w * np.sqrt(1.0 - D**2)
    turn = np.exp(1j * phase)
    plain = mode()
    shapes = {name: (plain[name] + 1j * imaginary * plain[name][::-1]) * turn
              for name in ("r1", "r2", "r3")}
    one = mode(analysis_type=kind, eig=-D * w + 1j * damped, modal_a=2j * damped * m * turn**2,
               modal_b=0j, **shapes)
    for name in ("freq", "modal_m", "modal_damp_vis", "modal_damp_his"):
        del one[name]
    return one


@pytest.mark.parametrize("phase", [0.0, 0.7, 2.0, -1.5])
@pytest.mark.parametrize("kind", [3, 7])
def test_complex_modes_of_proportional_damping_are_real(tmp_path, phase, kind):
    modes = read_uff(written(tmp_path / "a.uff", complex_mode(phase, kind=kind)))
    assert modes.frequencies_hz == pytest.approx([10.0], rel=1e-5)
    assert modes.damping_ratios == pytest.approx([0.02], rel=1e-4)
    assert modes.modal_masses == pytest.approx([4.0], rel=1e-4)
    shape = modes.shapes[:, :, 0] * np.sign(modes.shapes[0, 0, 0])
    assert shape == pytest.approx(np.array([[1.0, 0.0, 0.5], [-0.5, 2.0, 0.0], [0.25, -1.0, 3.0]]),
                                  abs=2e-5)


def test_complex_modes_far_from_real(tmp_path):
    modes = read_uff(written(tmp_path / "a.uff", complex_mode(0.7, 0.02)))
    assert modes.shapes.dtype == float
    with pytest.raises(InputError, match=r"b\.uff: Mode 2 is complex: its imaginary part is 0\.\d+ "
                                         r"of it .* more than 0.1; identify real"):
        read_uff(written(tmp_path / "b.uff", mode(), complex_mode(0.7, 0.5)))


# Errors ------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("sets", "message"), [
    ([nodes()], r"holds no modes; .* data sets 55 .* \(not from 2414\)"),
    ([mode(), mode(spec_data_type=12)], r"Mode 2 holds data of type 12, not displacements \(8\)"),
    ([mode(data_ch=4)], r"Mode 1 has 3 values at a node \(data characteristic 4\)"),
    ([units(0.0, 1.0), mode()], r"units of the file \(data set 164\) are 0 per metre"),
])
def test_modes_that_cannot_be_used(tmp_path, sets, message):
    with pytest.raises(InputError, match=r"a\.uff: .*" + message):
        read_uff(written(tmp_path / "a.uff", *sets))


def test_local_coordinate_systems(tmp_path):
    def systems(matrix):
        return {"type": 2420, "Part_UID": 1, "Part_Name": "part", "CS_sys_labels": [1],
                "CS_types": [0], "CS_colors": [1], "CS_names": ["CS"], "CS_matrices": [matrix],
                "nodes": [1]}

    path = written(tmp_path / "a.uff", systems(np.eye(4, 3)), nodes(), mode())
    assert read_uff(path).coordinates[2].tolist() == [0.3, 0.4, 0.5]
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"local coordinate systems \(data set 2420\)"):
        read_uff(written(tmp_path / "b.uff", systems(turned), nodes(), mode()))


@pytest.mark.parametrize(("arguments", "options", "message"), [
    (([13],), {}, "there is no node 13 in the modes; its nodes run from 11 to 40"),
    (([11],), {"B": 99}, "there is no node 99"),
    (([11],), {"axes": ("x", "w")}, "axis 'w' must be 'x', 'y' or 'z'"),
    (([11],), {"axes": ("x", "-x")}, "must be two different directions"),
    (([],), {}, "contact is empty"),
])
def test_points_are_checked(tmp_path, arguments, options, message):
    modes = read_uff(written(tmp_path / "a.uff", nodes(), mode()))
    with pytest.raises(InputError, match=message):
        modes.modal_basis(*arguments, **options)


def test_damaged_files(tmp_path):
    text = BLOCK.read_text()
    damaged = tmp_path / "damaged.uff"
    damaged.write_text(text.replace("0.00000e+00", "0.0000xe+00", 40))
    with pytest.raises(InputError, match=r"damaged\.uff: data set 3 of the file, of type 55, can"
                                         r"not be read"):
        read_uff(damaged)
    # One value at a node, where three are announced.
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if line.strip() == "55") + 9
    shortened = [line[:13] if start < k < start + 40 and len(line) == 39 else line
                 for k, line in enumerate(lines)]
    damaged.write_text("\n".join(shortened) + "\n")
    with pytest.raises(InputError, match=r"damaged\.uff: "):
        read_uff(damaged)
    other = tmp_path / "other.uff"
    other.write_text("no universal file\n")
    with pytest.raises(InputError, match=r"other\.uff: The file holds no modes"):
        read_uff(other)
    with pytest.raises(InputError, match=r"missing\.uff: there is no such file"):
        read_uff(tmp_path / "missing.uff")


def test_without_pyuff(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyuff", None)
    with pytest.raises(MissingLibraryError, match=r"fecontact\[data\]"):
        read_uff(BLOCK)
