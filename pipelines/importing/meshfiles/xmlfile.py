"""Reads XML files that others wrote with lxml: no entity of theirs is opened, whatever encoding they are in."""

import re
from pathlib import Path
from typing import TypeAlias

from lxml import etree

Element: TypeAlias = etree._Element


def read_xml(path: Path) -> Element:
    """The root of an XML file, without comments.

    Raises:
        ValueError: It declares entities, or is not well-formed.
    """
    data = path.read_bytes().lstrip(b" \t\r\n")  # many have a blank line before their declaration
    if re.search(rb"<!\s*(ENTITY|DOCTYPE[^>]*(SYSTEM|PUBLIC))", data.replace(b"\x00", b""), re.IGNORECASE):
        raise ValueError("it declares entities or names a document type elsewhere, which are not opened")
    try:
        return _parsed(data)
    except (etree.XMLSyntaxError, LookupError, ValueError) as error:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            text = re.sub(r"^\s*<\?xml[^>]*\?>", "", data.decode("cp1252", "replace"))
            try:
                return _parsed(text)
            except etree.XMLSyntaxError:
                pass
        raise ValueError(f"it is no well-formed XML: {error}") from None


def _parsed(data: bytes | str) -> Element:
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=True, remove_comments=True,
        remove_pis=True,
    )  # fmt: skip
    return etree.fromstring(data, parser)


def local_name(element: Element) -> str:
    """An element's name without its namespace."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def numbers(text: str | None) -> list[float]:
    """The numbers in a text.

    Raises:
        ValueError: One is not a number.
    """
    return [float(word) for word in (text or "").split()]
