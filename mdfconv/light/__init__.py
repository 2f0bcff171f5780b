"""Light: environment maps, their angular power spectra, and those of lobes."""

from mdfconv.light.spectrum import LobeSpectrum, Spectrum, spectrum_of, spectrum_of_file

__all__ = ["LobeSpectrum", "Spectrum", "spectrum_of", "spectrum_of_file"]
