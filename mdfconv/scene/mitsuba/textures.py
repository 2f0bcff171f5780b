"""Bitmaps of α in a Mitsuba scene: converted, to stand beside the converted scene."""

from __future__ import annotations

from pathlib import Path

from mdfconv.fitting.metrics import Metric
from mdfconv.scene.material_files import free_name, read_file
from mdfconv.scene.texture.convert import convert_texture_bytes
from mdfconv.scene.texture.rule import TextureRule


class BitmapConverter:
    """Converts the bitmaps that a scene names, for `convert_mitsuba`.

    Parameters
    ----------
    scene, output : Path
        The scene, which the files are named relative to, and its conversion.
    target : str
        The distribution that their α is to be of.
    metric : str or Metric
        What the fit keeps.
    """

    def __init__(self, scene: Path, output: Path, target: str, metric: str | Metric) -> None:
        self._scene, self._output = scene, output
        self._target, self._metric = target, str(metric)
        self._done: dict[tuple[Path, str], str] = {}
        self._files: dict[Path, bytes] = {}

    def __call__(self, file: str, distribution: str) -> str:
        """Convert a bitmap; return its new name: ``wood.png`` becomes ``wood_ggx.png``.

        Another of that name becomes ``wood_ggx_2.png``.

        Parameters
        ----------
        file : str
            As the scene names it.
        distribution : str
            What its texels are, such as ``"beckmann"``.

        Raises
        ------
        MdfconvError
            If it cannot be read or converted.
        """
        # Scenes from Windows separate folders by backslashes.
        source = self._scene.parent / file.replace("\\", "/")
        key = source, distribution
        if key not in self._done:
            stem = f"{source.stem}_{self._target}"
            target = free_name(self._output.parent, stem, source.suffix, self._files)
            rule = TextureRule(distribution, self._target, metric=self._metric)
            self._files[target], _ = convert_texture_bytes(read_file(source), source.suffix, rule)
            self._done[key] = target.name
        return self._done[key]

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The bitmaps that were converted."""
        return tuple(source for source, _ in self._done)

    def files(self, names: set[str]) -> dict[Path, bytes]:
        """Return the converted files of some names."""
        return {path: data for path, data in self._files.items() if path.name in names}
