"""``mdfconv texture``."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from mdfconv.cli import completion, options, process, tables
from mdfconv.cli.options import argument, flag, option
from mdfconv.cli.outputs import Outputs, new_folder
from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.output.files import StagedFiles
    from mdfconv.scene.texture.texel_map import TextureReport

_SOURCE = option(
    "MDF:ENCODING",
    "What the texels are: ggx:alpha, ggx:roughness, ggx:glossiness, likewise beckmann; with "
    "--exponent-min A and --exponent-max B blinn-phong:exponent (N = A + (B - A) v) and "
    "blinn-phong:reflected-exponent (n, of the reflected ray, likewise); with --log2-offset A "
    "and --log2-scale K blinn-phong:log2 (N = 2^(A + K v)).",
    "--from",
    words=completion.texels,
)
_TARGET = option(
    "MDF:ENCODING", "What they become, as for --from.", "--to", words=completion.texels
)
_CHANNEL = option(
    "C",
    "r, g, b, a or l (grey), in OpenEXR its name; several as rgb or r,g. Needed if "
    "there are several.",
)
_TO_CHANNEL = option(
    "C", "Channel that gets the results, if not --channel itself; all others stay as they are."
)
_INTO = option("PICTURE", "File with the other channels of the result; by default IN itself.")
_FACTOR = option("F", "What the program multiplies texels by before it reads them, up to 1.")
_EXPONENT_MAX = option("N", "Exponent of the brightest texel, for exponent and reflected-exponent.")
_EXPONENT_MIN = option("N", "Exponent of the darkest texel, likewise; 1 to 150 for Source.")
_LOG2_SCALE = option("K", "For log2; 13 is for exponents up to 8192.")
_LOG2_OFFSET = option("A", "For log2; 1 with a scale of 10 for exp2(10 v + 1).")
_LOSSY = flag("--lossy", "Take a JPEG or lossy OpenEXR, although it has altered the values.")
_MAX_PIXELS = option("N", "Largest picture to decode; default 134217728.", min=1)
_OUTPUT = option("OUT", "File, not IN; or a folder: one that exists, or out/.", "--output", "-o")
# By the options for the texels of exponents the encodings that have them.
_OF_ENCODINGS = {
    ("exponent_min", "exponent_max"): ("exponent", "reflected-exponent"),
    ("log2_scale", "log2_offset"): ("log2",),
}
# Signals that ask a process to end.
_ENDING = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
_REMEDY = "--depth 16 or --dither keep the gradient"


def command(
    context: typer.Context,
    sources: Annotated[
        list[str],
        argument("IN...", "Textures: PNG, TIFF, TGA or OpenEXR; names, patterns, folders."),
    ],
    output: Annotated[str, _OUTPUT],
    source: Annotated[str, _SOURCE],
    target: Annotated[str, _TARGET],
    channel: Annotated[str | None, _CHANNEL] = None,
    to_channel: Annotated[str | None, _TO_CHANNEL] = None,
    into: Annotated[Path | None, _INTO] = None,
    factor: Annotated[float, _FACTOR] = 1.0,
    method: options.MethodOption = None,
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    gamma: options.FixedGammaOption = None,
    specular: options.SpecularOption = None,
    exponent_min: Annotated[float, _EXPONENT_MIN] = 0.0,
    exponent_max: Annotated[float, _EXPONENT_MAX] = 1000.0,
    log2_scale: Annotated[float, _LOG2_SCALE] = 13.0,
    log2_offset: Annotated[float, _LOG2_OFFSET] = 0.0,
    depth: Annotated[Literal["keep", "8", "16"], typer.Option(help="Bits of the result.")] = "keep",
    dither: Annotated[bool, flag("--dither", "Diffuse the errors of rounding to 8 bits.")] = False,
    lossy: Annotated[bool, _LOSSY] = False,
    max_pixels: Annotated[int | None, _MAX_PIXELS] = None,
    png: options.PngOption = None,
    dry_run: options.DryRunOption = False,
    force: options.ForceOption = False,
) -> None:
    """Convert roughness textures, texel by texel.

    Keeps the light of a natural environment, unless --metric or --method says otherwise. Other
    channels, ICC profile, resolution and the tag of the orientation are kept, and texels stay
    where they are stored. Says on standard error what texels were taken for, and how many had no
    answer and took the nearest: a black texel of an exponent is the roughest surface, one of an
    alpha or a roughness a perfect mirror.

    Examples:

    mdfconv texture gloss.png -o rough.png --from blinn-phong:exponent --to ggx:roughness

    mdfconv texture u.png -o orm.png --channel a --to-channel g --from ggx:glossiness
    --to ggx:roughness (the metallic-smoothness map of Unity to that of glTF)

    mdfconv texture g.png -o new.png --into orm.png --to-channel g --from ggx:glossiness
    --to ggx:roughness (a map of glossiness to the green channel of another picture)

    mdfconv texture orm.png -o new.png --channel g --from ggx:roughness --to ggx:alpha --depth 8

    mdfconv texture 'maps/*.png' -o out/ --from blinn-phong:log2 --log2-scale 10 --log2-offset 1
    --to ggx:roughness (N = 2^(10 v + 1))
    """
    from mdfconv.distributions.endpoint import with_specular
    from mdfconv.scene.material_files import is_folder
    from mdfconv.scene.texture.convert import convert_texture_file
    from mdfconv.scene.texture.rule import TextureRule

    _check_given(context, source, target)
    options.refuse_idle_metric(context, method)
    chosen = options.chosen_metric(metric, exposure)
    files = _pictures(sources)
    if len(files) > 1:
        options.refuse_given(context, ["png", "into"], f"goes with one texture, not {len(files)}")
    results = _results(files, output)
    if is_folder(output) and not dry_run:
        new_folder(context, Path(output))
    inputs = [*files, *([into] if into else []), *chosen.inputs]
    outputs = Outputs(*(() if dry_run else (*results, png)), force=force, inputs=inputs)
    ends, fixed = with_specular(source, target, specular), options.fixed_gamma(gamma)
    rule = TextureRule(
        *ends,
        method,
        str(chosen),
        exponent_max=exponent_max,
        exponent_min=exponent_min,
        log2_scale=log2_scale,
        log2_offset=log2_offset,
        gamma=fixed,
        factor=factor,
    )
    work = partial(
        convert_texture_file,
        rule=rule,
        channel=channel,
        to_channel=to_channel,
        into=into,
        depth=None if depth == "keep" else int(depth),
        dither=dither,
        lossy=lossy,
        max_pixels=max_pixels,
    )
    with TemporaryDirectory() as scratch, outputs.staged() as staged:
        fill = partial(_scratch_file, scratch) if dry_run else staged.fill
        reports = _converted(work, files, results, staged, fill)
        if png and not dry_run:
            from mdfconv.scene.texture.texel_map import draw_histograms

            staged.add(png, draw_histograms(reports[0], f"{files[0].name} → {results[0].name}"))
    for file, result, report in zip(files, results, reports, strict=True):
        _tell(file if len(files) > 1 else None, result, report, dry_run=dry_run)
    if png and not dry_run:
        process.tell(f"wrote {png}")


def _pictures(patterns: Sequence[str]) -> list[Path]:
    """Return the files that names, patterns and folders stand for."""
    from mdfconv.output.files import find_files
    from mdfconv.scene.texture.images import pictures_in

    names: list[str] = []
    for pattern in patterns:
        is_folder = Path(pattern).is_dir()
        names += map(str, pictures_in(Path(pattern))) if is_folder else [pattern]
    return find_files(names)


def _results(files: Sequence[Path], output: str) -> list[Path]:
    """Return where the conversions go: in a folder that of a JPEG is a PNG."""
    from mdfconv.scene.material_files import choose_outputs, is_folder
    from mdfconv.scene.texture.images import result_name

    results = [destination.output for destination in choose_outputs(files, output)]
    return [result_name(result) for result in results] if is_folder(output) else results


def _scratch_file(folder: str, _: Path) -> Path:
    """Return a new file that is thrown away with its folder."""
    with NamedTemporaryFile(dir=folder, delete=False) as file:
        return Path(file.name)


def _converted(
    work: Callable[..., TextureReport],
    files: Sequence[Path],
    results: Sequence[Path],
    staged: StagedFiles,
    fill: Callable[[Path], Path],
) -> list[TextureReport]:
    """Convert files to where they are filled, several in processes, with a bar on a terminal."""
    if len(files) == 1:
        return [work(files[0], results[0], fill=fill, progress=tables.progress)]
    reports = []
    with _pool(len(files)) as pool:
        with _signals_wait():
            begun = [
                pool.submit(work, file, result, fill=partial(_chosen, fill(result)))
                for file, result in zip(files, results, strict=True)
            ]
        # The bar has a thread, of which a fork would know nothing.
        with tables.progress("textures", len(files)) as advance:
            # What cannot be written is named by the one that is at work.
            for staged.current, texture in zip(results, begun, strict=True):
                reports.append(texture.result())
                advance(1)
    return reports


@contextmanager
def _pool(most: int) -> Iterator[ProcessPoolExecutor]:
    """Give processes, of which so many are useful; in the end they begin nothing more."""
    pool = ProcessPoolExecutor(
        min(most, os.cpu_count() or 1), initializer=_begin, initargs=(os.getpid(),)
    )
    try:
        yield pool
    except BrokenProcessPool:
        raise MdfconvError(
            "a process that converts textures was ended from outside, perhaps for want of memory",
            "convert fewer or smaller ones at once",
        ) from None
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def _signals_wait() -> Iterator[None]:
    """Let signals that end the process wait: amid a fork their exceptions would be lost."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(parent: int) -> None:
    """Let a process of the pool end by signals, at once and unheard, and with its parent.

    A terminal sends signals to all; a parent that is killed sends nothing.
    """
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    for number in _ENDING:
        signal.signal(number, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)


def _chosen(place: Path, _: Path) -> Path:
    """Return the place that another process has chosen."""
    return place


def _tell(file: Path | None, result: Path, report: TextureReport, *, dry_run: bool) -> None:
    """Say what became of a texture; `file` names it if it is one of several."""
    name = f"{file}: " if file else ""
    lost = report.lost_levels()
    for note in (*report.notes(), *([f"{lost}; {_REMEDY}"] if lost else [])):
        process.tell(f"note: {name}{note}")
    channels = f"{report.channels}, " if report.channels else ""
    keeps = f"keeps the {report.keeps}" if report.keeps else "the same lobes"
    process.tell(
        f"{'would write' if dry_run else 'wrote'} {result}: {channels}{report.source} to "
        f"{report.target}, {keeps}"
    )


def _check_given(context: typer.Context, *names: str) -> None:
    """Refuse what says nothing about these names."""
    encodings = {name.partition(":")[2].strip().lower() for name in names}
    for given, known in _OF_ENCODINGS.items():
        if encodings.isdisjoint(known):
            needed = " or ".join(f"blinn-phong:{encoding}" for encoding in known)
            options.refuse_given(context, given, f"goes with {needed}")


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
