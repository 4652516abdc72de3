"""Prints the changelog of the Debian packages, in Debian's form, from a version's section of CHANGELOG.md:

changelog.py CHANGELOG.md VERSION REVISION "NAME <MAIL>" DATE"""
import re
import sys
import textwrap


def entries(text, version):
    """The items of the section "## VERSION" or "## Unreleased (VERSION)", each after its heading ("Added: "), without Markdown."""
    section = re.search(rf"^## (?:Unreleased \()?{re.escape(version)}\)?\n(.*?)(?=^## |\Z)", text, re.M | re.S)
    if not section:
        sys.exit(f"changelog.py: CHANGELOG.md has no section {version}")
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", section[1]).replace("`", "")
    found = []
    for part in re.split(r"^### ", plain, flags=re.M):
        heading, *items = re.split(r"^- ", part, flags=re.M)
        found += [" ".join(f"{heading.strip()}: {item}".split()).removeprefix(": ") for item in items]
    return found


def main():
    path, version, revision, maintainer, date = sys.argv[1:]
    with open(path) as f:
        items = entries(f.read(), version)
    print(f"oaslam ({version}-{revision}) unstable; urgency=medium\n")
    for item in items:
        print(textwrap.fill(item, 79, initial_indent="  * ", subsequent_indent="    ", break_long_words=False, break_on_hyphens=False))
    print(f"\n -- {maintainer}  {date}")


if __name__ == "__main__":
    main()
