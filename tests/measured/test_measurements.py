"""Files of measurements: values, units, and errors that are reported."""

import h5py
import nptdms
import numpy as np
import pytest
import pyuff
import sdypy_sep005.sep005 as sep005
from scipy.io import savemat

import fecontact as fc
from fecontact.io import read_measurement, read_measurements, write_uff
from fecontact.measured import Channel, Measurement, from_sep005, ring_down
from fecontact.measured.measured_units import parted, si_unit

TIME = np.linspace(0.0, 1.0, 513)
MOTION = 2.5 * np.exp(-3.0 * TIME) * np.cos(250.0 * TIME)
HERTZ = np.linspace(10.0, 60.0, 101)
W = 2.0 * np.pi * HERTZ
RECEPTANCE = 1.0 / (2.0 * ((2.0 * np.pi * 40.0) ** 2 - W**2 + 0.04j * 2.0 * np.pi * 40.0 * W))


@pytest.mark.parametrize(("symbol", "unit", "factor"), [
    ("mm", "m", 1e-3), ("g", "m/s^2", 9.80665), ("mm/s²", "m/s^2", 1e-3), ("m/s2", "m/s^2", 1.0),
    ("kN", "N", 1e3), ("ms", "s", 1e-3), ("g/N", "m/s^2/N", 9.80665), ("um/N", "m/N", 1e-6),
    ("mm/s/kN", "m/s/N", 1e-6), ("in", "m", 0.0254), ("deg/s", "rad/s", np.pi / 180.0),
    ("rad/(N m)", "rad/(N m)", 1.0), ("kHz", "Hz", 1e3)])
def test_units(symbol, unit, factor):
    found = si_unit(symbol)
    assert found is not None
    assert found[0] == unit
    assert found[1] == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize("symbol", ["V", "furlong", "m/V", "/s", "mm/", "N/s^2"])
def test_units_that_are_not_known(symbol):
    assert si_unit(symbol) is None


def test_titles():
    assert parted("B displacement x [mm]") == ("B displacement x", "mm")
    assert parted("x (mm/s^2)") == ("x", "mm/s^2")
    assert parted(" x ") == ("x", None)


def csv(path, text):
    path.write_text(text)
    return path


def test_text_with_titles(tmp_path):
    rows = "\n".join(f"{1e3 * t:.12g};{x:.12g};{0.5 * x:.12g}" for t, x in
                     zip(TIME, MOTION, strict=True)).replace(".", ",")
    path = csv(tmp_path / "a.csv", f"# a test\nt [ms];tip [mm];force [kN]\n{rows}\n")
    found = read_measurement(path)
    assert found.axis == "time"
    assert found.names == ("tip", "force")
    assert found.abscissa == pytest.approx(TIME, abs=1e-12)
    assert found.values[:, 0] == pytest.approx(1e-3 * MOTION, abs=1e-12)
    assert found.values[:, 1] == pytest.approx(500.0 * MOTION, abs=1e-6)
    assert [one.unit for one in found.channels] == ["m", "N"]
    assert found.notes == ()
    assert found.problems == ()
    assert found.series("tip")[2:] == ("m", "tip")
    curve = ring_down(found, channel="tip", frequency_hz=40.0)
    direct = ring_down(TIME, 1e-3 * MOTION, frequency_hz=40.0)
    assert curve.frequency_hz == pytest.approx(direct.frequency_hz, rel=1e-6)
    assert curve.amplitude == pytest.approx(direct.amplitude, rel=1e-6)


def test_a_run_that_was_exported_is_read(tmp_path):
    row = np.array([[1.0], [0.0], [0.0]])
    run = fc.simulate(fc.ContactSystem(fc.basis_from_matrices(
        [[2.0]], [[5e4]], {"B": row, "C": row})), 0.1, initial=[1e-3, 0.0], outputs=101)
    found = read_measurement(fc.io.export_csv(run, tmp_path / "run.csv"))
    names = [one.name for one in found.channels if one.name.startswith("B displacement x")]
    assert found.values[:, found.index(names[0])] == pytest.approx(run.displacement("B")[:, 0])


