"""Environment maps for tests, made with the library that reads them."""

import numpy as np
import OpenImageIO


def write_map(path, luminance):
    """Write luminance, shape (h, w), as a grey picture of three channels; return its path."""
    pixels = np.repeat(np.asarray(luminance, np.float32)[..., None], 3, axis=2)
    height, width = pixels.shape[:2]
    output = OpenImageIO.ImageOutput.create(str(path))
    output.open(str(path), OpenImageIO.ImageSpec(width, height, 3, "float"))
    output.write_image(np.ascontiguousarray(pixels))
    output.close()
    return path


def directions(height):
    """Return zenith angle, shape (h, 1), and azimuth, shape (1, 2 h), of the texels."""
    zenith = np.pi * (np.arange(height) + 0.5) / height
    azimuth = np.pi * (np.arange(2 * height) + 0.5) / height
    return zenith[:, None], azimuth[None, :]


def room(height=64, seed=1):
    """Return the luminance of a wall with a lamp, and noise that falls like l^-2 or so."""
    zenith, azimuth = directions(height)
    noise = np.random.default_rng(seed).standard_normal((height, 2 * height))
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.fftfreq(2 * height)[None, :])
    pink = np.fft.ifft2(np.fft.fft2(noise) / np.maximum(frequency, 1 / height)).real
    lamp = np.exp(-((zenith - 1.0) ** 2 + (azimuth - 2.0) ** 2) / 0.01)
    return 1 + 0.2 * pink / np.abs(pink).max() + 20 * lamp
