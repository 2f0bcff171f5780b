"""What exists when a command writes: one rule for every command and option that names a file.

`CASES` says how each command is run so that it writes; a command with an option for a file that is
not in it fails a test. All runs are in this process, where faults can be injected.
"""

import errno
import io
import itertools
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
import typer
from matplotlib.figure import Figure
from PIL import Image

import mdfconv
from mdfconv.cli import app
from mdfconv.output import files as output_files
from mdfconv.studies import report
from mdfconv.studies.pages import PageFiles
from tests.cli.runner import run_here as run
from tests.light.maps import room, write_map

GROUP = typer.main.get_command(app)
# How help shows what an option takes that names what is written.
NAMES_A_FILE = {"FILE", "OUT", "DIR"}
OLD = b"old"
# With textures that are left the status is 1.
DONE = 0, 1


@dataclass
class Case:
    """How a command writes: its words before the options, and the file of each option.

    `folder` has the files that are written into a folder, by its option.
    """

    words: list[str]
    outputs: dict[str, str]
    inputs: tuple[str, ...] = ()
    folder: tuple[str, ...] = ()

    def line(self, *more):
        """Return the words with all options for files."""
        options = [word for pair in self.outputs.items() for word in pair]
        return [*self.words, *options, *more]

    @property
    def paths(self):
        """The files that are written."""
        return (*self.folder, *(name for name in self.outputs.values() if "." in name))


SMALLEST = "--size", "16", "--dpi", "10", "0.4"
SMALL = *SMALLEST, "--to", "ggx", "--method", "peak"
CASES = {
    "mtl": Case(
        ["mtl", "a.mtl", "--textures"], {"--output": "b.mtl"}, ("a.mtl", "x.png"), ("x_Pr.png",)
    ),
    "gltf": Case(
        ["gltf", "a.gltf", "--from", "blinn-phong:peak-alpha", "--textures"],
        {"--output": "b.gltf"},
        ("a.gltf", "orm.png"),
        ("orm_ggx-roughness.png",),
    ),
    "mitsuba": Case(
        ["mitsuba", "a.xml", "--textures"],
        {"--output": "b.xml"},
        ("a.xml", "x.png"),
        ("x_ggx.png",),
    ),
    "texture": Case(
        ["texture", "x.png", "--from", "ggx:roughness", "--to", "ggx"],
        {"--output": "y.png", "--png": "hist.png"},
        ("x.png",),
    ),
    "fit": Case(
        ["fit", "lobe.csv", "--to", "ggx"],
        {"--output": "fit.csv", "--png": "fit.png", "--report": "fit.html"},
        ("lobe.csv",),
    ),
    "formula": Case(
        ["formula", "--from", "ggx:glossiness", "--to", "ggx:roughness"], {"--output": "f.glsl"}
    ),
    "fit-table": Case(["fit-table", "--m-b", "0.2"], {"--output": "table.csv"}),
    "plot-error": Case(
        ["plot-error", "--m-b", "0.2", "--mdf", "ggx", "--dpi", "10", "--points", "9"],
        {"--output": "out"},
        folder=("out/error-m_b-0.2.png", "out/error-m_b-0.2b.csv"),
    ),
    "compare": Case(
        ["compare", *SMALL],
        {"--output": "out", "--html": "page.html"},
        folder=("out/compare-beckmann-0.4-ggx-peak.png", "out/compare-beckmann-0.4-ggx-peak.csv"),
    ),
    "light": Case(
        ["light", "map.exr", "--m-b", "0.2"], {"--csv": "light.csv", "--png": "l.png"}, ("map.exr",)
    ),
    "furnace": Case(["furnace", "0.5", "--points", "2"], {"--output": "f.csv", "--png": "f.png"}),
    "fresnel": Case(["fresnel"], {"--output": "f.csv", "--png": "f.png"}),
    "report": Case(["report"], {"--output": "out"}, folder=("out/a.md", "out/README.md")),
    "bench": Case(
        ["bench", "--quick"], {"--csv": "b.csv", "--json": "b.json", "--png": "b.png"}
    ),
    "stability": Case(["stability", "--mdf", "ggx"], {"--output": "s.csv"}),
}  # fmt: skip


