"""Pictures inspected: textures, of which the name may say what they hold, and environment maps."""

from __future__ import annotations

import re
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from mdfconv.distributions.endpoint import encodings_of
from mdfconv.errors import MdfconvError
from mdfconv.light.spectrum import read_environment_map, spectrum_of
from mdfconv.scene.inspection.records import (
    TARGET,
    Arguments,
    FileInspection,
    InspectedTexture,
    NextStep,
    result_path,
)
from mdfconv.scene.light import LightReport
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.scene.texture import images
from mdfconv.scene.texture.channels import find_channels
from mdfconv.scene.texture.images import PictureFile, PictureForm

# The types of texels in words.
_DEPTHS = {
    "uint8": "8 bits", "uint16": "16 bits", "half": "16-bit floats", "float": "32-bit floats",
    "double": "64-bit floats",
}  # fmt: skip
# What a reader of OpenEXR says of pictures of the surroundings.
_MAPPING, _ENVIRONMENT = "textureformat", "Environment"
# Where a picture is asked for all its channels.
_ANY = "any"


def _picture_of(source: PictureFile, channel: str | None) -> InspectedTexture:
    """Return the size, the depth and the channels of a picture, of which one may be chosen.

    None chooses the only one, `_ANY` leaves it open.
    """
    form = images.form_of(source)
    lossy = form is images.JPEG
    try:
        return _opened(source, form, channel, lossy=lossy)
    except MdfconvError as error:
        if lossy or error.argument != "lossy":
            raise
        return _opened(source, form, channel, lossy=True)


def picture_of_bytes(data: bytes, suffix: str, channel: str) -> InspectedTexture:
    """Return the size, the depth and the channels of a picture within another file."""
    with TemporaryDirectory() as folder:
        source = PictureFile(Path(folder) / f"texture{suffix}", "the texture")
        source.path.write_bytes(data)
        return _picture_of(source, channel)


def picture_beside(path: Path, file: str) -> InspectedTexture:
    """Return a texture that a file of materials names, as its converter takes it."""
    picture = _picture_of(PictureFile(path.parent / file.replace("\\", "/"), file), None)
    if picture.lossy:
        raise MdfconvError(f"{file} is compressed with losses, which has altered the values")
    return replace(picture, file=file)


def _opened(
    source: PictureFile, form: PictureForm, channel: str | None, *, lossy: bool
) -> InspectedTexture:
    opened = images.open_picture(source, form, form, lossy=lossy, max_pixels=None)
    with opened as picture:
        kinds = dict.fromkeys(_DEPTHS.get(kind, kind) for kind in picture.kinds)
        chosen = () if channel == _ANY else find_channels(picture, channel).names
        return InspectedTexture(
            file=source.path.name,
            place="",
            form=str(form),
            width=picture.width,
            height=picture.height,
            depth=" and ".join(kinds),
            channels=" ".join(map(_channel_name, picture.layout.names)),
            channel=" ".join(map(_channel_name, chosen)),
            lossy=lossy,
        )


def _channel_name(name: str) -> str:
    """Return the name by which a channel is chosen."""
    return name.lower().replace("y", "l") if len(name) == 1 else name


# What names of files say of the channel, besides what they say of the texels, and into which the
# roughness goes.
_PACKED = {
    "metallicroughness": ("g", "g"),
    "occlusionroughness": ("g", "g"),
    "metallicsmoothness": ("a", "g"),
}
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_STEMS = ("rough", "gloss", "smooth")
_UNSAID = "unknown: nothing in the file says it"


def inspect_picture(path: Path) -> FileInspection:
    """Return what a picture is: a texture, or an environment map."""
    mapping = _mapping(path)
    if _ENVIRONMENT in mapping:
        return inspect_light(path)
    texture = _picture_of(PictureFile(path), _ANY)
    if texture.form == str(images.EXR) and texture.width == 2 * texture.height:
        # What is black or of one colour may still be a texture.
        with suppress(MdfconvError):
            return inspect_light(path)
    joined = "".join(word.lower() for word in _WORD.findall(path.stem))
    packed, new = next((each for name, each in _PACKED.items() if name in joined), ("", ""))
    channels = texture.channels.split()
    channel = channels[0] if len(channels) == 1 else packed if packed in channels else ""
    taken_for = _texels_by_name(joined)
    which = f"{channel} is read" if channel else "one is to be chosen"
    arguments: Arguments = {"source": taken_for or None, "target": ROUGHNESS}
    if len(channels) > 1:
        arguments["channel"] = channel or None
    if channel == packed != new:
        arguments["to_channel"] = new
    if texture.lossy:
        arguments["lossy"] = True
    output = result_path(path)
    output = output.with_suffix(".png") if texture.form == str(images.JPEG) else output
    step = NextStep("texture", arguments, output)
    return FileInspection(
        file=path,
        kind=f"{texture.form} picture",
        taken_for=f"{taken_for}, a guess by its name" if taken_for else _UNSAID,
        facts={
            "size": f"{texture.width}×{texture.height}, {texture.depth}",
            "channels": texture.channels + (f", of which {which}" if len(channels) > 1 else ""),
        },
        textures=[replace(texture, channel=channel, taken_for=taken_for)],
        notes=["its compression has altered the values"] if texture.lossy else [],
        next_step=None if taken_for == ROUGHNESS else step,
    )


def _texels_by_name(name: str) -> str:
    """Return what the texels of a picture are if its name says so: "" if it does not."""
    encodings = {word: f"{TARGET.name}:{word}" for word in encodings_of(TARGET)}
    known = encodings | dict(TARGET.meant_by)
    found = [stem for stem in _STEMS if stem in name]
    for stem in found if len(found) == 1 else []:
        for word, meant in known.items():
            if stem in word:
                return meant
    return ""


def _mapping(path: Path) -> str:
    """Return onto what an OpenEXR file says that it is mapped; "" if it says nothing."""
    import OpenImageIO

    source = PictureFile(path)
    if images.form_of(source) is not images.EXR:
        return ""
    with images.reading(source):
        file = OpenImageIO.ImageInput.open(str(path))
        if file is None:
            raise ValueError(OpenImageIO.geterror())
        with closing(file):
            return str(file.spec().get_string_attribute(_MAPPING))


def inspect_light(path: Path) -> FileInspection:
    """Return what an environment map is."""
    luminance = read_environment_map(path)
    height, width = luminance.shape
    return FileInspection(
        file=path,
        kind="environment map",
        facts={
            "size": f"{width}×{height}",
            "light": LightReport(spectrum_of(luminance)).sentence,
        },
        next_step=NextStep("light"),
    )
