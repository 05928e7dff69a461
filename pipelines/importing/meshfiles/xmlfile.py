"""Reads XML files that others wrote: no entity of theirs is opened, whatever encoding they are in."""

import re
from pathlib import Path
from xml.etree import ElementTree

Element = ElementTree.Element


def read_xml(path: Path) -> Element:
    """The root of an XML file.

    Raises:
        ValueError: It declares entities, or is not well-formed.
    """
    data = path.read_bytes().lstrip(b" \t\r\n")  # many have a blank line before their declaration
    if re.search(rb"<!\s*(ENTITY|DOCTYPE[^>]*(SYSTEM|PUBLIC))", data.replace(b"\x00", b""), re.IGNORECASE):
        raise ValueError("it declares entities or names a document type elsewhere, which are not opened")
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            text = re.sub(r"^\s*<\?xml[^>]*\?>", "", data.decode("cp1252", "replace"))
            try:
                return ElementTree.fromstring(text)
            except ElementTree.ParseError:
                pass
        raise ValueError(f"it is no well-formed XML: {error}") from None


def local_name(element: Element) -> str:
    """An element's name without its namespace."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def numbers(text: str | None) -> list[float]:
    """The numbers in a text.

    Raises:
        ValueError: One is not a number.
    """
    return [float(word) for word in (text or "").split()]
