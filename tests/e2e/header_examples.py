"""The examples in the comments of the public headers:  header_examples.py FILE HEADER... writes them as one file of C++.

An example stands behind a colon and an empty line, three spaces behind the slashes. Each class that the library exports must have one.
"""
import os
import re
import sys

COMMENT = re.compile(r"((?:^ *//.*\n)+) *(.*)", re.M)
EXAMPLE = re.compile(r":\n//\n((?://   .*\n)+)")

# What the examples take from the application around them.
AROUND = """#include <unistd.h>

#include <iostream>

#include "oaslam/map_viewer.h"
#include "oaslam/oaslam.h"

#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"

using namespace oaslam;
using namespace std::chrono_literals;

template <typename... Things>
void Draw(const Things&...);
void Show(TrackingState state);
extern Slam slam;
extern SlamStates states;
extern Camera camera;
extern cv::Mat image, depth_mm;
extern std::unique_ptr<Detector> detector, network;
extern std::unique_ptr<ImageSource> source;
extern ImageInput input;
extern std::vector<ImuSample> samples;
extern Rigid3 cam_from_depth, cam_from_imu, odom_from_cam, c_from_b, b_from_a;
extern Eigen::Vector3d in_a;
extern Eigen::Vector2d pixel;
extern double timestamp, depth;
extern int number;
extern uint64_t last;
extern ObjectId id, other;
extern WorldId world_of_my_content;
"""


def examples(text):
    """(the line that is explained, the lines of the example) of each in a header."""
    for comment, declaration in COMMENT.findall(text):
        for example in EXAMPLE.findall(re.sub("^ +", "", comment, flags=re.M)):
            yield declaration, re.sub("^//   ", "  ", example, flags=re.M)


def main():
    out, *headers = sys.argv[1:]
    lines = [AROUND]
    for path in headers:
        with open(path) as f:
            text = f.read()
        found = list(examples(text))
        for name in re.findall(r"^class OASLAM_API (\w+)", text, re.M):
            if not any(re.match(rf"class OASLAM_API {name}\b", declaration) for declaration, _ in found):
                sys.exit(f"{path}: the comment of {name} has no example")
        for declaration, example in found:
            lines.append(f"// {os.path.basename(path)}: {declaration}\nvoid Example{len(lines)}() {{\n{example}}}\n")
    with open(out, "w") as f:
        f.write("\n".join(lines))


if __name__ == "__main__":
    main()