def test_complex_channels_and_coherence(tmp_path):
    lines = [f"{f:.10g}, {h.real:.14g}, {h.imag:.14g}, 0.99" for f, h in
             zip(HERTZ, 1e3 * RECEPTANCE, strict=True)]
    path = csv(tmp_path / "a.csv", "\n".join(
        ["frequency [Hz], H re [mm/N], H im [mm/N], H coherence", *lines]))
    found = read_measurement(path)
    assert found.axis == "frequency"
    assert found.names == ("H",)
    assert found.values[:, 0] == pytest.approx(RECEPTANCE, rel=1e-10)
    assert found.channels[0].unit == "m/N"
    assert (found.coherence == 0.99).all()


def test_matlab_and_hdf5(tmp_path):
    savemat(tmp_path / "a.mat", {"test": {
        "t": TIME, "x": np.column_stack([MOTION, 2.0 * MOTION]),
        "units": {"t": "s", "x": "mm"}}, "comment": "none"})
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("shaker")
        group["time"] = TIME
        group["x"] = np.stack([MOTION, 2.0 * MOTION])
        group["x"].attrs["unit"] = "mm"
        group["FRF/f"] = HERTZ
        group["FRF/H"] = RECEPTANCE
    mat, = read_measurements(tmp_path / "a.mat")
    assert mat.names == ("x 1", "x 2")
    both = read_measurements(tmp_path / "a.h5")
    assert [one.axis for one in both] == ["time", "frequency"]
    for one in (mat, both[0]):
        assert one.values[:, 1] == pytest.approx(2e-3 * MOTION)
        assert [channel.unit for channel in one.channels] == ["m", "m"]
    assert both[1].values[:, 0] == pytest.approx(RECEPTANCE)
    assert "no unit" in " ".join(both[1].notes)
    assert read_measurement(tmp_path / "a.h5", axis="frequency").names == ("H",)


def tdms(path, channels):
    """A file written by npTDMS: group, name, values and properties of each channel."""
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject(*one) for one in channels])
    return path


def test_tdms(tmp_path):
    step = {"wf_increment": TIME[1], "wf_start_offset": 0.5}
    path = tdms(tmp_path / "a.tdms", [
        ("test", "tip", MOTION, {**step, "unit_string": "mm"}),
        ("test", "force", 2.0 * MOTION, {**step, "NI_UnitDescription": "kN"}),
        ("slow", "tip", MOTION[::4], {"wf_increment": TIME[4]}),
        ("table", "time", TIME, {"unit_string": "s"}), ("table", "x", MOTION, {})])
    by_size = {one.values.size: one for one in read_measurements(path)}
    table, test, slow = (by_size.pop(n) for n in (513, 1026, 129))
    assert by_size == {}
    assert test.names == ("tip", "force")
    assert test.abscissa == pytest.approx(0.5 + TIME)
    assert test.values == pytest.approx(np.column_stack([1e-3 * MOTION, 2e3 * MOTION]))
    assert [one.unit for one in test.channels] == ["m", "N"]
    assert slow.abscissa == pytest.approx(TIME[::4])
    assert "no unit" in slow.notes[0]
    assert table.values[:, 0] == pytest.approx(MOTION)
    tdms(path, [("test", "tip", MOTION, {})])
    with pytest.raises(fc.InputError, match="neither the property wf_increment nor a channel"):
        read_measurements(path)
    path.write_bytes(b"TDSm" + bytes(50))
    with pytest.raises(fc.InputError, match="is not readable as a measurement"):
        read_measurements(path)


def test_time_series_of_sep005():
    one = {"data": MOTION, "name": "tip", "unit_str": "mm", "fs": 512.0, "quantity": "d"}
    other = {"data": MOTION.tolist(), "name": "force", "unit_str": "kN", "time": TIME.tolist()}
    sep005.assert_sep005([one, other])
    both, = from_sep005([one, other])
    assert both.names == ("tip", "force")
    assert both.abscissa == pytest.approx(TIME)
    assert both.values == pytest.approx(np.column_stack([1e-3 * MOTION, 1e3 * MOTION]))
    assert len(from_sep005([one, {**other, "group": "b"}])) == 2
    for wrong, told in (
            ([], "no channel"), ([3], "series must be"),
            ({"data": MOTION, "name": "tip"}, "channel 0 has no 'unit_str'"),
            ({**one, "fs": None}, "neither 'fs' nor 'time'"), ({**one, "fs": 0.0}, "fs = 0.0"),
            ({**other, "time": TIME[1:]}, "512 times for 513 values"),
            ({**one, "data": [[1.0, 2.0]]}, "two values or more"),
            ([one, one], "are called 'tip'")):
        with pytest.raises(fc.InputError, match=told):
            from_sep005(wrong)


