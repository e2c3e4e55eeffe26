"""Files of results that were cut, changed or made up: one sentence each, and nothing else."""

import json
import warnings
from contextlib import suppress
from dataclasses import replace
from itertools import product

import h5py
import numpy as np
import pytest
import response_study
from sweep_study import Serial, write_study
from synthetic import basis, run
from systems import TURN

from fecontact import InputError, read_case, sweep, write_case
from fecontact.bifurcation import (
    Branch,
    BranchPoint,
    BranchStatus,
    HarmonicBalance,
    frequency_response,
)
from fecontact.bifurcation.continuation.points import details_of
from fecontact.cli import execute
from fecontact.core.files import hdf5_check
from fecontact.core.files.hdf5_check import append_checksum
from fecontact.core.files.stored import DamagedError, npz_arrays
from fecontact.integrate import Events
from fecontact.io import (
    read_basis,
    read_branches,
    read_response,
    read_table,
    report,
    write_basis,
    write_branch,
    write_branches,
    write_response,
)
from fecontact.study import Span


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    path = tmp_path_factory.mktemp("case") / "case.vtkhdf"
    trajectory = run(basis(contact_nodes=3), times=7)
    events = Events(np.array([0.01]), ("stick",), np.array([1]), trajectory.states[:1])
    object.__setattr__(trajectory, "events", events)
    return write_case(path, trajectory, frames=0, study='[ground]\nspeed = 0.1\n')


def longer(name):
    """A change of a file: one more row of a dataset."""
    def change(file):
        data = file[name][()]
        del file[name]
        file[name] = np.concatenate([data, data[:1]])
    return change


def other(name, data):
    """A change of a file: something else in the place of a dataset."""
    def change(file):
        del file[name]
        file[name] = data
    return change


def huge(name, shape):
    """A change of a file: a dataset that is said to be large, without its values."""
    def change(file):
        del file[name]
        file.create_dataset(name, shape=shape, dtype="f8")
    return change


def attribute(group, name, value):
    """A change of a file: an attribute."""
    def change(file):
        file[group].attrs[name] = value
    return change


def external(name):
    """A change of a file: values that lie in another file."""
    def change(file):
        del file[name]
        file.create_dataset(name, shape=(7,), dtype="f8", external=[("/etc/passwd", 0, 56)])
    return change


def linked(name):
    """A change of a file: a link into another file."""
    def change(file):
        del file[name]
        file[name] = h5py.ExternalLink("other.h5", "/x")
    return change


