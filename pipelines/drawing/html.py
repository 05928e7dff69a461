"""What pages of HTML need: templates that escape their values, and pictures that hold their own data."""

import base64
from typing import NamedTuple

import cv2
from jinja2 import Environment, PackageLoader, StrictUndefined

from pipelines.drawing.files import encoded
from pipelines.drawing.palette import Picture


class Image(NamedTuple):
    """A picture as a page shows it.

    Attributes:
        words: Read out instead of it.
        width: Columns [px].
        height: Rows [px].
        source: Its data as a URI.
    """

    words: str
    width: int
    height: int
    source: str


def flat_image(picture: Picture, words: str) -> Image:
    """A picture of few colours with sharp edges: kept exactly, as PNG.

    Args:
        picture: The picture.
        words: Read out instead of it.
    """
    return _image(picture, words, "image/png", encoded(picture, "png", (cv2.IMWRITE_PNG_COMPRESSION, 9)))


def photo_image(picture: Picture, words: str) -> Image:
    """A picture of many colours: kept nearly, as JPEG.

    Args:
        picture: The picture.
        words: Read out instead of it.
    """
    return _image(picture, words, "image/jpeg", encoded(picture, "jpeg", (cv2.IMWRITE_JPEG_QUALITY, 82)))


def _image(picture: Picture, words: str, media_type: str, data: bytes) -> Image:
    height, width = picture.shape[:2]
    return Image(words, width, height, f"data:{media_type};base64,{base64.b64encode(data).decode('ascii')}")


def templates_of(package: str) -> Environment:
    """The templates in a package's folder "templates"; a name that a template is not given is an error.

    Args:
        package: Its full name.
    """
    return Environment(
        loader=PackageLoader(package),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
