"""A catalogue of bad input, over all commands, study files, data files and the interface.

Each case ends with one kind sentence that names what is wrong, and leaves nothing behind.
"""

import os
import shlex
import subprocess
import sys
import warnings

import pytest
from tiny_study import TINY

import fecontact as fe
from fecontact.cli import execute

SWEEP = TINY + "[sweep.axes]\nground.speed = [0.1, 0.2]\n"


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A folder with a study, its mesh and its run, and files that are none of these."""
    folder = tmp_path_factory.mktemp("bad")
    (folder / "tiny.toml").write_text(TINY)
    assert execute(["run", str(folder / "tiny.toml"), "-o", str(folder)]) == 0
    assert execute(["mesh", str(folder / "tiny.toml"), "-o", str(folder)]) == 0
    for picture in folder.glob("*.png"):
        picture.unlink()
    whole = (folder / "tiny.vtkhdf").read_bytes()
    for name, content in {
        "sweep.toml": SWEEP.encode(), "broken.toml": b"speed = = 1\n",
        "cut.vtkhdf": whole[: len(whole) // 2], "head.vtkhdf": whole[:600],
        "empty.vtkhdf": b"", "zeros.vtkhdf": bytes(5000), "text.vtkhdf": b"hello",
        "picture.vtkhdf": b"\x89PNG\r\n\x1a\n" + bytes(100),
        "own.py": b"broken = 3\n", "bad.py": b"import nothing_of_that_name\n",
        "text.csv": b"hello", "empty.csv": b"", "nan.csv": b"0,nan\n1,nan\n",
        "binary.csv": bytes(range(256)) * 8, "text.msh": b"hello",
    }.items():
        (folder / name).write_bytes(content)
    for name in ("fifo.toml", "fifo.py"):
        os.mkfifo(folder / name)
    for name in ("folder.toml", "folder.vtkhdf", "folder.msh"):
        (folder / name).mkdir()
    (folder / "tiny.vtkhdf").rename(folder / "run.vtkhdf")
    return folder


@pytest.fixture
def place(prepared, monkeypatch):
    """The folder as working directory; all that is in it must be as before."""
    monkeypatch.chdir(prepared)
    before = contents(prepared)
    yield prepared
    assert contents(prepared) == before


def contents(folder):
    return {path: path.stat().st_mtime_ns if path.is_file() else None
            for path in folder.rglob("*") if "__pycache__" not in path.parts}


@pytest.fixture
def refused(place, capsys):
    """Run a command line that must be refused: the sentence that says why."""

    def run(*tokens):
        # Only in tests are warnings errors; people see what the command says.
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            code = execute([str(token) for token in tokens])
        said = capsys.readouterr().err
        assert code in (1, 2), said
        assert_kind(said)
        return said

    return run


def assert_kind(said):
    assert said.startswith("error: ")
    assert said.count("\n") == 1
    assert said.rstrip().endswith((".", ")", '"', ".toml"))
    assert "should not happen" not in said
    assert "Traceback" not in said
    assert len(said) < 1500


# Keys of the study, their values, and a word that the sentence must have if it is not the key.
KEYS = """
gap -1
gap nan
gap "a"
gap [1,2]
gap {radius=-1} radius
gap {} Crown|radius
gap true
gap 1e400
gap [[1]]
geometry 3
geometry.shape "bem"
geometry.shape 3
geometry.shape []
geometry.length 0
geometry.length -1
geometry.length nan
geometry.length inf
geometry.length true
geometry.length "1"
geometry.length [1]
geometry.length {}
geometry.length 1e308
geometry.length 5e-324
geometry.height 1e12 element_size
geometry.element_size 1e-9 at_least
geometry.element_size 1e-300
geometry.element_size 0
geometry.element_size nan
geometry.element "hexagon"
geometry.lenght 1 did_you_mean_'length'
geometry.file "x.msh"
body.material "stel" did_you_mean_'steel'
body.youngs_modulus 0
body.youngs_modulus nan
body.youngs_modulus 1e308
body.youngs_modulus 1e-300
body.poisson_ratio 0.5
body.poisson_ratio -1
body.poisson_ratio nan
body.density 0
body.density 1e-320
body.density 1e308
body.thickness 0
body.thickness inf
body.thickness 1e308
body.plane "stres"
body.degree 3
body.degree 1.0
body.degree "2"
body.fixed {nowhere="x"} nowhere
body.fixed {contact="z"} contact
body.fixed {contact=1} contact
body.fixed "contact"
basis.modes 0
basis.modes 1.5
basis.modes true
basis.modes "all"
basis.modes 1000000000
basis.modes 9223372036854775808
basis.contact 3
basis.contact []
basis.contact ""
basis.contact ["contact","contact"]
basis.contact ["contact","tpo"] tpo
basis.contact_nodes 0
basis.contact_nodes 1.5
basis.contact_nodes [4,4]
basis.contact_nodes []
basis.contact_nodes 1000000000000
basis.B "nowhere"
basis.B [9,9]
basis.B [nan,0]
basis.B [1]
basis.B 3
basis.B {at="B",radius=-1} radius
basis.B {at="B",radius=nan} radius
basis.points {P="nowhere"} nowhere
basis.points {P=[nan,nan]} P
basis.points {B=[0,0]}
basis.points {"3"=[0,0]}
basis.points []
basis.damping -1
basis.damping nan
basis.damping [0.1]
basis.damping []
basis.damping ["a"]
basis.damping {mass_factor=-1,stiffness_factor=1} mass_factor
basis.damping {los_factor=1} los_factor
basis.reduction "crag"
basis.tolerance -1
basis.tolerance nan
basis.dashpots {B=[1]} B
basis.dashpots {B=[-1,0]} B
basis.dashpots {Q=[1,0]} Q
basis.dashpots {"99"=[1,0]} 99
basis.select [99] 99
basis.select [] modes
basis.select [1.5]
basis.mode 3 did_you_mean_'modes'
normal.law "liner" did_you_mean_'linear'
normal.law "own.py:Missing"
normal.law "none.py:Law" no_file
normal.law "own.py:"
normal.law ".py:"
normal.law "own.py:broken"
normal.law "bad.py:Law" cannot_be_loaded
normal.roughness_height 0
normal.roughness_height nan
normal.roughness_height [1e-6,1e-6]
normal.roughness_height "a"
normal.roughness_height []
normal.roughness_height 1e308 [normal]
friction.law "coulomb"
friction.static_coefficient -1
friction.static_coefficient nan
friction.static_coefficient {}
friction 3
interfaces {nowhere={}}
interfaces {contact={norml={}}} normal
interfaces {contact=3}
interfaces {contact={normal={law="linear",stiffness=-1}}} stiffness
ground.speed nan
ground.speed inf
ground.speed "a"
ground.speed [1]
ground.speed 1e400
ground.sped 1 did_you_mean_'speed'
ground.wavelength 0
ground.profile 3
ground.profile {law="sine",amplitude=1e-6,wavelength=0} wavelength
ground.profile {law="sin"} did_you_mean_'sine'
ground.profile {}
ground.profile {law="measured-profile",file="none.csv"} none.csv
ground.profile {law="measured-profile",file="."}
ground.profile {law="measured-profile",file="text.csv"} text.csv
ground.profile {law="measured-profile",file="empty.csv"} empty.csv
ground.profile {law="measured-profile",file="nan.csv"} nan.csv|finite
ground.profile {law="measured-profile",file="binary.csv"} binary.csv
ground.profile {law="random-roughness"}
ground.motion {law="speed-ramp"}
ground.motion 3
drive.amplitude_x nan
drive.stiffness_x -1
drive.damping_x -1
drive.frequency_hz nan
drive.motion_x 3
drive.motion_x {law="tabulated",times=[0,1],values=[1]}
drive.motion_x {law="swept-sine"}
load.normal nan
load.normal "a"
load.normal 1e400
load.forces 3
load.forces [{}]
load.forces [{point="Q",signal={law="constant",value=1},component="x"}] forces
load.forces [3]
load.forces.0.signal 3
load.forces [{point=[9,9],signal={law="constant",value=1}}] outside
load.gravity 3
load.gravity [0]
load.gravity [0,nan] gravity
load.base_acceleration_x 3
load.boundaries 3
load.boundaries [{boundary="nix",pressure=1}] nix
load.boundaries [{boundary="top"}] zero
load.boundaries [{boundary="top",pressure="a"}]
basis.loads 3
basis.loads ["gravity"] residual
simulation.t_end 0
simulation.t_end nan
simulation.t_end inf
simulation.t_end 5e-324
simulation.t_end 1e-320
simulation.t_end "1"
simulation.t_start 1
simulation.t_start nan
simulation.t_start 1e300
simulation.outputs 1
simulation.outputs -3
simulation.outputs 1.5
simulation.outputs 1000000000000 take_at_most
simulation.outputs 100000000000000000000000 too_large
simulation.outputs 1e12
simulation.solver "rodas"
simulation.rtol 0
simulation.rtol 1
simulation.rtol nan
simulation.restitution 0.5
simulation.impact_law "poisson"
simulation.solver "event"
simulation.events 1
simulation.stop ["x"]
simulation.stop "stick"
simulation.initial "moving"
simulation.initial {displacement=[0,0]} displacement
simulation.initial {displacement=[nan,0,0]}
simulation.initial {displacement=[1e70,0,0]} displacement
simulation.initial {velocity=[0,0,-1e61]} velocity
simulation.initial {displacements={B=[1e70,0]}} displacements
simulation.initial {velocities={B={y=nan}}} velocities
simulation.initial {foo=1} foo
output.frames -1
output.frames 1.5
output.folder 3
output.folder "tiny.toml"
output.folder "/dev/null"
output.points ["Q"] Q
output.points [99] 99
output.points "B"
render.frames 0
render.fps 0
render.fps nan
render.fps 1e-50
render.size [1,1]
render.size [321,181]
render.size [320]
render.size [320.0,180.0]
render.colour "red"
render.scale 0
render.scale 1e50
render.t_start nan
render.t_end nan
render.title 3
branch.range [1,0]
branch.range [nan,1]
branch.range [0,inf]
branch.step 2
branch.points 0
branch.kind "x"
branch.switch ["x"]
branch.intervals 1000000000000
branch.segments 0
branch.poincare_scan 1
branch.poincare_scan 1000000000000
branch.start nan
sweep.method "x"
sweep.samples 0
sweep.seed -1
sweep.summaries []
sweep.t_start nan
sweep.strobe {keep=0} keep
sweep.strobe {transient_periods=1,keep=1000000000000} keep
wear.coefficient -1
wear.law "fouvry"
wear.acceleration 0
wear.blocks 0
wear.periods 0
wear.settling -1
wear.outputs 1
sweep.axes 3
foo 3
foo.bar 3 foo
Ground.speed 3 did_you_mean_'ground'
. 1 unknown
"""


def parsed(lines):
    """Key and value of each line, and the words of which one must be said, with _ for spaces."""
    for line in lines.strip().splitlines():
        key, value, *words = line.split(" ")
        said = words[0].replace("_", " ").split("|") if words else [key.split(".")[-1]]
        yield pytest.param(key, value, said, id=f"{key}={value}")


@pytest.mark.parametrize(("key", "value", "words"), list(parsed(KEYS)))
def test_keys_of_a_study(key, value, words, refused):
    said = refused("run", "tiny.toml", "--set", f"{key}={value}")
    said = said.replace("_", " ").lower()
    assert any(word.replace("_", " ").lower() in said for word in words)


def changed(old, new):
    assert old in TINY
    return TINY.replace(old, new)


TEXTS = {
    "empty": ("", "geometry"),
    "blank": ("\n\n", "geometry"),
    "binary": (bytes(range(256)), "cannot be read"),
    "latin-1": ("title = 'é'".encode("latin-1"), "cannot be read"),
    "utf-16": (TINY.encode("utf-16"), "cannot be read"),
    "zeros": (bytes(100), "not valid TOML"),
    "cut": (TINY[:100], "not valid TOML"),
    "twice": (TINY + "[ground]\nspeed = 1\n", "ground"),
    "deep list": ("gap = " + "[" * 5000 + "]" * 5000, "levels deep"),
    "deep table": (TINY + "[a" + ".a" * 3000 + "]\nx = 1\n", "levels deep"),
    "deep names": ("a" + ".a" * 3000 + " = 1\n" + TINY, "levels deep"),
    "deep enough to be parsed": ("gap = " + "[" * 60 + "]" * 60 + TINY, "levels deep"),
    "digits": (changed("speed = 0.1", "speed = " + "1" * 5000), "digits"),
    "digits of a float": (changed("speed = 0.1", "speed = " + "1" * 400), "speed"),
    "digits of an integer": (changed("modes = 5", "modes = " + "1" * 400), "modes"),
    "hexadecimal digits": (changed("speed = 0.1", "speed = 0x" + "f" * 5000), "speed"),
    "zero in a name": (changed('"steel"', '"st\\u0000eel"'), "body.material"),
    "zero in a path": (changed("frames = 3", 'folder = "a\\u0000b"'), "output.folder"),
    "zero in a mesh": ('[geometry]\nfile = "a\\u0000.msh"\n', "geometry.file"),
    "zero in a key": ('"a\\u0000b" = 1\n' + TINY, "a key"),
    "long text": (changed('"steel"', '"' + "x" * 100_000 + '"'), "material"),
    "date": (changed("speed = 0.1", "speed = 2020-01-01"), "speed"),
    "shape and file": ('[geometry]\nshape = "beam"\nfile = "x.msh"\n', "geometry"),
    "no mesh": ('[geometry]\nfile = "none.msh"\n', "none.msh"),
    "no name of a mesh": ('[geometry]\nfile = ""\n', "geometry"),
    "folder for a mesh": ('[geometry]\nfile = "folder.msh"\n', "folder.msh"),
    "run for a mesh": ('[geometry]\nfile = "run.vtkhdf"\n', "run.vtkhdf"),
    "text for a mesh": ('[geometry]\nfile = "text.msh"\n', "text.msh"),
    "scale of a mesh": ('[geometry]\nfile = "tiny.msh"\nscale = 1e300\n', "scale"),
    "no such group": ('[geometry]\nfile = "tiny.msh"\nboundaries = { a = "b" }\n', "'b'"),
    "no such place": ('[geometry]\nfile = "tiny.msh"\npoints = { a = [9, 9] }\n', "'a'"),
    "box of nan": ('[geometry]\nfile = "tiny.msh"\nboundaries = { a = [nan, nan, nan, nan] }\n',
                   "'a'"),
    "command to a terminal": ('"\\u001b[2J" = 1\n' + TINY, "\\x1b[2J"),
    "line break": ('"a\\nb" = 1\n' + TINY, "a b"),
    "lists for tables": ("[[geometry]]\nshape = 'beam'\n", "geometry"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_texts_of_studies(name, refused, place):
    text, word = TEXTS[name]
    path = place / "case.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    try:
        said = refused("mesh", "case.toml")
    finally:
        path.unlink()
    assert word in said
    assert "case.toml" in said


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    (tmp_path / "bom.toml").write_bytes(b"\xef\xbb\xbf" + TINY.encode())
    assert fe.Study.read(tmp_path / "bom.toml") == fe.Study.from_toml(TINY)


# Command lines, and a word that the sentence must have.
COMMANDS = """
run fifo.toml | pipe or device
run /dev/zero | pipe or device
plot run.vtkhdf history --point ² | no point '²'
render run.vtkhdf -o "" | is empty
run tiny.toml --set 'ground.profile={law="measured-profile",file="/dev/zero"}' | pipe or device
run tiny.toml --set 'friction={law="fifo.py:A"}' | pipe or device
init folder.toml | folder.toml exists
init tiny.toml | --force
init none/../tiny.toml | --force
init a.txt | .toml
init --shape x | --shape
init tiny.msh/x.toml | tiny.msh
init --force folder.toml | folder
mesh none.toml | none.toml
mesh folder.toml | folder.toml
mesh broken.toml | broken.toml
mesh tiny.toml -o tiny.toml | tiny.toml
mesh tiny.toml -o /dev/null/x | /dev/null
mesh tiny.toml --set | --set
mesh tiny.toml --set =1 | KEY=VALUE
mesh tiny.toml --set .=1 | key
mesh tiny.toml tiny.toml | tiny.toml
mesh | study
modes none.toml | none.toml
modes tiny.toml --converge=3 | converge
run tiny.toml --resume | --resume
run tiny.toml -o text.msh | text.msh
run tiny.toml --unknown | --unknown
run run.vtkhdf | run.vtkhdf
render none.vtkhdf | none.vtkhdf
render tiny.toml | run the study first
render folder.vtkhdf | folder.vtkhdf
render cut.vtkhdf | cut.vtkhdf
render head.vtkhdf | head.vtkhdf
render empty.vtkhdf | empty.vtkhdf
render zeros.vtkhdf | zeros.vtkhdf
render text.vtkhdf | text.vtkhdf
render picture.vtkhdf | picture.vtkhdf
render . | .
render run.vtkhdf --size 100000 100000 | take at most
render run.vtkhdf --size 1000000000000 200 | take at most
render run.vtkhdf --size 20000 320 | take at most
render run.vtkhdf --size 0 0 | size
render run.vtkhdf --size -320 -180 | size
render run.vtkhdf --size 321 181 | size
render run.vtkhdf --size 320 | size
render run.vtkhdf --size a b | size
render run.vtkhdf --fps inf | fps
render run.vtkhdf --fps 1e300 | fps
render run.vtkhdf --frames 0 | frames
render run.vtkhdf --frames -1 | frames
render run.vtkhdf --scale nan | scale
render run.vtkhdf --scale 1e300 | scale
render run.vtkhdf --colour red | colour
render run.vtkhdf --t-start 7 | no output time
render run.vtkhdf --t-start nan | t_start
render run.vtkhdf --t-end nan | t_end
render run.vtkhdf --t-start 1 --t-end 0 | t_end
render run.vtkhdf -o x.avi | x.avi
render run.vtkhdf -o text.msh/x.mp4 | text.msh
render run.vtkhdf -o tiny.toml | tiny.toml
plot run.vtkhdf | kind
plot run.vtkhdf histoy | did you mean 'history'
plot run.vtkhdf history -o x.txt | x.txt
plot run.vtkhdf history -o folder.toml | folder.toml
plot run.vtkhdf history --point Q | 'Q'
plot run.vtkhdf history --point 99 | 99
plot run.vtkhdf history --point 1,2,3 | 2 coordinates, x, y
plot run.vtkhdf history --point nan,nan | nan
plot run.vtkhdf history --point 9,9 | 9
plot run.vtkhdf history --component z | component
plot run.vtkhdf history --t-start nan | t_start
plot run.vtkhdf history --t-end nan | t_end
plot run.vtkhdf history --t-start 7 | 7
plot run.vtkhdf phase --t-end 0 | t_end
plot run.vtkhdf spectrum --quantity x | quantity
plot run.vtkhdf spectrum --highest-hz 0 | highest_hz
plot run.vtkhdf spectrum --t-end 1e-4 | windows of at least
plot run.vtkhdf spectrogram --highest-hz -1 | highest_hz
plot run.vtkhdf poincare | period
plot run.vtkhdf receptance --point 0,0 | receptance
plot run.vtkhdf receptance --highest-hz inf | highest_hz
plot cut.vtkhdf history | cut.vtkhdf
plot none.toml history | none.toml
export run.vtkhdf --format xlsx | format
export run.vtkhdf --format csv -o x.txt | x.txt
export run.vtkhdf --format mat -o x | .mat
export run.vtkhdf --format netcdf -o x.csv | .nc
export run.vtkhdf --frames -1 | frames
export run.vtkhdf --frames 0 | frames
export run.vtkhdf --format csv -o text.msh/x.csv | text.msh
export cut.vtkhdf | cut.vtkhdf
export tiny.toml | run the study first
sweep none.toml | none.toml
sweep tiny.toml | [sweep]
sweep sweep.toml --workers 0 | workers
sweep sweep.toml --workers -1 | workers
sweep sweep.toml --workers 1e11 | workers
sweep sweep.toml --workers 100000000000 | workers
sweep sweep.toml --workers a | workers
sweep sweep.toml --dask nonsense | nonsense
sweep sweep.toml --dask tcp:// | tcp://
sweep sweep.toml --dask tcp://[ | tcp://[
sweep sweep.toml --dask tcp://h:99999 | 65535
sweep sweep.toml --dask http://x:1 | http
sweep sweep.toml --dask inproc://x:1 | inproc
sweep sweep.toml --dask tcp://a:1 --workers 1 | --workers
sweep sweep.toml -o tiny.toml/x | tiny.toml
sweep sweep.toml --set sweep.axes={} | axes
sweep sweep.toml --set sweep.axes={ground.sped=[1]} | sped
sweep sweep.toml --set sweep.axes={ground.speed=[]} | ground.speed
sweep sweep.toml --set sweep.axes={ground.speed=3} | axes
sweep sweep.toml --set sweep.axes={ground.speed={start=0,end=1}} | count
sweep sweep.toml --set sweep.axes={ground.speed={start=0,end=1,count=1000000000000}} | count
sweep sweep.toml --set 'sweep.axes={ground.speed={start=0,end=1,count=3,spacing="log"}}' | start
sweep sweep.toml --set 'sweep.axes={ground.speed={distribution="x"}}' | distribution
sweep sweep.toml --set sweep.method="sobol" | samples
sweep sweep.toml --set sweep.method="sobol" --set sweep.samples=1000000000000 | samples
sweep sweep.toml --set 'sweep.summaries=["x"]' | 'x'
sweep sweep.toml --set 'sweep.summaries=["none.py:f"]' | none.py
sweep sweep.toml --set sweep.t_start=9 | t_start
branch none.toml | none.toml
branch tiny.toml | parameter
branch tiny.toml ground.speed | bounds
branch tiny.toml ground.sped --bounds 0.1 0.2 | did you mean 'ground.speed'
branch tiny.toml ground.speed --bounds 1 | --bounds
branch tiny.toml ground.speed --bounds 1 1 | smaller one first
branch tiny.toml ground.speed --bounds nan 1 | nan
branch tiny.toml ground.speed --bounds 0.1 inf | bounds
branch tiny.toml ground.speed --bounds a 1 | --bounds
branch tiny.toml ground.speed --bounds 0.1 0.2 --set branch.point="Q" | 'Q'
branch tiny.toml ground.speed --bounds 0.1 0.2 -o tiny.toml | tiny.toml
keys no-such-key | no-such-key
keys ground.nothing | nothing
laws nothing | nothing
laws none.py:X | none.py
laws .py: | .py
demo tiny.toml/x | tiny.toml
doctor now | now
completion nushell | nushell
completion | shell
rnu | rnu
--debg | --debg
"""


@pytest.mark.parametrize("line", COMMANDS.strip().splitlines())
def test_command_lines(line, refused):
    tokens, _, word = line.partition(" | ")
    assert word.lower() in refused(*shlex.split(tokens)).lower()


@pytest.mark.slow
def test_an_index_that_cannot_be_written_is_no_success(tmp_path, capsys):
    """All cases went well, but their table has no place: a folder is in the way."""
    (tmp_path / "sweep.toml").write_text(SWEEP)
    (tmp_path / "s" / "index.csv").mkdir(parents=True)
    tokens = ["sweep", str(tmp_path / "sweep.toml"), "-o", str(tmp_path / "s"), "--workers", "1"]
    assert execute(tokens) == 1
    said = capsys.readouterr()
    assert_kind(said.err)
    assert "index.csv is of no sweep" in said.err
    assert execute([*tokens, "--overwrite"]) == 1
    said = capsys.readouterr()
    assert "wrote" not in said.out
    assert_kind(said.err)
    assert "index.csv cannot be written" in said.err
    (tmp_path / "s" / "index.csv").rmdir()
    assert execute([*tokens, "--resume"]) == 0
    assert len(fe.io.read_table(tmp_path / "s" / "index.csv")) == 2


@pytest.mark.parametrize("name", ["10:00.mp4", "-y.mp4", "pipe:1.mp4", "concat:a|b.mp4", "%d.mp4"])
def test_names_of_movies_that_mean_something_to_the_encoder(name, place, tmp_path, monkeypatch,
                                                            capfd):
    """A colon would begin a protocol, a hyphen an option."""
    monkeypatch.chdir(tmp_path)
    assert execute(["render", str(place / "run.vtkhdf"), "--frames", "2", "--size", "320", "180",
                    f"--output={name}"]) == 0
    assert capfd.readouterr().err == ""
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert b"ftyp" in (tmp_path / name).read_bytes()[:12]


@pytest.mark.slow
def test_in_a_process_of_its_own(place):
    """Errors of the command: the largest picture, a name too long, bytes that are no text."""
    for tokens in (["render", "run.vtkhdf", "--size", "100000", "100000"],
                   ["mesh", "n" * 300 + ".toml"],
                   [b"mesh", b"\xff\xfe.toml"]):
        done = subprocess.run([sys.executable, "-m", "fecontact", *tokens], text=True,
                              capture_output=True, check=False)
        assert done.returncode == 1
        assert done.stdout == ""
        assert_kind(done.stderr)


@pytest.mark.parametrize("command", ["keys", "--version", "run"])
def test_python_without_docstrings_is_refused(command):
    """At once, before kernels are compiled."""
    done = subprocess.run([sys.executable, "-OO", "-m", "fecontact", command], text=True,
                          capture_output=True, check=False)
    assert done.returncode == 1
    assert_kind(done.stderr)
    assert "-OO" in done.stderr


def test_pictures_into_the_present_folder(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert execute(["render", str(place / "run.vtkhdf"), "--frames", "2", "--size", "320", "180",
                    "-o", "."]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["frame_0000.png", "frame_0001.png"]


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a shell")
@pytest.mark.parametrize(("option", "limit"), [("-v", 900000), ("-s", 128)])
def test_too_little_memory_for_the_libraries_is_said(option, limit):
    done = subprocess.run(["sh", "-c", f"ulimit {option} {limit}; {sys.executable} -m fecontact "
                           "keys"],
                          text=True, capture_output=True, check=False)
    assert done.returncode == 1
    assert_kind(done.stderr)
    assert f"ulimit {option}" in done.stderr