DAMAGES = {
    "not-json": attribute("system", "json", "{ not json"),
    "json-list": attribute("system", "json", "[1, 2]"),
    "json-number": attribute("system", "json", 5),
    "json-deep": attribute("system", "json", "[" * 100_000),
    "json-digits": attribute("system", "json", '{"gap": ' + "9" * 5000 + "}"),
    "json-wrong": attribute("system", "json", '{"ground": 3}'),
    "json-contact": attribute("system", "json", '{"interfaces": [1]}'),
    "json-group": attribute("system", "json", '{"interfaces": {"contact": {"drive": {}}}}'),
    "json-gap": attribute("system", "json", '{"gap": "wide"}'),
    "json-file": attribute("system", "json", '{"ground": {"height_map": {"file": "h.txt"}}}'),
    "json-device": attribute("system", "json", '{"normal": {"law": "measured-surface", "file": '
                                               '"/dev/zero"}}'),
    "no-json": lambda file: file["system"].attrs.pop("json"),
    "no-system": lambda file: file.pop("system"),
    "statistics": attribute("trajectory", "statistics", '"fast"'),
    "status": attribute("trajectory", "status", "DONE"),
    "status-number": attribute("trajectory", "status", 3),
    "study": attribute("study", "toml", "[[[ not toml"),
    "study-deep": attribute("study", "toml", "a = " + "[" * 5000),
    "study-number": attribute("study", "toml", 1.0),
    "time-long": longer("trajectory/time"),
    "time-back": other("trajectory/time", np.linspace(1.0, 0.0, 7)),
    "time-nan": other("trajectory/time", np.full(7, np.nan)),
    "time-text": other("trajectory/time", [b"a"] * 7),
    "time-scalar": other("trajectory/time", 1.0),
    "time-empty": other("trajectory/time", h5py.Empty("f8")),
    "time-huge": huge("trajectory/time", (10**12,)),
    "time-external": external("trajectory/time"),
    "time-linked": linked("trajectory/time"),
    "q-long": longer("trajectory/modal_coordinates"),
    "q-narrow": other("trajectory/modal_coordinates", np.zeros((7, 2))),
    "q-huge": huge("trajectory/modal_coordinates", (7, 10**12)),
    "rate-flat": other("trajectory/modal_velocities", np.zeros(7)),
    "work-complex": other("trajectory/work", np.zeros((7, 8), dtype=complex)),
    "work-narrow": other("trajectory/work", np.zeros((7, 3))),
    "friction-work": lambda file: file["trajectory"].create_dataset(
        "node_friction_work", data=np.zeros((7, 99))),
    "states-of-memory": lambda file: file["trajectory"].create_dataset(
        "memory", data=np.zeros((7, 3))),
    "event-node": other("trajectory/events/node", np.array([99])),
    "event-time": longer("trajectory/events/time"),
    "event-kind": other("trajectory/events/kind", np.array([1])),
    "event-states": other("trajectory/events/states", np.zeros((1, 3))),
    "event-group": other("trajectory/events", 1.0),
    "trajectory": other("trajectory", np.zeros(3)),
    "basis": other("basis", np.zeros(3)),
    "frequencies": huge("basis/angular_frequencies", (10**11,)),
    "damping": other("basis/damping", np.zeros((2, 3))),
    "rows": other("basis/T", np.zeros((1, 3, 5))),
    "tributary": other("basis/tributary", np.zeros(3)),
    "tributary-long": longer("basis/tributary"),
    "groups": attribute("basis", "group_sizes", [1, 2]),
    "groups-text": attribute("basis", "group_sizes", ["x"]),
    "groups-large": attribute("basis", "group_sizes", [10**15]),
    "extra": attribute("basis", "extra", ["E"] * 5),
    "cells": lambda file: file["basis/mode_shapes/cells"].write_direct(
        np.full(file["basis/mode_shapes/cells"].shape, 10**9)),
    "outline": lambda file: file["basis/mode_shapes/outline"].write_direct(
        np.full(file["basis/mode_shapes/outline"].shape, -1)),
    "shapes": other("basis/mode_shapes/shapes", np.zeros((3, 2, 5))),
    "restriction": lambda file: file["basis/mode_shapes/restriction/indices"].write_direct(
        np.full(file["basis/mode_shapes/restriction/indices"].shape, 10**6,
                dtype=file["basis/mode_shapes/restriction/indices"].dtype)),
    "restriction-starts": lambda file: file["basis/mode_shapes/restriction/indptr"].write_direct(
        file["basis/mode_shapes/restriction/indptr"][()][::-1].copy()),
    "restriction-shape": attribute("basis/mode_shapes/restriction", "shape", [10**12, 10**12]),
    "restriction-short": other("basis/mode_shapes/restriction/data", np.zeros(1)),
}


