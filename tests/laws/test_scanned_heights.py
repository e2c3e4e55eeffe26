"""Scans of profilometers as heights, written by programs that do not read them here."""

import re
import struct
import warnings

import numpy as np
import pytest

import fecontact as fc
from fecontact.core import extras
from fecontact.laws import HeightMap

surfalize = pytest.importorskip("surfalize")
x3pio = pytest.importorskip("x3pio")

X, Y = 2.5, 2.5  # distances of points [um]
N, M = 9, 6


@pytest.fixture
def heights():
    """Heights (N, M) over x and y [m], without symmetries."""
    x, y = np.meshgrid(np.arange(N), np.arange(M), indexing="ij")
    return 1e-6 * (0.3 * x - 0.5 * y + np.sin(x * y) + 0.01 * x**2)


def written(heights, path, **how):
    """A scan written by surfalize, whose rows are those of y [um]."""
    surfalize.Surface(1e6 * heights.T, X, Y).save(path, **how)
    return path


@pytest.mark.parametrize(("name", "how", "digits"), [
    ("binary.sdf", {"binary": True}, 1e-12), ("text.sdf", {"binary": False}, 1e-9),
    ("scan.x3p", {}, 1e-12), ("scan.al3d", {}, 1e-6)])
def test_files_of_another_program_have_their_heights(name, how, digits, heights, tmp_path):
    if not name.endswith("x3p"):
        require_topography()
    found = HeightMap(file=str(written(heights, tmp_path / name, **how)))
    assert np.array(found.heights) == pytest.approx(heights, abs=digits * np.abs(heights).max())
    assert (found.spacing_x, found.spacing_y) == pytest.approx((2.5e-6, 2.5e-6))
    assert (found.origin_x, found.origin_y, found.file) == (0.0, 0.0, None)


def wyko_blocks(heights, path):
    """An OPD file of a Wyko profilometer: a directory of blocks of 24 bytes, then the blocks.

    Heights are whole numbers of a wavelength of 600 nm over 2000, the distance of points is in mm,
    rows in y begin at the last one.
    """
    steps = np.rint(heights / (600e-9 / 2000.0)).astype("<i2")
    blocks = [("RAW_DATA", 3, struct.pack("<3H", N, M, 2) + steps[:, ::-1].tobytes()),
              ("Wavelength", 7, struct.pack("<f", 600.0)), ("Mult", 6, struct.pack("<h", 2000)),
              ("Pixel_size", 7, struct.pack("<f", 2.5e-3)), ("Aspect", 7, struct.pack("<f", 1.0))]
    entries = [("Directory", 1, bytes(24 * (len(blocks) + 1))), *blocks]
    path.write_bytes(b"\1\0" + b"".join(
        struct.pack("<16shlH", name.encode(), kind, len(body), 0) for name, kind, body in entries)
        + b"".join(body for _, _, body in blocks))
    return 3e-10 * steps


def test_an_opd_file_of_a_wyko_profilometer(heights, tmp_path):
    require_topography()
    steps = wyko_blocks(heights, tmp_path / "a.opd")
    other = surfalize.Surface.load(tmp_path / "a.opd")  # um, rows of y from the last one
    found = HeightMap(file=str(tmp_path / "a.opd"))
    assert np.array(found.heights) == pytest.approx(steps, rel=1e-5, abs=1e-12)
    assert (found.spacing_x, found.spacing_y) == pytest.approx((2.5e-6, 2.5e-6))
    assert np.ptp(other.data) == pytest.approx(1e6 * np.ptp(steps), rel=1e-5)
    assert other.step_x == pytest.approx(2.5)


