"""The C++ of docs/integrate.md is compiled and run; its table says the same."""
import glob
import os
import re
import shutil
import subprocess

import harness
import pytest

SOURCE = os.environ["OASLAM_SOURCE_DIR"]
FRAMES = 60
LIBRARIES = ["gstreamer-app-1.0", "gstreamer-video-1.0"]
HAS_GSTREAMER = bool(shutil.which("pkg-config") and subprocess.run(["pkg-config", "--exists", *LIBRARIES]).returncode == 0 and
                     glob.glob("/usr/lib/*/gstreamer-1.0/libgstrawparse.so"))


class TestPage(harness.InFolder):
    @classmethod
    def prepare(cls):
        with open(os.path.join(SOURCE, "docs", "integrate.md")) as f:
            cls.page = f.read()
        os.mkdir(cls.path("blocks"))
        for i, block in enumerate(re.findall(r"^```cpp\n(.*?)^```$", cls.page, re.M | re.S)):
            with open(cls.path(f"blocks/{i}.inc"), "w") as f:
                f.write(block)
        folder = os.path.join(SOURCE, "tests", "e2e", "integrate")
        for command in (["cmake", "--install", os.path.dirname(harness.BINARY), "--prefix", cls.path("prefix")],
                        ["cmake", "-S", folder, "-B", cls.path("build"), "-DCMAKE_PREFIX_PATH=" + cls.path("prefix"), "-DBLOCKS=" + cls.path("blocks"),
                         f"-DGSTREAMER={int(HAS_GSTREAMER)}"],
                        ["cmake", "--build", cls.path("build")]):
            done = subprocess.run(command, capture_output=True, text=True)
            assert done.returncode == 0, done.stdout + done.stderr
        video = os.path.join(harness.SAMPLE, "map_front", "video.mp4")
        subprocess.run(["ffmpeg", "-v", "error", "-i", video, "-frames:v", str(FRAMES), "-pix_fmt", "gray", "-f", "rawvideo", cls.path("grey")], check=True)

    def check(self, *arguments):
        """The lines that the program prints: (name, numbers)."""
        done = subprocess.run([self.path("build/check"), *map(str, arguments)], capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
        lines = [re.match(r"(.*?)((?: +-?[\d.]+)+)$", line) for line in done.stdout.splitlines()]
        return [(name, [float(x) for x in numbers.split()]) for name, numbers in (line.groups() for line in lines)]

    def test_poses(self):
        rows = {name: f"[*{position}, *{rotation}]" for name, position, rotation in re.findall(r"^\| (.+?) \| (\(.+?\)) \| (\(.+?\)) \|$", self.page, re.M)}
        compared = 0
        for name, numbers in self.check("poses"):
            if name == "ours":
                ours = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), numbers))
                continue
            converted = eval(rows[name], {}, ours)
            same = sum(a * b for a, b in zip(converted[3:], numbers[3:]))  # a rotation has two quaternions
            for a, b in zip(converted[:3] + [same / abs(same) * q for q in converted[3:]], numbers):
                assert a == pytest.approx(b, abs=5e-8), name
            compared += 1
        assert compared == 5 * len(rows)

    def trajectories(self, *pipelines):
        """The trajectory of the sample's first images from memory, and of each pipeline: [time, position, rotation]."""
        found = {}
        for name, numbers in self.check("images", self.path("grey"), FRAMES, *pipelines):
            found.setdefault(name, []).append(numbers)
        return found

    def test_images_from_memory(self):
        found = self.trajectories()["memory"]
        truth = [(t * 30 / 25, p, q) for t, p, q in harness.read_tum(harness.groundtruth("map_front"))]
        matched = harness.pairs([(n[0], n[1:4], n[4:]) for n in found], truth)
        assert len(matched) > FRAMES / 2
        assert harness.rmse(harness.distances(matched, harness.similarity(matched))) < 0.015  # as in sample_test

    @pytest.mark.skipif(not HAS_GSTREAMER, reason="there is no GStreamer to build with, or not its base plugins")
    def test_images_from_gstreamer(self):
        # The same grey values, and a colour that must change nothing.
        with open(self.path("grey"), "rb") as planes, open(self.path("nv12"), "wb") as f:
            for i in range(FRAMES):
                f.write(planes.read(640 * 480) + bytes([90, 160]) * (640 * 480 // 4))
        line, = re.findall(r"^v4l2src ! (.*)$", self.page, re.M)
        end = line.replace("drop=true", "drop=false sync=false")
        found = self.trajectories(*(
            f"filesrc location={self.path(name)} ! rawvideoparse width=640 height=480 format={layout} framerate=25/1 ! {end}"
            for name, layout in (("grey", "gray8"), ("nv12", "nv12"))))
        assert len(found["memory"]) > FRAMES / 2
        assert found["pipeline0"] == found["memory"]
        assert found["pipeline1"] == found["memory"]
