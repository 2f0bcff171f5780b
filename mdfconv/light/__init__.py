"""Light: environment maps, their angular power spectra, and those of lobes."""
