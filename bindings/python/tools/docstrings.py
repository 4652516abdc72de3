"""Writes the comments of the public headers as the docstrings of the Python module:  docstrings.py --out FILE HEADER...

doc::Slam_Process is the comment of Slam::Process, doc::LoadCamera that of a function. A function without a comment has that of the function above it, where
no empty line is between the two. Names of functions and enumerators are written as in Python.
"""
import argparse
import re
import sys

COMMENT = re.compile(r"^(\s*)//[/!]?<? ?(.*)$")
TRAILING = re.compile(r"^(.*?\S)\s*//[/!]?<? ?(.*)$")
SCOPE = re.compile(r"^(namespace|struct|class|enum class)\s+(?:OASLAM_API\s+)?(\w+)[^;{]*\{")
SKIPPED = re.compile(r"^(#|using |friend |template|~|typedef )|operator|&&\) noexcept|= default;$")

EXAMPLE = re.compile(r":\n\n  .*(?:\n  .*)*")  # of code in C++, behind a colon


def python_name(name):
    """Process -> process, kOpenCv -> OPEN_CV, CocoClassNames -> coco_class_names."""
    if re.match(r"k[A-Z]", name):
        return python_name(name[1:]).upper()
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


class Header:
    """The declarations of a header: {name in C++, parts joined by '_': lines of comment}."""

    def __init__(self, text):
        self.comments, self.functions, self.enumerators, self.types = {}, set(), set(), set()
        self.scopes = []  # (kind, name, is public)
        self.above, self.group = [], []  # the comment that precedes, and that of the function above
        self.last = None
        self.statement, self.trailing, self.depth = "", [], 0
        for line in text.splitlines():
            self.read(line)

    def read(self, line):
        comment = COMMENT.match(line)
        if comment and self.depth == 0:
            indent = 2 * sum(kind != "namespace" for kind, _, _ in self.scopes)
            if self.statement:
                self.trailing.append(comment[2])
            elif self.last is not None and len(comment[1]) > indent:
                self.last.append(comment[2])  # goes on beside the declaration
            else:
                self.above.append(comment[2])
                self.last = None
            return
        trailing = TRAILING.match(line)
        code = (trailing[1] if trailing else line).strip()
        if not code:
            self.above, self.group, self.last = [], [], None
        elif self.depth:  # inside the body of a function
            self.depth += code.count("{") - code.count("}")
        else:
            self.trailing += [trailing[2]] if trailing else []
            self.add(code)

    def add(self, code):
        if not self.statement and re.match(r"(public|private|protected):", code):
            kind, name, _ = self.scopes.pop()
            self.scopes.append((kind, name, code.startswith("public")))
            return
        self.statement = f"{self.statement} {code}".strip()
        scope = SCOPE.match(self.statement)
        kind = self.scopes[-1][0] if self.scopes else "namespace"
        if scope:
            is_public = all(scope[-1] for scope in self.scopes)
            if scope[1] != "namespace" and is_public:
                self.types.add(scope[2])
                self.note(scope[2])
            self.scopes.append((scope[1], scope[2], is_public))
            self.group = []
            rest = self.statement[scope.end():]
            self.clear()
            for part in re.findall(r"[^,]+,|\};|\w+ ?(?=\};)", rest):  # an enumeration in one line
                self.add(part.strip())
        elif self.statement.startswith("}"):
            self.scopes.pop()
            self.clear()
        elif kind == "enum class":
            self.enumerators.add(re.match(r"\w+", self.statement)[0])
            self.note(re.match(r"\w+", self.statement)[0])
            self.clear()
        elif self.statement.startswith("#") or self.statement.endswith((";", "}")):
            self.declare(self.statement)
            self.clear()
        elif self.statement.endswith("{"):
            self.depth = 1
            self.declare(self.statement)
            self.clear()

    def clear(self):
        self.statement, self.trailing = "", []

    def declare(self, text):
        if SKIPPED.search(text) or not all(scope[-1] for scope in self.scopes):
            self.above, self.last = [], None
            return
        while re.search(r"<[^<>]*>", text):
            text = re.sub(r"<[^<>]*>", "", text)
        text = re.sub(r"=[^,;]*\(\)", "", text)
        function = re.search(r"(\w+)\(", text)
        if function:
            self.functions.add(function[1])
            self.group = self.above + self.trailing or self.group
            self.note(function[1], self.group)
        else:
            names = [part.split()[-1] for part in re.sub(r"\{[^}]*\}|=[^,;]*", "", text).rstrip(";").split(",")]
            self.note(names[0])
            for name in names[1:]:
                self.note(name, self.last or [])

    def note(self, name, inherited=()):
        """The comment before the declaration and that beside it, or else the inherited one."""
        scope = [name_of for kind, name_of, _ in self.scopes if kind != "namespace"][-1:]
        lines = self.above + self.trailing or inherited
        key = "_".join(scope + [name])
        if not self.comments.get(key):  # a constructor has the comment of the first
            self.comments[key] = lines
        self.last = self.comments[key]
        self.above, self.trailing = [], []


def in_python(text, functions, enumerators):
    """Names of functions of one word stand at the beginning of sentences only by chance: there they are words."""
    for name in sorted(functions | enumerators, key=len, reverse=True):
        is_plain = re.fullmatch(r"[A-Z][a-z]*", name)
        before = r"(?<=[a-z,:`(] )" if is_plain else r"\b"
        text = re.sub(f"{before}{name}\\b", python_name(name), text)
        text = re.sub(f"(?<=::){name}\\b", python_name(name), text)
    return text.replace("::", ".")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", required=True)
    arguments.add_argument("headers", nargs="+")
    arguments = arguments.parse_args()
    headers = []
    for path in arguments.headers:
        with open(path) as f:
            headers.append(Header(f.read()))
    functions = {name for header in headers for name in header.functions} - {name for header in headers for name in header.types}
    enumerators = {name for header in headers for name in header.enumerators}
    lines = ["#pragma once", "", "// Made by bindings/python/tools/docstrings.py from core/include/oaslam.", "namespace oaslam::doc {"]
    seen = {"ToString"}  # str() of an enumerator
    for header in headers:
        for key, comment in header.comments.items():
            if key in seen and key != "ToString":
                sys.exit(f"docstrings.py: {key} is declared twice")
            if key not in seen:
                text = in_python(EXAMPLE.sub(".", "\n".join(comment)), functions, enumerators)
                lines.append(f'inline constexpr char {key}[] = R"doc({text})doc";')
            seen.add(key)
    lines.append("}  // namespace oaslam::doc")
    with open(arguments.out, "w") as f:
        f.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
