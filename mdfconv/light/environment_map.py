"""Environment maps: the luminance of a panorama of twice its height, from any picture file."""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError

# Of linear Rec. 709 (ITU-R BT.709), the primaries of OpenEXR and Radiance files.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
# A map is often the reduction of a larger one, and the filter that made it has overshot beside
# its lights: by at most a quarter of what shines within four texels.
_OVERSHOOT, _FILTER_WIDTH = 0.25, 9
# Where a spectrum has a slope that means something.
_LEAST_HEIGHT = 64


def read_environment_map(path: str | Path) -> Array:
    """Return the luminance of an environment map in latitude and longitude.

    Parameters
    ----------
    path : str or Path
        A picture that OpenImageIO reads, OpenEXR or Radiance .hdr for one; taken as linear. The
        first row is the zenith.

    Returns
    -------
    numpy.ndarray, shape (h, 2 h)
        Luminance.

    Raises
    ------
    MdfconvError
        If it cannot be read as a whole, is not twice as wide as high, has fewer than 64 rows, is
        not finite, black or of one colour, or has negative texels that no filter has made.
    """
    pixels = _read(Path(path))
    height, width = pixels.shape[:2]
    if width != 2 * height:
        raise MdfconvError(f"{path}: an environment map has a shape of 2:1, not {width}×{height}")
    if height < _LEAST_HEIGHT:
        raise MdfconvError(f"{path}: a spectrum takes {_LEAST_HEIGHT} rows, not {height}")
    if not np.isfinite(pixels).all():
        count = int(np.count_nonzero(~np.isfinite(pixels).all(axis=2)))
        raise MdfconvError(f"{path}: {count} of {height * width} texels are NaN or infinite")
    colour = pixels.shape[2] > 2
    luminance: Array = (pixels @ _LUMINANCE if colour else pixels[:, :, 0]).astype(np.float64)
    _check_light(luminance, path)
    return luminance


def _read(path: Path) -> Array:
    """Return the first colour channels of a picture, shape (h, w, 1 to 3), float32."""
    import OpenImageIO

    # The library opens names with patterns in them, and devices; a file is what it is.
    try:
        regular = stat.S_ISREG(path.stat().st_mode)
    except OSError as error:
        raise MdfconvError(f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:  # a name with a 0 in it
        raise MdfconvError(f"cannot read {path}: {error}") from None
    if not regular:
        raise MdfconvError(f"cannot read {path}: it is not a file")
    source = OpenImageIO.ImageInput.open(str(path))
    if source is None:
        raise MdfconvError(f"cannot read {path}: {_first_line(OpenImageIO.geterror())}")
    try:
        shape = source.spec()
        if (shape.width, shape.height) != (shape.full_width, shape.full_height):
            raise MdfconvError(f"{path}: a part of a larger picture is no environment map")
        channels = min(shape.nchannels, 3)
        pixels = source.read_image(0, 0, 0, channels, "float")
        fault = source.geterror()
    finally:
        source.close()
    if pixels is None or fault:
        raise MdfconvError(f"cannot read {path}: {_first_line(fault)}")
    return np.asarray(pixels)


def _first_line(text: str) -> str:
    return (text.strip().splitlines() or ["it is damaged"])[0]


def _check_light(luminance: Array, path: str | Path) -> None:
    from scipy.ndimage import maximum_filter

    if not luminance.any():
        raise MdfconvError(f"{path}: the map is black")
    if np.ptp(luminance) == 0:
        raise MdfconvError(
            f"{path}: the map is of one colour, under which all surfaces look the same"
        )
    bright = maximum_filter(luminance, _FILTER_WIDTH, mode=("nearest", "wrap"))
    negative = np.count_nonzero(-luminance > _OVERSHOOT * np.maximum(bright, 0))
    if negative:
        raise MdfconvError(f"{path}: {negative} of {luminance.size} texels are negative")
