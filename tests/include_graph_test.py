"""The rooms of the parts and the arrows between them: who may include whom. The build alone cannot tell, because all rooms of a part share one include folder."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
PARTS = ("core", "command", "viewer", "server", "ros2")  # each may use those before it
PUBLIC = [ROOT / part / "include" / "oaslam" for part in PARTS if (ROOT / part / "include").exists()]
TYPE = r"^(?:struct|class|enum class) (?:OASLAM_\w+ )?"


def rooms_of_build(cmake):
    """The rooms that each room is linked with; it may also include what those may."""
    return {room: set(re.findall(r"oaslam_(\w+)", links)) for room, links in re.findall(r"oaslam_room\((\w+)([^)]*)\)", cmake)}


def rooms_of_page(page):
    """The rows `room` | what it holds | the rooms that it may enter."""
    return {room: set(re.findall(r"`(\w+)`", below)) for room, below in re.findall(r"^\| `(\w+)` \|.*\|([^|\n]*)\|$", page, re.M)}


def files_under(folder, prefix=""):
    """{path: text} of the C++: "tracking/motion_model.cc"; of a public header "public/slam.h"."""
    return {prefix + path.relative_to(folder).as_posix(): path.read_text() for path in sorted(folder.rglob("*")) if path.suffix in (".h", ".cc")}


def merged(dictionaries):
    return {key: value for dictionary in dictionaries for key, value in dictionary.items()}


CMAKE_OF = {part: (ROOT / part / "CMakeLists.txt").read_text() for part in PARTS}
CMAKE = "\n".join(CMAKE_OF.values())
ROOMS = rooms_of_build(CMAKE)
FILES = merged([files_under(ROOT / part / "oaslam") for part in PARTS] + [files_under(folder, "public/") for folder in PUBLIC])
PROGRAMS = merged(files_under(ROOT / part / "program", f"{part}/program/") for part in PARTS)
# The rooms that implement public headers, those with a file of the same name: only they and those above them may use these. What is not listed is for all.
IMPLEMENTED_IN = {path.stem + ".h": path.parts[0] for path in map(pathlib.PurePath, FILES) if path.suffix == ".cc" and f"public/{path.stem}.h" in FILES}


# These rooms run by themselves, in a browser or on a robot. They and their tests may use these libraries, beside the standard one and POSIX.
STANDALONE = ("util", "geometry", "features", "estimation", "odometry")
STANDALONE_HEADERS = re.compile(r"(Eigen|fmt|hwy|gtest|gmock)/|(sys/resource|time|pthread|unistd)\.h$|[a-z_]+$")
STANDALONE_LIBRARIES = {"Eigen3::Eigen", "fmt::fmt", "hwy::hwy", "Threads::Threads"}


def reached(rooms, room):
    """What a room may include: itself, and all below it."""
    found, left = {room}, [room]
    while left:
        new = rooms[left.pop()] - found
        found |= new
        left += new
    return found


def includes_of(text):
    """(quote, path) of each include."""
    return re.findall(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', text, re.M)


def problem(rooms, path, quote, include):
    """Of one include; None if there is none."""
    room = path.split("/")[0]
    if not include.startswith("oaslam/"):
        # Helpers of tests are in tests/; all other files of ours are included by their full paths.
        return "not under oaslam/" if quote == '"' and not path.endswith("_test.cc") else None
    target, slash, _ = include.removeprefix("oaslam/").partition("/")
    if not slash:
        if room == "public" or target not in IMPLEMENTED_IN:
            return None
        target = IMPLEMENTED_IN[target]
    elif room == "public":
        return "a public header may not show a room"
    elif target not in rooms:
        return "no such room"
    return None if target in reached(rooms, room) else f"{room} may not enter {target}"


def violations(rooms, files):
    found = []
    for path, text in files.items():
        if path.split("/")[0] not in (*rooms, "public"):
            found.append(f"{path}: a room that is not in the table")
            continue
        found += [f"{path} includes {include}: {why}" for quote, include in includes_of(text) if (why := problem(rooms, path, quote, include))]
    return found


def foreign_includes(files):
    """Includes of a room that stands alone, and of the public headers that it sees, which bring another library."""
    def seen(path, done):
        for quote, include in includes_of(files[path]):
            public = "public/" + include.removeprefix("oaslam/")
            if public in files and public not in done:
                done.add(public)
                yield from seen(public, done)
            elif quote == "<" and not STANDALONE_HEADERS.match(include):
                yield f"{path} includes {include}"

    return [found for path in files if path.split("/")[0] in STANDALONE for found in seen(path, set())]


def foreign_libraries(cmake):
    """The libraries that such a room is linked with and may not need."""
    links = {room: set(words.split()) - {"LINK", "PRIVATE_LINK"} for room, words in re.findall(r"oaslam_room\((\w+)([^)]*)\)", cmake)}
    return {(room, library) for room in STANDALONE for library in links[room] - STANDALONE_LIBRARIES if library.removeprefix("oaslam_") not in STANDALONE}


# The viewer shows key points and boxes that Slam hands it in a wrapper (Slam::View). Joining saved maps, and taking over the edits of one, needs no Slam.
OPENED_BY = {"oaslam/system/slam_view.h": "viewer/map_viewer.cc", "oaslam/system/map_merging.h": "command/program/merge.cc",
             "oaslam/system/edit_takeover.h": "command/program/map_out.h"}
FRIENDS = {("public/slam_state.h", "Slam")}  # which makes SlamStates


def back_doors(files):
    """What the programs of this repository would reach Slam by, and an application could not: headers of its room, friends, classes named for it."""
    found = [f"{path} includes {include}" for path, text in files.items() if not path.startswith(("system/", "tests/"))
             for _, include in includes_of(text) if include.startswith("oaslam/system/") and OPENED_BY.get(include) != path]
    for path, text in files.items():
        if path.startswith("public/"):
            found += [f"{path}: friend {name}" for name in re.findall(r"friend (?:class |struct )?(\w+)", text) if (path, name) not in FRIENDS]
        found += [f"{path}: {name}" for name in re.findall(r"(?:class|struct) (\w+Access)\b", text)]
    return found


def undefined_types(files):
    """Types that the public headers name but do not define: an application could not use them."""
    named, defined = set(), set()
    for path, text in files.items():
        if path.startswith("public/"):
            for name, end in re.findall(TYPE + r"(\w+)[^;{\n]*([;{])", text, re.M):
                (named if end == ";" else defined).add(name)
    return named - defined


def types_defined_twice(files):
    """Types that two headers define: all rooms share a namespace, and the linker takes the functions of either for both."""
    names = [name for path, text in files.items() if path.endswith(".h") for name in re.findall(TYPE + r"([\w:]+)[^;{\n]*\{", text, re.M)]
    return {name for name in names if names.count(name) > 1}


def names_defined_together(cmake, files):
    """Constants and types that two files of a room define for themselves although the room's files are compiled together. A build with a compiler cache compiles each alone and does not see it."""
    alone = set(re.findall(r"\w+/\w+", " ".join(re.findall(r"oaslam_compiled_alone\(([^)]*)\)", cmake))))
    homes = {}
    for path, text in files.items():
        if path.endswith(".cc") and not path.endswith("_test.cc") and path.removesuffix(".cc") not in alone:
            lines = re.findall(r"^(?:constexpr|const|struct|class|enum) .*", text, re.M)
            names = {name for line in lines for name in re.findall(r"\b(k[A-Z]\w*)(?: =|\[|\{)|^(?:struct|(?:enum )?class) (?:OASLAM_\w+ )?(\w+)[^;(]*\{", line) for name in name if name}
            for name in names:
                homes.setdefault((path.split("/")[0], name), []).append(path)
    return {name: paths for name, paths in homes.items() if len(paths) > 1}