def test_universal_files_come_back(tmp_path):
    H = np.column_stack([RECEPTANCE, 2.0 * RECEPTANCE])
    given = Measurement(HERTZ, H, (
        Channel("a", "m/N", 7, "+x", 12, "-y"), Channel("b", "m/N", 8, "-z", 12, "-y")),
        "frequency", np.full(H.shape, 0.97))
    found = read_measurement(write_uff(given, tmp_path / "a.uff"))
    assert found.axis == "frequency"
    assert found.abscissa == pytest.approx(HERTZ, rel=1e-5)
    assert found.values == pytest.approx(H, rel=1e-10)
    assert found.coherence == pytest.approx(np.full(H.shape, 0.97))
    assert [(one.node, one.direction, one.reference_node, one.reference_direction, one.unit)
            for one in found.channels] == [(7, "+x", 12, "-y", "m/N"), (8, "-z", 12, "-y", "m/N")]
    # In time, unevenly too.
    for t in (TIME, TIME + 1e-4 * np.sin(40.0 * TIME)):
        history = Measurement(t, MOTION, (Channel("a", "m/s^2", 3, "-z"),))
        found = read_measurement(write_uff(history, tmp_path / "b.uff"))
        assert found.abscissa == pytest.approx(t, abs=2e-5)
        assert found.values[:, 0] == pytest.approx(MOTION, abs=1e-11)
        assert found.channels[0].unit == "m/s^2"


def function(**changes):
    return {"type": 58, "binary": 0, "func_type": 4, "rsp_node": 1, "rsp_dir": 3, "ref_node": 2,
            "ref_dir": 3, "data": np.array(RECEPTANCE), "x": np.array(HERTZ),
            "abscissa_spacing": 1, "abscissa_spec_data_type": 18, "ordinate_spec_data_type": 8,
            "orddenom_spec_data_type": 13, **changes}


def units(length, force):
    return {"type": 164, "units_code": 9, "units_description": "user", "temp_mode": 1,
            "length": length, "force": force, "temp": 1.0, "temp_offset": 0.0}


# pyuff leaves a file of binary data open after writing it.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning",
                            "ignore::ResourceWarning")
def test_binary_universal_files(tmp_path):
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets([function(binary=1), function(
        binary=1, rsp_node=5, data=np.array(2.0 * RECEPTANCE))], mode="add")
    found = read_measurement(tmp_path / "a.uff")
    assert [one.node for one in found.channels] == [1, 5]
    assert found.values == pytest.approx(np.column_stack([RECEPTANCE, 2.0 * RECEPTANCE]), rel=1e-14)


def test_units_of_universal_files(tmp_path):
    """Without labels by data set 164: here millimetres and kilonewtons."""
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets([units(1e3, 1e-3), function()], mode="add")
    found = read_measurement(tmp_path / "a.uff")
    assert found.channels[0].unit == "m/N"
    assert found.values[:, 0] == pytest.approx(1e-6 * RECEPTANCE, rel=1e-10)
    # A label takes precedence, and a note reports the contradiction.
    pyuff.UFF(str(tmp_path / "b.uff")).write_sets([units(1e3, 1.0), function(
        ordinate_axis_units_lab="m", orddenom_axis_units_lab="N")], mode="add")
    found = read_measurement(tmp_path / "b.uff")
    assert found.values[:, 0] == pytest.approx(RECEPTANCE, rel=1e-10)
    assert "by a factor of 0.001: the label was taken" in found.notes[0]
    given = read_measurement(tmp_path / "b.uff", units={found.names[0]: "mm/N"})
    assert given.values == pytest.approx(1e-3 * found.values)


def test_what_looks_wrong_is_told():
    def problems(values=MOTION, time=TIME, unit="mm/s"):
        return " ".join(Measurement(time, values, (Channel("x", unit),)).problems)

    assert problems() == ""
    assert "reaches 2.5 m: is it in mm, a thousandth?" in problems(unit="m")
    holes = MOTION.copy()
    holes[[5, 9]] = np.nan
    assert "2 values that are no number, the first at 0.00976562 s" in problems(holes)
    gap = np.delete(TIME, slice(100, 120))
    assert "1 gap, the first of 0.04102 s" in problems(np.delete(MOTION, slice(100, 120)), gap)
    late = TIME.copy()
    late[200:] -= 0.1
    assert "do not ascend after 0.388672 s, in row 200" in problems(time=late)
    assert "not even: steps are" in problems(time=TIME + 1e-4 * np.sin(40.0 * TIME))
    assert "largest value, 1 mm/s, for" in problems(np.clip(MOTION, -1.0, 1.0))
    with pytest.raises(fc.InputError, match=r"leave that part out \(between, or t_start"):
        ring_down(Measurement(TIME, holes, ("x",)))
    part = Measurement(TIME, holes, ("x",)).between(0.1, 0.5)
    assert part.problems == ()
    assert part.abscissa[[0, -1]] == pytest.approx([0.1, 0.5], abs=2e-3)
    scaled = Measurement(TIME, MOTION, (Channel("x", "m"),)).with_units({"x": "mm"})
    assert scaled.problems == ()
    assert scaled.values[:, 0] == pytest.approx(1e-3 * MOTION)


