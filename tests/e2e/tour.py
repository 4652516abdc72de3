"""The programs of docs/tour.md:  tour.py PAGE FILE writes those in C++ as one file, whose argument is the number of a program."""
import re
import sys


def programs(page):
    """(C++, Python) of each, in their order."""
    return re.findall(r"^```cpp\n(.*?)^```\n```python\n(.*?)^```$", page, re.M | re.S)


def main():
    page, out = sys.argv[1:]
    with open(page) as f:
        bodies = [cpp for cpp, _ in programs(f.read())]
    text = "".join(f"#include <{name}>\n" for name in ("algorithm", "cstdio", "cstdlib", "map", "thread")) + '#include "oaslam/oaslam.h"\n'
    text += "".join(f"static void Program{i}() {{\n{body}}}\n" for i, body in enumerate(bodies, 1))
    calls = ", ".join(f"Program{i}" for i in range(1, len(bodies) + 1))
    text += f"int main(int argc, char** argv) {{\n  void (*const programs[])() = {{{calls}}};\n  if (argc == 2) programs[std::atoi(argv[1]) - 1]();\n}}\n"
    with open(out, "w") as f:
        f.write(text)


if __name__ == "__main__":
    main()