def test_the_code_keeps_to_the_architecture():
    assert len(FILES) > 20
    assert violations(ROOMS, FILES) == []
    assert undefined_types(FILES) == set()
    assert types_defined_twice(FILES) == set()
    assert names_defined_together(CMAKE, FILES) == {}


def test_the_odometry_and_what_is_below_it_stand_alone():
    assert foreign_includes(FILES) == []
    assert foreign_libraries(CMAKE) == set()
    assert all(reached(ROOMS, room) <= set(STANDALONE) for room in STANDALONE)


def test_libraries_in_rooms_that_stand_alone_are_found():
    for include in ("opencv2/core.hpp", "ceres/ceres.h", "sqlite3.h"):
        assert foreign_includes({"features/a.cc": f"#include <vector>\n#include <{include}>\n"}) == [f"features/a.cc includes {include}"]
        assert foreign_includes({"map/a.cc": f"#include <{include}>\n"}) == []
    public = {"public/image.h": '#include "oaslam/size.h"\n', "public/size.h": "#include <opencv2/core.hpp>\n"}
    assert foreign_includes({"util/a.h": '#include "oaslam/image.h"\n', **public}) == ["public/size.h includes opencv2/core.hpp"]
    assert foreign_libraries(CMAKE.replace("oaslam_room(features LINK", "oaslam_room(features LINK opencv_core")) == {("features", "opencv_core")}


