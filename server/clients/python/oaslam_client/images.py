"""Images as the service wants them."""
from __future__ import annotations

import base64
import os
from typing import Any, Dict, Mapping, Union

from .shapes import Image


def bytes_of(image: Union[bytes, str, "os.PathLike[str]"]) -> bytes:
    """Raises OSError for a path without a file."""
    if isinstance(image, (bytes, bytearray, memoryview)):
        return bytes(image)
    with open(image, "rb") as file:
        return file.read()


def entry_of(image: Image, **defaults: Any) -> Dict[str, Any]:
    """An image of a localize request. Defaults that are None are left out."""
    entry = {key: value for key, value in defaults.items() if value is not None}
    if not isinstance(image, Mapping):
        image = {"image": image}
    entry.update(image)
    if entry.get("image") is not None:
        entry["image"] = base64.b64encode(bytes_of(entry["image"])).decode()
    return entry
