"""The shared libraries export what is marked with OASLAM_API, all of it and nothing else (core/liboaslam.map), and need no library that is not theirs."""
import glob
import os
import re
import shutil
import subprocess

import pytest

SOURCE = os.environ["OASLAM_SOURCE_DIR"]
OF_VIEWER = os.path.join(SOURCE, "viewer", "include", "oaslam", "map_viewer.h")
# What liboaslam-viewer needs besides: headers of rooms, which are not installed.
PRIVATE = os.path.join(SOURCE, "core", "oaslam", "*", "*.h")


def library(name):
    return os.path.join(os.environ["OASLAM_BUILD_DIR"], {"oaslam": "core", "oaslam-viewer": "viewer"}[name], f"lib{name}.so")


def headers_of(name):
    public = glob.glob(os.path.join(SOURCE, "core", "include", "oaslam", "*.h"))
    if name == "oaslam-viewer":
        return [OF_VIEWER]
    return [path for path in public + glob.glob(PRIVATE) if os.path.basename(path) != "export.h"]


def header_text(name):
    text = ""
    for path in headers_of(name):
        with open(path) as f:
            text += re.sub("//.*", "", f.read())
    return text


def exported(name):
    """The exported names, demangled: (what the symbol is, if no function; its name without parameters)."""
    listed = subprocess.run(["nm", "--dynamic", "--defined-only", "--demangle", library(name)], capture_output=True, text=True, check=True).stdout
    symbols = set()
    for line in listed.splitlines():
        _, kind, symbol = line.split(maxsplit=2)
        if kind != "A":  # the name of the version
            symbols.add(re.fullmatch(r"((?:typeinfo|typeinfo name|vtable) for |)(.*?)(?:\[abi:\w+\])?(?:\(.*|@@?OASLAM_0)", symbol).groups())
    return symbols


def needed(name):
    """The libraries that a library is linked with."""
    listed = subprocess.run(["readelf", "--dynamic", library(name)], capture_output=True, text=True, check=True).stdout
    return re.findall(r"\(NEEDED\).*\[lib([^.\]]+)", listed)


@pytest.mark.skipif(not shutil.which("nm"), reason="there is no nm (Debian: binutils)")
@pytest.mark.parametrize("name", ["oaslam", "oaslam-viewer"])
class TestSymbols:
    @pytest.fixture(autouse=True)
    def symbols(self, name):
        text = header_text(name)
        self.classes = set(re.findall(r"\bclass OASLAM_API (\w+)", text))
        self.functions = set(re.findall(r"^\s*OASLAM_API [^;(]*?(\w+)\(", text, re.M))
        self.hidden = set(re.findall(r"^ +(?:class|struct) (\w+);", text, re.M))  # defined in the library alone
        self.exported = exported(name)

    def test_nothing_else_is_exported(self, name):
        # Exceptions are the same ones in both, so that each catches what the other throws.
        exceptions = set(re.findall(r"\bclass OASLAM_API (\w+) : public std::runtime_error", header_text("oaslam")))
        for kind, symbol in self.exported:
            if symbol.startswith("oaslam_"):  # of oaslam_c.h
                assert symbol in self.functions, f"{symbol}: no public header marks it with OASLAM_API"
                continue
            scopes = symbol.split("::")
            assert scopes[0] == "oaslam"
            known = scopes[1] in self.classes | exceptions or (not kind and scopes[-1] in self.functions)
            assert known, f"{kind}{symbol}: no header marks it with OASLAM_API"
            assert not self.hidden & set(scopes), f"{kind}{symbol}: its class is to be OASLAM_LOCAL"

    def test_all_that_is_marked_is_exported(self, name):
        names = [symbol.split("::") for _, symbol in self.exported]
        assert self.classes - {scopes[1] for scopes in names if len(scopes) > 1} == set()
        assert self.functions - {scopes[-1] for scopes in names} == set()
        assert len(self.classes | self.functions) >= {"oaslam": 25, "oaslam-viewer": 1}[name]


def test_what_the_libraries_need():
    """A robot links liboaslam without a server, its cryptography, models of content or downloads."""
    of_library, of_viewer = needed("oaslam"), needed("oaslam-viewer")
    assert not [name for name in of_library if re.match("boost|ssl|crypto|assimp|curl|pq", name)], of_library
    assert "opencv_core" in of_library
    assert "oaslam" in of_viewer
    assert not [name for name in of_viewer if re.match("curl|pq|ceres|av|sqlite|SQLite", name)], of_viewer