def test_what_is_built_on_slam_needs_no_back_door():
    assert back_doors({**FILES, **PROGRAMS, **files_under(ROOT / "examples", "examples/")}) == []


def test_back_doors_are_found():
    assert back_doors({"command/program/run.cc": '#include "oaslam/system/slam_impl.h"\n'}) == ["command/program/run.cc includes oaslam/system/slam_impl.h"]
    assert back_doors({"viewer/a.cc": '#include "oaslam/system/slam_view.h"\n'}) and not back_doors({"system/a.cc": '#include "oaslam/system/atlas.h"\n'})
    assert back_doors({"public/slam.h": "  friend class MapFile;\n"}) == ["public/slam.h: friend MapFile"]
    assert back_doors({"storage/a.h": "struct SlamAccess {\n};\n"}) == ["storage/a.h: SlamAccess"]


def test_types_of_one_name_are_found():
    assert types_defined_twice({"exports/a.h": "struct Scene {\n};\nstruct Other;\n", "relocalization/b.h": "class Scene : Base {\n};\nstruct Other {\n};\n"}) == {"Scene"}


def test_names_of_files_that_are_compiled_together_are_found():
    cmake = "oaslam_compiled_alone(odometry/a_b\n  odometry/c)\n"
    files = {"odometry/a.cc": "constexpr int kHalf = 5, kSide = 2 * kHalf;\n  constexpr int kInside = 1;\nstruct Sum {\n};\n",
             "odometry/b.cc": "constexpr int kSide = 5;\n  constexpr int kInside = 1;\nstruct Sum;\n", "odometry/c.cc": "constexpr int kHalf = 5;\n", "map/d.cc": "struct Sum {\n"}
    assert names_defined_together(cmake, files) == {("odometry", "kSide"): ["odometry/a.cc", "odometry/b.cc"]}
    assert ("odometry", "kHalf") in names_defined_together("oaslam_compiled_alone(map/d)", files)


def test_types_that_are_not_installed_are_found():
    face = "struct Inner;  // of a room\nstruct Later;\nclass OASLAM_API Slam {\n  Inner Look();\n  class Impl;\n};\n"
    assert undefined_types({"public/slam.h": face, "public/later.h": "struct Later {\n};\n", "map/inner.h": "struct Inner {\n};\n"}) == {"Inner"}


def test_the_page_shows_the_rooms_of_the_build():
    assert rooms_of_page((ROOT / "docs" / "architecture.md").read_text()) == ROOMS
    assert len(ROOMS) > 20
    assert IMPLEMENTED_IN["slam.h"] == "system"


