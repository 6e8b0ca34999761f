"""Images, colour of 8 bits (PNG, JPEG) and depth of 16 (PNG): the one module that imports pillow (extra `images`)."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadFile, MissingDependency
from steelyard.io.contents import read_whole
from steelyard.shape.eight_bits import Colours
from steelyard.shape.views import Depths
from steelyard.whole_files import write_bytes

MOST_PIXELS = 64_000_000


def require_images() -> Any:
    """Return what reads and writes images; raises MissingDependency where nothing does here."""
    try:
        import PIL.Image
    except ImportError:
        raise MissingDependency.of("pillow", "images", "Reading and writing images") from None
    return PIL.Image


def read_depth(path: Path) -> Depths:
    """Return a depth image (H, W) uint16; raises BadFile where it has not one channel of 16 bits."""
    image = _opened(path, ("PNG",))
    if not image.mode.startswith("I"):
        raise BadFile(f"{path}: depth must be a PNG with one channel of 16 bits; this one has mode {image.mode}.")
    return np.asarray(_pixels(path, image), np.uint16)


def read_colour(path: Path) -> Colours:
    """Return a colour image (H, W, 3) uint8; raises BadFile."""
    image = _opened(path, ("PNG", "JPEG"))
    if image.mode not in ("RGB", "RGBA", "L", "P", "LA"):
        raise BadFile(f"{path}: colour must be RGB or grey with 8 bits per channel; this image has mode {image.mode}.")
    return np.asarray(_pixels(path, image, "RGB"), np.uint8)


def _opened(path: Path, formats: tuple[str, ...]) -> Any:
    pillow = require_images()
    if not path.exists():
        raise BadFile(f"{path}: this image is missing.")
    content = read_whole(path)
    try:
        image = pillow.open(io.BytesIO(content), formats=formats)
    except pillow.DecompressionBombError:
        raise BadFile(f"{path}: this image has more pixels than any depth camera.") from None
    except (OSError, ValueError, SyntaxError):
        raise BadFile(f"{path}: expected a {' or '.join(formats)} image; found something else.") from None
    if image.width * image.height > MOST_PIXELS:
        raise BadFile(f"{path}: {image.width} x {image.height} pixels are more than any depth camera has.")
    return image


def _pixels(path: Path, image: Any, mode: str | None = None) -> Any:
    try:
        return np.asarray(image if mode is None else image.convert(mode))
    except (OSError, ValueError, SyntaxError) as error:
        raise BadFile(f"{path}: this image is damaged ({error}). Save it again.") from None


def write_image(path: Path, pixels: Depths | Colours) -> None:
    """Write (H, W) uint16 or (H, W, 3) uint8 as PNG; raises BadFile."""
    content = io.BytesIO()
    require_images().fromarray(np.ascontiguousarray(pixels)).save(content, "PNG", compress_level=1)
    write_bytes(path, content.getvalue())