@pytest.mark.parametrize("change", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_run_is_one_sentence(case, change, tmp_path):
    path = tmp_path / "damaged.vtkhdf"
    path.write_bytes(case.read_bytes())
    with h5py.File(path, "a") as file:
        change(file)
    append_checksum(path)
    with pytest.raises(InputError) as caught:
        read_case(path)
    said = str(caught.value)
    assert said.startswith(str(path))
    assert "\n" not in said
    assert len(said) < 700


def test_a_stored_system_that_names_a_file_of_data_is_refused(case, tmp_path):
    """The file is not opened: it may be a pipe, or another file than that of the run."""
    path = tmp_path / "named.vtkhdf"
    path.write_bytes(case.read_bytes())
    with h5py.File(path, "a") as file:
        DAMAGES["json-device"](file)
    append_checksum(path)
    with pytest.raises(InputError, match=r"names the file '/dev/zero', where its data must be"):
        read_case(path)


def test_a_run_cut_anywhere_is_refused(case, tmp_path):
    whole, path = case.read_bytes(), tmp_path / "cut.vtkhdf"
    for place in np.linspace(0, len(whole) - 27, 6).astype(int):
        path.write_bytes(whole[:place])
        with pytest.raises(InputError, match=r"cut\.vtkhdf"):
            read_case(path)


def test_a_run_with_turned_bits_is_refused_at_once(case, tmp_path):
    whole, path = bytearray(case.read_bytes()), tmp_path / "turned.vtkhdf"
    for place in np.linspace(100, len(whole) - 1, 40).astype(int):
        turned = bytearray(whole)
        turned[place] ^= 1
        path.write_bytes(turned)
        with pytest.raises(InputError, match=r"turned\.vtkhdf is not an HDF5 file, or is damaged"):
            read_case(path)


def test_a_file_that_the_library_never_ends_reading_is_refused(tmp_path, monkeypatch):
    limited = hdf5_check._CHECK.replace("def read(", "while True: pass\ndef read(")
    assert limited != hdf5_check._CHECK
    monkeypatch.setattr(hdf5_check, "_CHECK", limited)
    monkeypatch.setattr(hdf5_check, "_PATIENCE", 0.5)
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["basis"] = 1.0
    with pytest.raises(InputError, match="fails to read it to its end"):
        read_basis(path)


def test_a_file_to_which_others_have_added_is_read(case, tmp_path):
    path = tmp_path / "added.vtkhdf"
    path.write_bytes(case.read_bytes())
    with h5py.File(path, "a") as file:
        file.attrs["note"] = "x" * 5000
    assert np.array_equal(read_case(path).trajectory.states, read_case(case).trajectory.states)


def branches():
    points = tuple(BranchPoint(np.array([0.1 * k, 1.0 + k]), np.array([1.0, 0.0]),
                               {"stable": True, "observed": 0.2 * k},
                               "fold" if k == 1 else None,
                               {"coefficient": 3.0} if k == 1 else {}) for k in range(4))
    return {"main": Branch("ground.speed", points, BranchStatus.BOUND, "", {"nodes": 4})}


@pytest.mark.parametrize("change", [
    longer("branches/0/u"), other("branches/0/u", np.zeros(3)), huge("branches/0/u", (4, 10**12)),
    longer("branches/0/tangent"), other("branches/0/kind", np.zeros(4)),
    longer("branches/0/values/observed"), huge("branches/0/values/observed", (10**12,)),
    other("branches/0/values", 1.0), attribute("branches/0", "status", "GOOD"),
    attribute("branches/0", "parameter", 3), lambda file: file.move("branches/0", "branches/x"),
    other("branches/0/details/1/coefficient", h5py.Empty("f8")),
    other("branches/0", np.zeros(2)), linked("branches/0/u"),
])
def test_a_damaged_branch_is_one_sentence(change, tmp_path):
    path = write_branches(tmp_path / "b.h5", branches())
    found = read_branches(path)["main"]
    assert [point.kind for point in found.points] == [None, "fold", None, None]
    assert details_of(found.points[1]) == {"coefficient": 3.0}
    assert found.points[1].coefficient == 3.0
    assert np.array_equal(found.column("observed"), 0.2 * np.arange(4))
    with h5py.File(path, "a") as file:
        change(file)
    append_checksum(path)
    with pytest.raises(InputError) as caught:
        read_branches(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_file_of_branches_is_no_run(tmp_path):
    system = run(times=3).system
    points = tuple(BranchPoint(np.array([0.1 * k, 1.0 + k]), np.array([1.0, 0.0]),
                               {"state": np.zeros(1)}) for k in range(2))
    path = write_branches(tmp_path / "a.h5", {"a": Branch("p", points)}, system=system)
    with pytest.raises(InputError, match="holds branches but no run; read it with read_branches"):
        read_case(path)


def test_a_file_of_one_branch_is_no_response(tmp_path):
    points = tuple(BranchPoint(np.array([0.1 * k, 1.0 + k]), np.array([1.0, 0.0]),
                               {"state": np.zeros(1)}) for k in range(2))
    path = write_branch(tmp_path / "a.h5", Branch("p", points))
    with pytest.raises(InputError, match="holds no 'branches', but 'branch'; read it with read_b"):
        read_response(path)


def test_a_damaged_basis_is_one_sentence(tmp_path):
    path = tmp_path / "basis.h5"
    write_basis(path, run(times=3).system.basis)
    with h5py.File(path, "a") as file:
        huge("basis/T", (10**6, 3, 10**6))(file)
    append_checksum(path)
    with pytest.raises(InputError, match=r"basis\.h5 is damaged"):
        read_basis(path)


SHARDS = {
    "text": "not json", "deep": "[" * 100_000, "list": "[1, 2]", "no-rows": "{}",
    "number": '{"rows": 3}', "rows": '{"rows": [1]}', "part": '{"rows": [{"case": "x"}]}',
    "case": '{"rows": [{"case": 3, "values": {}, "reason": ""}]}',
    "values": '{"rows": [{"case": "x", "values": [1], "reason": ""}]}',
    "value": '{"rows": [{"case": "x", "values": {"a": "b"}, "reason": ""}]}',
    "reason": '{"rows": [{"case": "x", "values": {}, "reason": null}]}',
    "points": '{"rows": [{"case": "x", "values": {}, "reason": "", "points": ["a"]}]}',
    "digits": '{"rows": ' + "9" * 5000 + "}",
}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("swept")
    study = write_study(folder)
    sweep(study, {"ground.speed": Span(1e-3, 2e-3, 2)}, Serial(), folder=folder / "f",
          summaries=["amplitude_x"])
    return study, folder / "f"


@pytest.mark.parametrize("content", SHARDS.values(), ids=SHARDS.keys())
def test_a_damaged_shard_is_one_sentence(swept, content):
    study, folder = swept
    shard = folder / "shards" / ("0" * 24 + ".json")
    shard.write_text(content)
    try:
        with pytest.raises(InputError) as caught:
            sweep(study, {"ground.speed": Span(1e-3, 2e-3, 2)}, Serial(), folder=folder,
                  summaries=["amplitude_x"], resume=True)
        assert str(caught.value).startswith(
            f"{shard} is damaged; remove it, and its cases are computed again")
        assert "\n" not in str(caught.value)
    finally:
        shard.unlink()


def test_stored_displacements_of_another_number_are_refused(swept, tmp_path):
    study, _ = swept
    options = {"strobe": {"keep": 3, "transient_periods": 1}}
    axes = {"ground.speed": [1e-3]}
    sweep(study, axes, Serial(), folder=tmp_path / "f", **options)
    (shard,) = (tmp_path / "f" / "shards").glob("*.json")
    stored = json.loads(shard.read_text())
    stored["rows"][0]["points"] = [1.0, 2.0]
    shard.write_text(json.dumps(stored))
    with pytest.raises(InputError, match="has 2 displacements, one a period, not 3"):
        sweep(study, axes, Serial(), folder=tmp_path / "f", resume=True, **options)


@pytest.mark.parametrize("content", [
    "", "case\n", "case,key,ground.speed,status,reason\n0,x,[[[[,finished,\n",
    "case,key,ground.speed,status,reason\n0,x," + "[" * 100_000 + ",finished,\n",
    "case,key,status,reason\n0,x,finished\n", "a\0b", "x" * 200_000,
])
def test_a_damaged_table_is_one_sentence(content, tmp_path):
    (tmp_path / "index.csv").write_text(content)
    with pytest.raises(InputError, match=r"index\.csv is not the table of a sweep"):
        read_table(tmp_path / "index.csv")


def test_sweeps_remove_only_what_they_made(swept, tmp_path):
    study, _ = swept
    place = tmp_path / "here"
    for name in ("notes.part", "thesis.part1.tex", "cases/mine.vtkhdf", "bases/mine.h5",
                 "shards/mine.json"):
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text("of the user")
    for _ in range(2):
        sweep(study, {"ground.speed": [1e-3]}, Serial(), folder=place, overwrite=True,
              summaries=["amplitude_x"], keep="histories")
    mine = [path for path in place.rglob("*") if path.is_file()
            and path.read_bytes() == b"of the user"]
    assert len(mine) == 5
    assert len(list((place / "shards").iterdir())) == 2
    text = study.read_text()
    (tmp_path / "sweep.toml").write_text(text)
    with pytest.raises(InputError, match=r"would write .*sweep\.toml in the place of its study"):
        sweep(tmp_path / "sweep.toml", {"ground.speed": [1e-3]}, Serial(), folder=tmp_path)
    assert (tmp_path / "sweep.toml").read_text() == text


def test_arrays_that_a_file_does_not_hold(tmp_path):
    import zipfile

    header = np.lib.format.magic(1, 0)
    text = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }"
    text = text.ljust(117) + "\n"
    header += len(text).to_bytes(2, "little") + text.encode()
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("x.npy", header)
    with pytest.raises(DamagedError, match="not held by the file"):
        npz_arrays(tmp_path / "a.npz")
    np.savez_compressed(tmp_path / "b.npz", x=np.zeros((2000, 500)),
                        y=np.asfortranarray(np.arange(6.0).reshape(2, 3)), z=np.array(3))
    found = npz_arrays(tmp_path / "b.npz")
    assert found["x"].shape == (2000, 500)
    assert np.array_equal(found["y"], np.arange(6.0).reshape(2, 3))
    assert found["z"] == 3


@pytest.fixture(scope="module")
def response(tmp_path_factory):
    """A small response, whose orbits are Fourier coefficients, with the study that it is of."""
    described = response_study.study()
    found = frequency_response(described.system(), (50.0 / TURN, 55.0 / TURN),
                               method=HarmonicBalance(3, 32))
    return write_response(tmp_path_factory.mktemp("response") / "response.h5", found,
                          system=described.system(), study=response_study.STUDY)


def without(group, name):
    """A change of a file: an attribute or dataset that it lacks."""
    def change(file):
        del file[group][name]
    return change


def filled(name, value):
    """A change of a file: one value everywhere in a dataset."""
    return lambda file: other(name, np.full(file[name].shape, value))(file)


ATTRIBUTES, VALUES = "branches/0/attributes", "branches/0/values"


@pytest.mark.parametrize("change", [
    *(without(ATTRIBUTES, name) for name in (
        "displacements", "level_name", "memory", "memory_nodes", "method", "observed", "periods",
        "state_names")),
    *(without(VALUES, name) for name in (
        "memory", "observed_amplitude", "period", "truncation_error")),
    *(filled(f"{ATTRIBUTES}/{name}", 2**40) for name in ("displacements", "memory", "periods")),
    other(f"{ATTRIBUTES}/level", "high"), other(f"{ATTRIBUTES}/level", np.ones(2)),
    other(f"{ATTRIBUTES}/level", 1j), other(f"{ATTRIBUTES}/observed", 3.0),
    other(f"{ATTRIBUTES}/state_names", "qqqqq"), other(f"{ATTRIBUTES}/state_names", ["q1"]),
    other(f"{ATTRIBUTES}/scales", 1.0), other(f"{ATTRIBUTES}/method", 3.0),
    *(filled(f"{VALUES}/observed_amplitude", value) for value in (np.nan, np.inf)),
    filled(f"{VALUES}/unstable", np.nan), filled("branches/0/u", np.nan),
    filled("branches/0/u", 1e300), filled("branches/0/tangent", -np.inf),
    *(other(f"{ATTRIBUTES}/method", value) for value in (
        "", "3", "{}", '{"name": "shooting", "segments": 2}', '{"name": "collocation", "x": 1}',
        *(f'{{"name": "harmonic balance", "harmonics": {value}}}'
          for value in ("-1", "[1, 4]", "[1.0, 3.0]", "[-1, 1]", '"1"')))),
])
def test_a_damaged_response_is_one_sentence(response, change, tmp_path):
    path = tmp_path / "damaged.h5"
    path.write_bytes(response.read_bytes())
    with h5py.File(path, "a") as file:
        change(file)
    append_checksum(path)
    with pytest.raises(InputError) as caught:
        read_response(path)
    assert str(caught.value).startswith(f"{path} is damaged")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "value"), [
    *product(("nodes", "shapes", "restriction/data"), (np.nan, np.inf, 1e300)),
    ("stress", np.nan), ("stress", 1e300)])