@pytest.mark.parametrize(("name", "text", "told"), [
    ("a.csv", "", "it has no two lines of two numbers"),
    ("a.csv", "t [s], x\n0, 1\n1, a\n", "line 3 has 2 columns, or a text"),
    ("a.csv", "t [s], x\n0, 1\n1, 2, 3\n", "line 3 has 3 columns"),
    ("a.csv", "t [s]\n0, 1\n1, 2\n", "line of titles has 1 entries for 2 columns"),
    ("a.csv", "length, x\n0, 1\n1, 2\n", "call it time"),
    ("a.csv", "t [mm], x\n0, 1\n1, 2\n", "must be in s, not in 'mm'"),
    ("a.csv", "t [s], x [m], x [N]\n0, 1, 1\n1, 2, 2\n", "has a name twice"),
    ("a.xlsx", "", "are not read from files of this kind"),
    ("a.mat", "nothing", "not readable as a measurement"),
    ("a.h5", "nothing", "not readable as a measurement"),
    ("a.uff", "nothing", "58"),
])
def test_files_that_are_no_measurements(name, text, told, tmp_path):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(fc.InputError, match=told) as error:
        read_measurement(path)
    assert str(error.value).startswith(str(path))


@pytest.mark.parametrize(("call", "told"), [
    (lambda m: Measurement(TIME, MOTION, ("a", "b")), "a column for each of the 2 channels"),
    (lambda m: Measurement(TIME, np.stack([MOTION] * 2, 1), ("a", "a")), "are called 'a'"),
    (lambda m: Measurement(TIME, MOTION, ("a",), "place"), "must be 'time' or 'frequency'"),
    (lambda m: Measurement(TIME, MOTION, ("a",), coherence=np.ones(3)), "coherence"),
    (lambda m: Channel("a", direction="x"), "must be a sign and one of x"),
    (lambda m: m.index("c"), "has no channel 'c'"),
    (lambda m: m.index(2), "must be from 0 to 1"),
    (lambda m: m.series(), "has 2 channels; name one of"),
    (lambda m: m.between(2.0, 3.0), "fewer than two rows"),
    (lambda m: m.with_units({"a": "V"}), "the unit 'V' of channel 'a' is not known"),
    (lambda m: ring_down(m, channel="a", point="B"), "point is not known here"),
    (lambda m: write_uff(m, "a.csv"), "must end in .uff"),
    (lambda m: read_measurement("none.csv"), "there is no such file"),
    (lambda m: read_measurement("none.csv", axis="place"), "must be 'time' or 'frequency'"),
])
def test_wrong_arguments(call, told):
    with pytest.raises(fc.InputError, match=told):
        call(Measurement(TIME, np.stack([MOTION] * 2, 1), ("a", "b")))


def test_the_command_prints_what_is_in_a_file(cli, tmp_path):
    rows = "\n".join(f"{t:.8f}, {x:.8f}" for t, x in zip(TIME, MOTION, strict=True))
    path = csv(tmp_path / "a.csv", f"t [s], tip [m]\n{rows}\n")
    code, out, _ = cli("data", str(path))
    assert code == 0
    assert "reaches 2.5 m" in out.replace("\n", " ")
    code, out, _ = cli("data", str(path), "--unit", "tip=mm", "-o", str(tmp_path / "a.uff"))
    assert code == 0
    assert "0.0025" in out
    assert read_measurement(tmp_path / "a.uff").values[:, 0] == pytest.approx(
        1e-3 * MOTION, abs=1e-10)
    assert cli("data", str(path), "--unit", "tip")[0] == 1
    code, _, told = cli("data", str(path), "--unit", "tap=mm")
    assert code == 1
    assert "did you mean 'tip'" in told
