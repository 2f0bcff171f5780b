"""The machine on which something was measured."""

from __future__ import annotations

import os
import platform
from pathlib import Path

import numpy as np
import scipy

_CPU_INFO = Path("/proc/cpuinfo")


def describe() -> dict[str, str]:
    """Return processor, its vector extensions as NumPy uses them, system and versions."""
    config = np.show_config(mode="dicts")
    extensions = config.get("SIMD Extensions", {}).get("found", []) if config else []
    return {
        "cpu": _cpu_model(),
        "cpus": str(os.cpu_count()),
        "vector_extensions": " ".join(extensions) or "none beyond NumPy's baseline",
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }


def _cpu_model() -> str:
    """Return the model as Linux names it, or what the platform knows."""
    try:
        lines = _CPU_INFO.read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()
