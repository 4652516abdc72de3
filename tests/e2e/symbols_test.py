"""The shared library exports what the public headers mark with OASLAM_API, all of it and nothing else (src/liboaslam.map)."""
import glob
import os
import re
import shutil
import subprocess

import pytest

LIBRARY = os.path.join(os.environ["OASLAM_BUILD_DIR"], "src", "liboaslam.so")
HEADERS = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "include", "oaslam", "*.h")


def header_text():
    text = ""
    for path in glob.glob(HEADERS):
        if os.path.basename(path) != "export.h":
            with open(path) as f:
                text += re.sub("//.*", "", f.read())
    return text


def exported():
    """The exported names, demangled: (what the symbol is, if no function; its name without parameters)."""
    listed = subprocess.run(["nm", "--dynamic", "--defined-only", "--demangle", LIBRARY], capture_output=True, text=True, check=True).stdout
    symbols = set()
    for line in listed.splitlines():
        _, kind, symbol = line.split(maxsplit=2)
        if kind != "A":  # the name of the version
            symbols.add(re.fullmatch(r"((?:typeinfo|typeinfo name|vtable) for |)(.*?)(?:\[abi:\w+\])?(?:\(.*|@@?OASLAM_0)", symbol).groups())
    return symbols


@pytest.mark.skipif(not shutil.which("nm"), reason="there is no nm (Debian: binutils)")
class TestSymbols:
    def setup_method(self):
        text = header_text()
        self.classes = set(re.findall(r"\bclass OASLAM_API (\w+)", text))
        self.functions = set(re.findall(r"^\s*OASLAM_API [^;(]*?(\w+)\(", text, re.M))
        self.hidden = set(re.findall(r"^\s+(?:class|struct) (\w+);", text, re.M))  # defined in the library alone
        self.exported = exported()

    def test_nothing_else_is_exported(self):
        for kind, name in self.exported:
            if name.startswith("oaslam_"):  # of oaslam_c.h
                assert name in self.functions, f"{name}: no public header marks it with OASLAM_API"
                continue
            scopes = name.split("::")
            assert scopes[0] == "oaslam"
            assert scopes[1] in self.classes or (not kind and scopes[-1] in self.functions), f"{kind}{name}: no public header marks it with OASLAM_API"
            assert not self.hidden & set(scopes), f"{kind}{name}: its class is to be OASLAM_LOCAL"

    def test_all_that_is_marked_is_exported(self):
        names = [name.split("::") for _, name in self.exported]
        assert self.classes - {scopes[1] for scopes in names if len(scopes) > 1} == set()
        assert self.functions - {scopes[-1] for scopes in names} == set()
        assert len(self.classes) > 5
        assert len(self.functions) > 20
