"""The programs of docs/tour.md run, and those in C++ and in Python print the same."""
import os
import subprocess
import sys

import harness
import pytest
import tour

SOURCE = os.environ["OASLAM_SOURCE_DIR"]
BUILD = os.environ["OASLAM_BUILD_DIR"]
WITH_MODULE = {**os.environ, "PYTHONPATH": os.path.join(BUILD, "python")}
with open(os.path.join(SOURCE, "docs", "tour.md")) as f:
    PROGRAMS = tour.programs(f.read())
# What they print, of which the rest is numbers.
EXPECTED = {1: "poses, then", 2: "cup", 3: "landmarks", 4: "3 sigma", 5: "of 20", 6: "no calibration: points", 7: "there is no anchor", 8: "flag 1 at",
            9: "motion", 10: "for old content: none\nfor new content: a pose", 11: "it was there",
            12: "now mine\none map", 13: "1500 key points"}


def has_module():
    return subprocess.run([sys.executable, "-c", "import oaslam"], env=WITH_MODULE, capture_output=True).returncode == 0


class TestTour(harness.InFolder):
    @classmethod
    def prepare(cls):
        for language in ("cpp", "python"):
            os.mkdir(cls.path(language))
            os.symlink(os.path.join(SOURCE, "data"), cls.path(f"{language}/data"))
        cls.printed = {}

    def run(self, language, *command, env=None):
        done = subprocess.run(command, cwd=self.path(language), env=env, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        return done.stdout

    # In their order: they go on with each other's files.
    @pytest.mark.parametrize("number", range(1, len(PROGRAMS) + 1))
    def test_cpp(self, number):
        self.printed[number] = self.run("cpp", os.path.join(BUILD, "tests", "e2e", "tour"), str(number))
        assert EXPECTED[number] in self.printed[number]

    @pytest.mark.parametrize("number", range(1, len(PROGRAMS) + 1))
    def test_python_prints_the_same(self, number):
        if not has_module():
            pytest.skip("there is no module")
        body = "import oaslam\n" + PROGRAMS[number - 1][1]
        assert self.run("python", sys.executable, "-c", body, env=WITH_MODULE) == self.printed[number]

    def test_there_are_thirteen_short_ones(self):
        assert len(PROGRAMS) == 13 == len(EXPECTED)
        assert all(len(body.splitlines()) <= 13 for pair in PROGRAMS for body in pair)
