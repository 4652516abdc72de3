"""What the command says of itself: options in groups, and what was probably meant."""
import os
import re
import shutil
import subprocess

import harness
import pytest
from harness import must_run, oaslam

GROUPS = ["Input", "Camera", "Objects", "Output", "Live", "More"]


def sections(*words):
    """{heading: names of the options there}, in the order of the help."""
    found = {}
    for heading, text in re.findall(r"^(\w+):\n((?:  .*\n?)+)", must_run(*words).out, flags=re.M):
        found[heading] = re.findall(r"^  (?:-\w,)?--([\w-]+)", text, flags=re.M)
    return found


class TestHelp:
    @pytest.mark.parametrize("command", ["run", "localize", "view", "serve", "map-objects", "detect"])
    def test_options_are_in_groups(self, command):
        found = sections(command, "--help-all")
        groups = [heading for heading in found if heading != "Positionals"]
        assert groups == [group for group in GROUPS if group in groups] and len(groups) > 3, groups
        assert "help" in found["More"]
        everything = [name for group in groups for name in found[group]]
        assert len(everything) == len(set(everything))

    def test_each_where_it_is_looked_for(self):
        found = sections("run", "--help-all")
        for group, names in (("Input", ["images", "from", "imu"]), ("Camera", ["camera", "rolling-shutter"]), ("Objects", ["detector", "classes"]),
                             ("Output", ["out", "map-out", "record"]), ("Live", ["mode", "viewer"]), ("More", ["set", "config", "seed"])):
            assert set(names) <= set(found[group]), (group, found)

    def test_few_options_need_no_groups(self):
        assert list(sections("merge", "--help"))[-1] == "Options"

    @pytest.mark.parametrize("words", [["run"], ["run", "--viewer"], ["localize"]])
    def test_what_most_need_is_read_at_once(self, words):
        def named(option):
            return {name for names in sections(*words, option).values() for name in names} - {"path", "help", "help-all"}
        first, everything = named("--help"), named("--help-all")
        assert len(first) == 20 if words[0] == "run" else 10 < len(first) <= 20, first
        assert first < everything and len(everything) > 30
        assert {"images", "camera", "detector", "out"} <= first and {"set", "detector-size"} <= everything - first
        assert ("token-file" in everything) == ("--viewer" in words)

    @pytest.mark.parametrize("command", ["view", "serve", "merge", "odometry"])
    def test_a_short_help_is_the_whole(self, command):
        assert must_run(command, "--help").out == must_run(command, "--help-all").out

    @pytest.mark.parametrize("words,meant", [
        (["lokalize", "--map", "a.map"], "localize"), (["rnu", "walk.mp4"], "run"), (["map_objects"], "map-objects"), (["models", "gte", "yolox_nano"], "get"),
        (["run", "walk.mp4", "--camra", "a.yaml"], "--camera"), (["run", "--image", "a.mp4"], "--images"), (["localize", "--map", "a", "--detectons=b.json"], "--detections"),
        (["export", "--map", "a", "--formt", "ply"], "--format"), (["evaluate", "trajectory", "a", "b", "--plto", "x.svg"], "--plot")])
    def test_what_was_meant(self, words, meant):
        done = oaslam(*words)
        assert done.code > 100, done
        assert f"Did you mean {meant} instead of" in done.err, done

    @pytest.mark.parametrize("words", [["run", "--zzzzzz", "1"], ["photograph"], ["run"], ["run", "walk.mp4", "--from", "x"]])
    def test_no_guess_where_nothing_is_near(self, words):
        done = oaslam(*words)
        assert done.code != 0
        assert "Did you mean" not in done.err, done

    @pytest.mark.parametrize("setting,meant", [("tracking.min_inlier=25", "tracking.min_inliers"), ("mapping.loop_closin=off", "mapping.loop_closing"),
                                               ("runer.lag=1", "runner.lag")])
    def test_settings(self, setting, meant):
        done = oaslam("run", "--images", harness.clip("map_front")[1], "--camera", "fov:60", "--out", "/tmp/none", "--set", setting)
        assert done.code == 1, done
        assert meant in done.err.split(setting.split("=")[0], 1)[1], done


class TestServerProgram:
    """`oaslam serve` and `oaslam models` are of oaslam-server."""

    def test_it_is_in_path_or_beside_or_named(self, tmp_path):
        alone = shutil.copy(harness.BINARY, tmp_path / "oaslam")
        bin_folder = os.path.dirname(harness.BINARY)
        for path, code, words in ((bin_folder, 0, "Usage: oaslam serve"), ("", 1, "oaslam-server is not installed: it is in the package oaslam-server")):
            done = subprocess.run([alone, "serve", "--help"], capture_output=True, text=True, env={"PATH": path})
            assert done.returncode == code, done
            assert words in done.stdout + done.stderr, done
        assert "Usage: oaslam models" in must_run("models", "--help").out  # beside it

    def test_it_is_listed(self):
        assert {"serve", "models"} <= set(re.findall(r"^  (\w+) ", must_run("--help").out, flags=re.M))