def one_page():
    return PageFiles(["new"], {})


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    """A folder with all inputs, in which the commands run; what would take long is not computed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(report, "PAGES", [report.Page(one_page, ("a.md",))])
    monkeypatch.setattr(report, "fill", lambda name, **figures: name)
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    monkeypatch.setattr(Figure, "savefig", lambda figure, file, **_: file.write(b"drawn"))
    monkeypatch.setattr("mdfconv.render.page.comparison_page", lambda *_: b"page")
    monkeypatch.setattr("mdfconv.studies.bench.measure", lambda *_: None)
    monkeypatch.setattr("mdfconv.studies.bench_page.draw", lambda _: b"drawn")
    for name in ("_csv", "_json"):
        monkeypatch.setattr(f"mdfconv.cli.bench_command.{name}", lambda _: "measured")
    monkeypatch.setattr("mdfconv.studies.stability.audit", lambda *_: [])
    Path("a.mtl").write_text("newmtl a\nNs 10\nmap_Ns x.png\n")
    Path("a.gltf").write_text(
        '{"asset": {"version": "2.0"}, "images": [{"uri": "orm.png"}], "textures": [{"source": 0}],'
        '"materials": [{"pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}}}]}'
    )
    Path("a.xml").write_text(
        '<scene version="3.0.0"><bsdf type="roughconductor"><texture type="bitmap" name="alpha">'
        '<string name="filename" value="x.png"/><boolean name="raw" value="true"/>'
        "</texture></bsdf></scene>\n"
    )
    Image.new("RGB", (2, 2), (9, 99, 9)).save("orm.png")
    Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8)).save("x.png")
    beta = np.linspace(0, 1.5, 20)
    rows = [f"{angle},{np.exp(-np.square(np.tan(angle) / 0.3))}" for angle in beta]
    Path("lobe.csv").write_text("\n".join(["beta_radians,value", *rows]))
    write_map(Path("map.exr"), room())


def state():
    """Return the content of every file beneath the current folder."""
    return {str(path): path.read_bytes() for path in Path().rglob("*") if path.is_file()}


def put(*paths):
    """Write files that are there before."""
    for path in map(Path, paths):
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(OLD)


def file_options(name):
    """Return the options of a command that name what it writes."""
    with typer.Context(GROUP) as context:
        parameters = GROUP.get_command(context, name).get_params(context)
    options = [each for each in parameters if each.param_type_name == "option"]
    return {each.opts[0] for each in options if each.metavar in NAMES_A_FILE}, {
        option for each in options for option in each.opts
    }


@pytest.mark.parametrize("name", GROUP.list_commands(None))
def test_every_option_for_a_file_is_known_here(name):
    naming, every = file_options(name)
    assert naming == set(CASES[name].outputs if name in CASES else ()), (
        "each command that writes files has a case in CASES of this file"
    )
    assert ("--force" in every) == bool(naming)


@pytest.mark.parametrize(
    ("name", "path"), [(name, path) for name, case in CASES.items() for path in case.paths]
)
def test_what_exists_is_refused(name, path):
    put(path)
    before = state()
    status, out, err = run(*CASES[name].line())
    assert (status, out, err) == (2, "", f"mdfconv: {path} exists; it can be replaced (--force)\n")
    assert state() == before


@pytest.mark.parametrize("name", CASES)
def test_force_replaces_what_exists(name):
    case = CASES[name]
    inputs = state()
    put(*case.paths)
    status, _, err = run(*case.line("--force"))
    assert status == 0, err
    after = state()
    assert after.keys() == inputs.keys() | set(case.paths)
    assert OLD not in after.values()
    assert {path: after[path] for path in inputs} == inputs
    # And without it where nothing is: the same.
    for path in case.paths:
        Path(path).unlink()
    assert run(*case.line())[0] == 0
    assert state().keys() == after.keys()


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if len(case.outputs) > 1])
def test_one_name_for_two_results_is_refused(name):
    case = CASES[name]
    Path("out").mkdir()
    before = state()
    # A file of a folder, or any other name.
    same = case.folder[0] if case.folder else "z.png"
    options = {option: path if path == "out" else same for option, path in case.outputs.items()}
    words = [*case.words, *itertools.chain(*options.items())]
    for force in ((), ("--force",)):
        status, out, err = run(*words, *force)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert "is named for two results" in err
        assert state() == before


@pytest.mark.parametrize(
    ("name", "option"),
    [(name, option) for name, case in CASES.items() if case.inputs for option in case.outputs],
)
def test_an_input_is_not_written_over(name, option):
    case = CASES[name]
    Path("link").symlink_to(case.inputs[0])
    before = state()
    # What a file names is found to be read late: without --force only that it exists.
    cases = [(path, ("--force",)) for path in (*case.inputs, "link")] + [(case.inputs[0], ())]
    for path, force in cases:
        options = {**case.outputs, option: path}
        status, out, err = run(*case.words, *itertools.chain(*options.items()), *force)
        refusal = f"mdfconv: {path} is the input; write to another file\n"
        assert (status, out, err) == (2, "", refusal)
        assert state() == before


@pytest.mark.parametrize("name", ["mtl", "gltf", "mitsuba", "texture", "fit-table"])
def test_the_map_of_a_metric_is_not_written_over(name):
    before = state()
    words = *CASES[name].words, "--metric", "light:map.exr", "--output", "./map.exr", "--force"
    refusal = "mdfconv: map.exr is the input; write to another file\n"
    assert run(*words) == (2, "", refusal)
    assert state() == before


@pytest.mark.parametrize(
    ("name", "option"),
    [
        (name, option)
        for name, case in CASES.items()
        for option, path in case.outputs.items()
        # The others take what they write from the name's end.
        if "." in path and option != "--report" and name != "texture"
    ],
)
def test_pipes_and_devices_are_written_to(name, option):
    words = [word for word in CASES[name].words if word != "--textures"]
    assert read_from_pipe("pipe", *words, option, "pipe")
    assert run(*words, option, "/dev/null")[0] in DONE
    assert Path("/dev/null").is_char_device()
    status, _, err = run(*words, option, "/dev/full")
    assert (status, err) == (2, "mdfconv: cannot write /dev/full: No space left on device\n")


def read_from_pipe(name, *words):
    """Run a command that writes into a pipe; return what comes out."""
    os.mkfifo(name)
    read = []
    reader = Thread(target=lambda: read.append(Path(name).read_bytes()), daemon=True)
    reader.start()
    status, _, err = run(*words)
    assert status in DONE, err
    reader.join(10)
    assert Path(name).is_fifo()
    return read[0]


@pytest.mark.parametrize("name", ["mtl", "mitsuba", "gltf"])
def test_textures_do_not_go_beside_a_device(name):
    before = state()
    words = [*CASES[name].words, "--output", "/dev/null", "--force"]
    assert run(*words) == (
        2, "", "mdfconv: no texture can stand beside /dev/null: it is no file\n",
    )  # fmt: skip
    assert state() == before


def test_pictures_of_a_page_are_found_before_anything_is_written():
    words = *CASES["fit"].words, "--report", "page.md", "--output", "fit.csv"
    before = state()
    assert run(*words)[0] == 0
    made = state().keys() - before.keys()
    pictures = sorted(path for path in made if path.endswith(".png"))
    for path in made - {pictures[-1]}:
        Path(path).unlink()
    kept = state()
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert err == f"mdfconv: {pictures[-1]} exists; it can be replaced (--force)\n"
    assert state() == kept


def test_a_texture_goes_into_a_pipe():
    content = read_from_pipe("pipe.png", *CASES["texture"].words, "--output", "pipe.png")
    assert Image.open(io.BytesIO(content)).size == (8, 8)


def test_standard_output_is_no_file_to_refuse():
    """Not where a shell has opened a file for it, and what that holds is kept."""
    Path("log").write_bytes(OLD)
    command = [sys.executable, "-m", "mdfconv", "fresnel", "-o", "/dev/stdout", "--format", "csv"]
    with Path("log").open("ab") as log:
        package = Path(mdfconv.__file__).parents[1]
        environment = os.environ | {"PYTHONPATH": str(package)}
        subprocess.run(command, stdout=log, check=True, env=environment)
    assert Path("log").read_bytes().startswith(OLD)
    assert b"weighted_rms" in Path("log").read_bytes()


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("step", ["fsync", "chmod", "link", "replace"])
def test_a_fault_at_the_last_step_changes_nothing(name, step, monkeypatch):
    """Of one output that is there and others that are not."""
    case, real = CASES[name], getattr(os, step)
    put(case.paths[-1])
    before = state()
    calls = itertools.count()

    def count(*arguments, **options):
        next(calls)
        return real(*arguments, **options)

    monkeypatch.setattr(os, step, count)
    assert run(*case.line("--force"))[0] == 0
    last = next(calls) - 1
    restore(before)
    for fault in (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), KeyboardInterrupt()):
        calls = itertools.count()

        def fail(*arguments, calls=calls, fault=fault, **options):
            if next(calls) == last:
                raise fault
            return real(*arguments, **options)

        monkeypatch.setattr(os, step, fail)
        status, _, err = run(*case.line("--force"))
        if step == "link" and status == 0:
            # A file that cannot have a second name is copied.
            assert state().keys() == before.keys() | set(case.paths)
            restore(before)
        else:
            assert status == (130 if isinstance(fault, KeyboardInterrupt) else 2), err
            assert state() == before


def restore(before):
    """Make the files what they were."""
    for path in state().keys() - before.keys():
        Path(path).unlink()
    for path, content in before.items():
        Path(path).write_bytes(content)


@pytest.mark.parametrize("name", CASES)
def test_a_full_disk_and_a_closed_folder_change_nothing(name, monkeypatch):
    case = CASES[name]
    put(case.paths[-1])
    before = state()
    real = Path.write_bytes

    def half(path, content):
        real(path, content[: len(content) // 2])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def closed(**options):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    for owner, call, fault, reason in (
        (Path, "write_bytes", half, "No space left on device"),
        (output_files, "NamedTemporaryFile", closed, "Read-only file system"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(owner, call, fault)
            status, out, err = run(*case.line("--force"))
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert err.startswith("mdfconv: cannot write ")
        assert err.endswith(f": {reason}\n")
        assert state() == before


def test_a_file_that_appears_meanwhile_is_kept(monkeypatch):
    """Between the check and the writing."""
    real = output_files.StagedFiles.place

    def late(self, is_new):
        put("y.png")
        real(self, is_new)

    monkeypatch.setattr(output_files.StagedFiles, "place", late)
    before = state()
    status, _, err = run(*CASES["texture"].line())
    assert (status, err) == (2, "mdfconv: y.png exists; it can be replaced (--force)\n")
    assert state() == {**before, "y.png": OLD}


@pytest.mark.parametrize(
    "options",
    [
        [], ["--to", "gauss"], ["--to", "ggx:roughness"], ["--method", "peak"],
        ["--method", "fit", "--metric", "energy"],
        ["--metric", "display"], ["--exposure", "4"], ["--light", "area"], ["--unit"],
        ["--brdf", "smoothie"], ["--material", "gold"], ["--material", "acrylic"],
    ],
)  # fmt: skip
def test_pictures_have_the_names_of_what_they_show(options):
    """So that no two of these have one."""
    assert run("compare", *SMALLEST, *options, "--output", "out")[0] == 0
    names = {path.name for path in Path("out").iterdir()}
    start = "compare-beckmann-0.4"
    words = [word.removeprefix("--").replace(":", "-") for word in options]
    values = [word for word in words if word not in ("to", "method", "metric", "light", "brdf",
                                                     "material")]  # fmt: skip
    expected = "-".join([start, *values]).replace("unit", "unit-form")
    expected = expected.replace("-display", "-fit-display")
    assert names == {f"{expected}.png", f"{expected}.csv"}


def test_figures_of_the_paper_keep_their_names():
    assert run("compare", "--size", "64", "--dpi", "10", "--output", "out")[0] == 0
    names = {path.name for path in Path("out").iterdir()}
    assert names == {f"fig{number}.{end}" for number in (4, 5) for end in ("png", "csv")}
