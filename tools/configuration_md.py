#!/usr/bin/env python3
"""Writes docs/configuration.md from core/include/oaslam/config.h (defaults, reasons, bounds): tools/configuration_md.py [--check]"""
import os
import re
import sys

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
HEADER = os.path.join(ROOT, "core", "include", "oaslam", "config.h")
PAGE = os.path.join(ROOT, "docs", "configuration.md")

INTRO = """# Configuration

Written by `tools/configuration_md.py` from `core/include/oaslam/config.h`; do not edit.

A configuration file is YAML, sections of keys (`--config FILE`); `--set section.key=value` sets one
key for one run and wins over the file. An unknown key is an error that names the nearest known one.
"""


def word(value):
    """A value of C++ as a configuration file writes it."""
    return {"true": "on", "false": "off"}.get(value, re.sub(r"\w+::k", "", value).replace("AndOrb", "+orb").lower())


def fields(text):
    """{Struct: [(name, default, comment)]}; a comment goes on over the lines below that hold nothing else."""
    structs = {}
    for name, body in re.findall(r"struct (\w+Config) \{\n(.*?)\n\};", text, re.S):
        rows = []
        body = re.sub(r"=\s*\n\s*", "= ", body)  # a default that stands on a line of its own
        for line in body.split("\n"):
            member = re.match(r"\s*(?:int|double|bool|RunnerMode|BundleObjects|ObjectMethod|DescriptorKind)\s+(\w+)\s*=\s*(.+?);\s*(?://\s*(.*))?$", line)
            more = re.match(r"\s+//\s*(.*)$", line)
            if member:
                rows.append([member[1], word(member[2]), member[3] or ""])
            elif more and rows and line.index("//") > 8:
                rows[-1][2] += " " + more[1]
        structs[name] = rows
    return structs


def page():
    text = open(HEADER).read()
    structs = fields(text)
    sections = re.findall(r"^  (\w+Config) (\w+);", text, re.M)
    bounds = {}
    for key, rest in re.findall(r'visit\("([\w.]+)", [\w.]+, (.+?)\);', text):
        words = re.findall(r'"([^"]*)"', rest)
        bounds[key] = " \\| ".join(words) if words else " to ".join(part.strip().replace("'", "") for part in rest.split(","))
    out = [INTRO]
    missing = set(bounds)
    for struct, section in sections:
        out.append(f"\n## {section}\n\n| key | default | allowed | meaning |\n|---|---|---|---|\n")
        for name, default, comment in structs[struct]:
            key = f"{section}.{name}"
            if key not in bounds:
                sys.exit(f"{key}: not in VisitFields of {HEADER}")
            missing.discard(key)
            out.append(f"| `{key}` | {default} | {bounds[key]} | {comment.replace('|', chr(92) + '|')} |\n")
    if missing:
        sys.exit(f"keys that no struct holds: {sorted(missing)}")
    return "".join(out)


if __name__ == "__main__":
    wanted = page()
    if sys.argv[1:] == ["--check"]:
        if not os.path.exists(PAGE) or open(PAGE).read() != wanted:
            sys.exit("docs/configuration.md is not what core/include/oaslam/config.h says: run tools/configuration_md.py")
    else:
        open(PAGE, "w").write(wanted)
