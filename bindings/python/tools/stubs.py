"""Writes the types of the module to a stub:  stubs.py [--check] STUB

They are read from the signatures that pybind11 writes at the top of docstrings. With --check: fails if the stub says something else.
"""
import argparse
import inspect
import re
import sys

import oaslam

HEADER = """# Made by bindings/python/tools/stubs.py; bindings/python/tests/stubs_test.py compares it with the module.
from typing import Any, Callable, ClassVar, Dict, FrozenSet, Iterator, List, Mapping, Optional, Sequence, Set, Tuple, Union

import os

import numpy
import numpy.typing

"""
RECORDS = "numpy.typing.NDArray[numpy.void]"
# Where the signature does not tell, since Python's own types go in or out.
FUNCTIONS = {"set_log_sink": "(sink: Optional[Callable[[LogLevel, str], None]]) -> None"}
PROPERTIES = {
    "BackgroundDetector.Result.detections": "Tuple[Detection, ...]",
    "Camera.distortion": "Tuple[float, float, float, float, float]",
    "ClassRelations.movable": "FrozenSet[int]",
    "ClassRelations.whole_of": "Mapping[int, int]",
    "Detection.other_labels": "Tuple[Label, ...]",
    "ImageDetections.detections": "Tuple[Detection, ...]",
    "InputImage.image": "Optional[numpy.typing.NDArray[numpy.uint8]]",
    "TrackingResult.elsewhere": "Tuple[PoseElsewhere, ...]",
}


def type_in(text):
    """The type of an argument: sequences and arrays of any kind are taken."""
    text = text.replace("numpy.ndarray[numpy.uint8]", "numpy.typing.NDArray[numpy.uint8]")
    text = re.sub(r"numpy\.ndarray\[numpy\.float64(\[[^\]]*\])?\]", "numpy.typing.ArrayLike", text)
    text = re.sub(r"numpy\.ndarray(?!\[)", "numpy.typing.NDArray[numpy.generic]", text)
    text = re.sub(r"\bList\[", "Sequence[", text)
    text = re.sub(r"Annotated\[Sequence\[(\w+)\], FixedSize\(\d+\)\]|Sequence\[(\w+)\[\d+\]\]", r"Sequence[\1\2]", text)
    text = text.replace("os.PathLike", "Union[str, os.PathLike[str]]")
    return text.replace("oaslam.", "")


def type_out(text):
    text = text.replace("numpy.ndarray[numpy.uint8]", "numpy.typing.NDArray[numpy.uint8]")
    text = re.sub(r"numpy\.ndarray\[numpy\.float64(\[[^\]]*\])?\]", "numpy.typing.NDArray[numpy.float64]", text)
    text = re.sub(r"numpy\.ndarray(\[[^\]]*Row\])?$", RECORDS, text)
    text = re.sub(r"List\[(\w+)\[\d+\]\]", r"List[\1]", text)
    return text.replace("oaslam.", "")


def split(text):
    """The arguments in a signature, separated by commas outside of brackets."""
    parts, depth, part = [], 0, ""
    for character in text:
        depth += (character in "[({<") - (character in "])}>")
        if character == "," and depth == 0:
            parts.append(part.strip())
            part = ""
        else:
            part += character
    return parts + [part.strip()] if part.strip() else parts


def signature(function):
    """'(self, image: ..., timestamp: float = ...) -> ...' of a function of pybind11."""
    if getattr(function, "__name__", "") in FUNCTIONS:
        return FUNCTIONS[function.__name__]
    match = re.match(r"\w*\((.*)\) -> (.*)", (function.__doc__ or "").split("\n")[0])
    if not match:
        sys.exit(f"stubs.py: {function} has no signature")
    arguments = []
    for argument in split(match[1]):
        name, _, rest = argument.partition(": ")
        kind, has_default, _ = rest.partition(" = ")
        if name == "self":
            arguments.append("self")
        elif re.fullmatch(r"arg\d+", name):  # of operators
            arguments.append(f"__{name}: " + ("object" if function.__name__ == "__eq__" else type_in(kind)))
        elif name == "*":
            arguments.append(name)
        else:
            arguments.append(f"{name}: {type_in(kind)}" + (" = ..." if has_default else ""))
    return f"({', '.join(arguments)}) -> {type_out(match[2])}"


def lines_of_enumeration(name, type_):
    yield f"class {name}:"
    for value in type_.__members__:
        yield f"    {value}: ClassVar[{name}]"
    yield "    __members__: ClassVar[Mapping[str, Any]]"
    yield "    def __init__(self, value: int) -> None: ..."
    yield "    def __int__(self) -> int: ..."
    yield "    def __index__(self) -> int: ..."
    yield "    def __hash__(self) -> int: ..."
    yield "    @property\n    def name(self) -> str: ..."
    yield "    @property\n    def value(self) -> int: ..."


def lines_of_property(path, name, value):
    if path in PROPERTIES:
        kind = PROPERTIES[path]
    else:
        kind = signature(value.fget).rpartition(" -> ")[2]
    if value.fset:
        yield f"{name}: {kind}"
    else:
        yield from ("@property", f"def {name}(self) -> {kind}: ...")


def lines_of_class(path, type_):
    base = type_.__bases__[0].__name__
    name = path.rpartition(".")[2]
    yield f"class {name}({base}):" if base not in ("pybind11_object", "object") else f"class {name}:"
    members = []
    for member, value in sorted(vars(type_).items()):
        if inspect.isclass(value):
            members += lines_of_class(f"{path}.{member}", value)
        elif isinstance(value, property):
            members += lines_of_property(f"{path}.{member}", member, value)
        elif isinstance(value, staticmethod):
            members += ["@staticmethod", f"def {member}{signature(getattr(type_, member))}: ..."]
        elif callable(value) and (not member.startswith("_") or member in ("__init__", "__iter__", "__next__", "__int__", "__index__", "__bool__", "__lt__")) and not is_abstract(value):
            members.append(f"def {member}{signature(value)}: ...")
    yield from ("    " + line for line in (members or ["..."]))


def is_abstract(function):
    """Types that only we make have no constructor."""
    return function.__name__ == "__init__" and "->" not in (function.__doc__ or "")


def stub():
    lines = ["__version__: str"]
    for name, value in sorted(vars(oaslam).items()):
        if name.startswith("_"):
            continue
        if inspect.isclass(value) and issubclass(value, Exception):
            lines.append(f"class {name}({value.__bases__[0].__name__}): ...")
        elif hasattr(value, "__members__"):
            lines += lines_of_enumeration(name, value)
        elif inspect.isclass(value):
            lines += lines_of_class(name, value)
        elif callable(value):
            lines.append(f"def {name}{signature(value)}: ...")
    return HEADER + "\n".join(lines) + "\n"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--check", action="store_true")
    arguments.add_argument("stub")
    arguments = arguments.parse_args()
    text = stub()
    if not arguments.check:
        with open(arguments.stub, "w") as f:
            f.write(text)
    else:
        with open(arguments.stub) as f:
            if f.read() != text:
                sys.exit(f"{arguments.stub} does not say what the module does: run bindings/python/tools/stubs.py {arguments.stub}")


if __name__ == "__main__":
    main()
