"""Figures as files."""

import io

import numpy as np
from PIL import Image

from mdfconv.output.figures import encoded, new_figure


def test_a_png_is_what_matplotlib_saves():
    """Laid out before, it is drawn once: the pixels are those of Matplotlib's two turns."""
    pictures = []
    for save in (False, True):
        figure = new_figure(4, 3)
        axes = figure.subplots(1, 2)
        axes[0].plot([0, 1], [1e-3, 1e6], label="a long enough label")
        axes[0].set(xlabel="x", ylabel="y", yscale="log", title="left")
        axes[1].imshow(np.arange(6).reshape(2, 3))
        figure.legend(loc="outside lower center")
        if save:
            figure.savefig(buffer := io.BytesIO(), format="png", dpi=80)
            data = buffer.getvalue()
        else:
            data = encoded(figure, dpi=80)
        with Image.open(io.BytesIO(data)) as picture:
            pictures.append(np.asarray(picture))
            assert picture.info["dpi"] == (80.01, 80.01) or round(picture.info["dpi"][0]) == 80
    np.testing.assert_array_equal(*pictures)