def test_shapes_that_cannot_be_drawn_are_refused(case, name, value, tmp_path):
    path = tmp_path / "damaged.vtkhdf"
    path.write_bytes(case.read_bytes())
    with h5py.File(path, "a") as file:
        filled(f"basis/mode_shapes/{name}", value)(file)
    append_checksum(path)
    with pytest.raises(InputError, match=f"{name}' holds values that are not finite or beyond 1e"):
        read_case(path)


def test_reports_end_where_work_is_not_finite(case, tmp_path):
    """Work that is not finite, as after loads beyond all bounds or in damaged files."""
    found = read_case(case).trajectory
    work = found.work.copy()
    work[4:] = np.nan
    report(replace(found, work=work), tmp_path / "a.html")
    work[1:] = np.inf
    with pytest.raises(InputError, match="has no motion to report"):
        report(replace(found, work=work), tmp_path / "b.html")
    assert [path.name for path in tmp_path.iterdir()] == ["a.html"]


def parts_of(path):
    """Datasets of a file, and attributes of its groups, by path; attributes behind a bar."""
    found = {}
    with h5py.File(path) as file:
        def see(name, item):
            found.update({f"{name}|{key}": value for key, value in item.attrs.items()})
            if isinstance(item, h5py.Dataset):
                found[name] = item[()]
        file.visititems(see)
    return found