def test_a_text_of_a_wyko_profilometer(heights, tmp_path):
    """Heights in parts of a wavelength."""
    require_topography()
    lines = ["Wyko ASCII Data File Format 0 0 1", f"X Size\t{N}", f"Y Size\t{M}",
             "Block Name\tType\tLength\tValue", "Wavelength\t7\t4\t600", "Aspect\t7\t4\t1",
             "Pixel_size\t7\t4\t0.0025", "Mult\t7\t4\t2000", f"RAW_DATA\t3\t{4 * N * M}"]
    lines += ["\t".join(f"{2000.0 * one / 600e-9:.8g}" for one in row) for row in heights]
    (tmp_path / "a.asc").write_text("\n".join(lines) + "\n")
    found = HeightMap(file=str(tmp_path / "a.asc"))
    # SurfaceTopography takes the lines of the file along y.
    assert np.array(found.heights) == pytest.approx(heights.T, abs=1e-12)
    assert (found.spacing_x, found.spacing_y) == pytest.approx((2.5e-6, 2.5e-6))


def require_topography():
    if not extras.installed("SurfaceTopography"):
        pytest.skip("SurfaceTopography is not installed")


@pytest.mark.parametrize("revision", list(x3pio.Revision))
def test_both_revisions_of_x3p_and_gaps_in_them(revision, heights, tmp_path):
    """A gap in a plane is filled by the plane: all means of neighbours lie on it."""
    x, y = np.meshgrid(2e-6 * np.arange(N), 3e-6 * np.arange(M), indexing="ij")
    plane = 0.02 * x - 0.05 * y
    lost = plane.copy()
    lost[3:6, 2:4] = np.nan
    x3pio.write(tmp_path / "a.x3p", lost.T, x_scale=2e-6, y_scale=3e-6, revision=revision)
    with pytest.warns(fc.ModelWarning, match="lacks 6 of 54 heights"):
        found = HeightMap(file=str(tmp_path / "a.x3p"))
    assert np.array(found.heights) == pytest.approx(plane, abs=1e-15)
    assert (found.spacing_x, found.spacing_y) == pytest.approx((2e-6, 3e-6))


def test_a_study_takes_a_scan(heights, tmp_path):
    written(heights, tmp_path / "scan.x3p")
    study = fc.Study.from_toml("""
gap = { file = "scan.x3p" }
geometry = { shape = "solid-block", length = 0.02, width = 0.02, height = 0.01 }
body = { material = "steel" }
""", tmp_path / "s.toml")
    assert np.array(study.gap.heights) == pytest.approx(heights)


def test_what_cannot_be_read_is_told(heights, tmp_path, monkeypatch):
    def told(path):
        with pytest.raises(fc.InputError) as error:
            HeightMap(file=str(path))
        assert "\n" not in str(error.value)
        return str(error.value)

    path = written(heights, tmp_path / "scan.x3p")
    broken = tmp_path / "broken.x3p"
    broken.write_bytes(path.read_bytes()[:900])
    assert "is no X3P file that can be read" in told(broken)
    x3pio.write(tmp_path / "line.x3p", heights[:, 0], x_scale=1e-6)
    assert "is a profile, not a grid" in told(tmp_path / "line.x3p")
    holes = np.where(np.arange(N * M).reshape(N, M) % 3, np.nan, heights)
    x3pio.write(tmp_path / "holes.x3p", holes.T, x_scale=1e-6, y_scale=1e-6)
    assert re.search(r"lacks 66.7 % of its 54 heights", told(tmp_path / "holes.x3p"))
    with pytest.raises(fc.InputError, match="cannot be combined with spacing_x"):
        HeightMap(file=str(path), spacing_x=1.0)
    monkeypatch.setattr(extras, "import_module", lambda name: (_ for _ in ()).throw(ImportError))
    with pytest.raises(fc.MissingLibraryError, match=r"pip install 'fecontact\[topography\]'"):
        HeightMap(file=str(path))


def test_unknown_formats_are_told(tmp_path):
    require_topography()
    (tmp_path / "a.bin").write_bytes(b"\0\1\2" * 333)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(fc.InputError, match="is of no format that SurfaceTopography knows"):
            HeightMap(file=str(tmp_path / "a.bin"))