def test_python_and_the_examples_see_the_public_headers_alone():
    """What programs of others see: the module for Python and the examples are such."""
    seen = [(path, include) for folder in ("bindings/python", "examples") for path, text in files_under(ROOT / folder).items()
            for _, include in includes_of(text) if include.startswith("oaslam/")]
    assert len(seen) > 10
    assert [(path, include) for path, include in seen if "public/" + include.removeprefix("oaslam/") not in FILES] == []


def upward_links(cmake_of):
    """Rooms that are linked with a room of a part above their own."""
    part_of = {room: PARTS.index(part) for part, cmake in cmake_of.items() for room in rooms_of_build(cmake)}
    return [(room, other) for cmake in cmake_of.values() for room, below in rooms_of_build(cmake).items() for other in below if part_of[other] > part_of[room]]


def test_a_part_needs_none_above_it():
    assert upward_links(CMAKE_OF) == []
    assert upward_links({"core": "oaslam_room(map LINK oaslam_net)", "viewer": "oaslam_room(net LINK oaslam_map)"}) == [("map", "net")]
    for part in PARTS:
        includes = [include for path, text in PROGRAMS.items() if path.startswith(part) for _, include in includes_of(text)]
        rooms = {include.split("/")[1] for include in includes if include.startswith("oaslam/") and include.count("/") == 2}
        above = {room for other in PARTS[PARTS.index(part) + 1:] for room in rooms_of_build(CMAKE_OF[other])}
        assert rooms & above == set()


OF_PROGRAMS = re.compile(r"(boost|openssl|CLI|spdlog|curl|assimp|libpq)[/-]")  # libraries that core is built without


def test_core_needs_no_library_of_the_programs():
    core = {**files_under(ROOT / "core" / "oaslam"), **files_under(ROOT / "core" / "include"), **files_under(ROOT / "core" / "tests")}
    assert len(core) > 500
    assert [(path, include) for path, text in core.items() for _, include in includes_of(text) if OF_PROGRAMS.match(include)] == []
    assert [library for library in ("Boost", "OpenSSL", "CLI11", "spdlog", "CURL", "libpq", "OASLAM_PQ") if library in CMAKE_OF["core"]] == []


def test_no_cycles():
    assert [(room, other) for room, below in ROOMS.items() for other in below if room in reached(ROOMS, other)] == []


def check(path, text):
    return violations(ROOMS, {path: text})


def test_forbidden_arrows_are_found():
    for path, text, why in (("mapping/a.cc", '#include "oaslam/relocalization/b.h"\n', " includes oaslam/relocalization/b.h: mapping may not enter relocalization"),
                            ("objects/a_test.cc", "  #  include <oaslam/tracking/b.h>\n", " includes oaslam/tracking/b.h: objects may not enter tracking"),
                            ("map/a.h", '#include "oaslam/slam.h"', " includes oaslam/slam.h: map may not enter system"),
                            ("public/slam.h", '#include "oaslam/map/map.h"', " includes oaslam/map/map.h: a public header may not show a room"),
                            ("images/a.cc", '#include "common.h"', " includes common.h: not under oaslam/"),
                            ("images/a.cc", '#include "oaslam/apps/common.h"', " includes oaslam/apps/common.h: no such room"),
                            ("cellar/a.cc", "", ": a room that is not in the table")):
        assert check(path, text) == [path + why]


def test_allowed_arrows_pass():
    for path, includes in (("tracking/a.cc", ("<vector>", "<opencv2/core.hpp>", '"oaslam/tracking/a.h"', '"oaslam/matching/b.h"', '"oaslam/util/check.h"', '"oaslam/types.h"')),
                           ("system/a.cc", ('"oaslam/slam.h"', '"oaslam/objects/b.h"')),
                           ("map/a_test.cc", ('"synthetic_world.h"',))):
        assert check(path, "".join(f"#include {include}\n" for include in includes)) == []