def worse(value):
    """Values of other kinds, shapes and sizes in the place of one."""
    array = np.asarray(value)
    kinds = ["x" * 60_000, "", "a\nb\x1b[1m", 3.0, 1j, np.nan, np.zeros((1, 1, 1, 1)),
             np.array([1.0, np.inf]), h5py.Empty("f8"), np.void(b"abc"), np.bytes_(b"\xff"), None]
    if array.dtype.kind in "fiub" and array.size:
        kinds += [np.full(array.shape, number) for number in (np.nan, np.inf, -1.0, 0.0, 1e300)]
        kinds += [np.full(array.shape, number) for number in (0, -3, 2**40)]
    if array.ndim:
        kinds += [array[:-1], np.concatenate([array, array[:1]]), array[::-1].copy()]
    return kinds


@pytest.mark.parametrize("kind", ["case", "response", "basis"])
def test_files_changed_anywhere_are_read_or_refused(kind, request, tmp_path, capsys):
    """A sample of all values in a file; what is read is reported, or refused, too."""
    path, whole = tmp_path / "changed.h5", tmp_path / "whole.h5"
    if kind == "basis":
        write_basis(whole, run(basis(contact_nodes=3), times=3).system.basis)
    else:
        whole.write_bytes(request.getfixturevalue(kind).read_bytes())
    changes = [(name, value) for name, old in parts_of(whole).items()
               if not name.startswith(("VTKHDF", "versions")) for value in worse(old)]
    chance = np.random.default_rng(7)
    read = {"case": read_case, "response": read_response, "basis": read_basis}[kind]
    for index in chance.permutation(len(changes))[:150]:
        name, value = changes[index]
        path.write_bytes(whole.read_bytes())
        with h5py.File(path, "a") as file:
            place, _, attribute_name = name.partition("|")
            members = file[place].attrs if attribute_name else file
            del members[attribute_name or place]
            with suppress(TypeError, ValueError, OSError):  # values that no file can hold
                if value is not None:
                    members[attribute_name or place] = value
        append_checksum(path)
        try:
            read(path)
        except InputError as error:
            said = str(error)
        else:
            said = ""
        assert "\n" not in said, (name, value)
        assert len(said) < 700, (name, value)
        if not said and kind == "response" and "basis" not in name:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                execute(["report", str(path), "-o", str(tmp_path / "a.html")])
            assert "should not happen" not in capsys.readouterr().err, (name, value)
