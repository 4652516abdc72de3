"""Bad input gets one clear error and a status that is not 0, and nothing that was computed is lost."""
import json
import os
import shutil
import signal
import sqlite3
import subprocess

import harness
import pytest
from harness import SAMPLE, oaslam

FRAMES = 100
VIDEO, CAMERA, DETECTIONS = (os.path.join(SAMPLE, "map_front", f) for f in ("video.mp4", "camera.yaml", "detections.json"))


class TestBadInput(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.frames = cls.path("images")
        subprocess.run([harness.EXTRACT, VIDEO, cls.frames, "0", str(FRAMES)], check=True)

    @pytest.fixture(autouse=True)
    def each_in_a_folder(self, tmp_path):
        self.folder, self.out = str(tmp_path), str(tmp_path / "out")

    def write(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w") as f:
            f.write(text)
        return path

    def assert_refused(self, outcome, *words):
        """The command fails with an expected error: one line that contains the words."""
        assert outcome.code != 0, outcome
        assert outcome.code > 0, outcome  # no signal
        errors = [line for line in outcome.err.splitlines() if "error" in line.lower()]
        assert len(errors) == 1, outcome
        assert "error: unexpected" not in errors[0]
        for word in words:
            assert word in errors[0]

    def run_slam(self, *args, images=VIDEO, camera=CAMERA):
        return oaslam("run", "--images", images, "--camera", camera, "--out", self.out, *args)

    def frames_with(self, change):
        """A copy of the extracted frames with a changed list: change(lines, folder) -> lines."""
        folder = os.path.join(self.folder, "frames")
        shutil.copytree(self.frames, folder)
        path = os.path.join(folder, "rgb.txt")
        with open(path) as f:
            lines = f.read().splitlines()
        with open(path, "w") as f:
            f.write("\n".join(change(lines, folder)) + "\n")
        return folder

    def tracked(self):
        return len(harness.read_tum(os.path.join(self.out, "trajectory.txt")))

    # ---- images

    def test_an_image_of_another_size_is_passed_over(self):
        def shrink(lines, folder):
            for i in (0, 30):  # the first one as well
                path = os.path.join(folder, lines[i].split()[1])
                subprocess.run(["ffmpeg", "-nostdin", "-loglevel", "error", "-y", "-i", path, "-vf", "scale=320:240",
                                path + ".png"], check=True)
                os.replace(path + ".png", path)
            return lines[:60]
        outcome = self.run_slam(images=self.frames_with(shrink))
        assert outcome.code == 0, outcome
        assert outcome.err.count("is 320 x 240, the others are 640 x 480, skipped") == 2, outcome
        assert "2 of 60 images were skipped" in outcome.err
        assert harness.read_json(os.path.join(self.out, "summary.json"))["frames"] == 58

    # ---- classes

    def test_class_files(self):
        for text, *words in (("names: [cup]\nmovabel: [cup]\n", "movabel", "movable"), ("movable: [persn]\n", "persn", "person"),
                             ("names: [head, statue]\nparts: {head: statu}\n", "parts.head", "statue"),
                             ("names: [head, statue]\nparts: {head: statue, statue: head}\n", "part of itself"), ("names: [a\n", "classes.yaml")):
            classes = self.write("classes.yaml", text)
            for outcome in (self.run_slam("--classes", classes),
                            oaslam("map-objects", "--trajectory", harness.groundtruth("map_front"), "--camera", CAMERA, "--detections", DETECTIONS,
                                   "--classes", classes, "--out", self.out)):
                self.assert_refused(outcome, "classes.yaml", *words)

    # ---- images

    def test_no_such_images(self):
        self.assert_refused(self.run_slam(images="/nowhere/video.mp4"), "/nowhere/video.mp4")

    def test_empty_list(self):
        self.assert_refused(self.run_slam(images=self.write("rgb.txt", "# nothing\n")), "rgb.txt")

    def test_empty_folder(self):
        empty = os.path.join(self.folder, "empty")
        os.mkdir(empty)
        self.assert_refused(self.run_slam(images=empty), empty)

    def test_half_a_video(self):
        path = os.path.join(self.folder, "half.mp4")
        with open(VIDEO, "rb") as whole, open(path, "wb") as half:
            half.write(whole.read(100000))
        outcome = self.run_slam(images=path)
        assert outcome.code == 0, outcome
        assert sum("warning" in line and path in line and "450" in line for line in outcome.err.splitlines()) == 1, outcome
        assert len(harness.read_csv(os.path.join(self.out, "frames.csv"))) > 0

    def test_no_video(self):
        path = os.path.join(self.folder, "noise.mp4")
        with open(path, "wb") as f:
            f.write(bytes(range(256)) * 100)
        self.assert_refused(self.run_slam(images=path), path)

    def test_missing_and_broken_images_in_the_middle_are_skipped(self):
        def spoil(lines, folder):
            os.remove(os.path.join(folder, "rgb", "000070.png"))
            with open(os.path.join(folder, "rgb", "000075.png"), "r+b") as f:
                f.truncate(1000)
            return lines

        outcome = self.run_slam(images=self.frames_with(spoil))
        assert outcome.code == 0, outcome
        for name in ("000070.png", "000075.png"):
            assert sum("warning" in line and name in line for line in outcome.err.splitlines()) == 1, outcome
        times = [round(30 * t) for t, _, _ in harness.read_tum(os.path.join(self.out, "trajectory.txt"))]
        assert FRAMES - 1 in times
        assert 70 not in times
        assert len(times) > 50

    def test_no_image_can_be_read(self):
        outcome = self.run_slam(images=self.write("rgb.txt", "0.0 a.png\n0.1 b.png\n"))
        assert outcome.code != 0, outcome
        assert "no readable image; image 0 (a.png): missing or unreadable" in outcome.err, outcome

    def check_times(self, line):
        """The time of frame 80 is not after that of its predecessor: the frame is skipped with a warning, and the run goes on."""
        folder = self.frames_with(lambda lines, _: lines[:80] + [line] + lines[81:])
        outcome = self.run_slam(images=folder)
        assert outcome.code == 0, outcome
        assert sum("warning" in w and "000080.png" in w and "time stamp" in w for w in outcome.err.splitlines()) == 1, outcome
        times = [round(30 * t) for t, _, _ in harness.read_tum(os.path.join(self.out, "trajectory.txt"))]
        assert times == sorted(set(times))
        assert FRAMES - 1 in times
        assert 80 not in times

    def test_equal_times(self):
        self.check_times("2.633333 rgb/000080.png")

    def test_times_that_go_backwards(self):
        self.check_times("0.5 rgb/000080.png")

    def test_wrong_image_size(self):
        camera = self.write("camera.txt", "1 PINHOLE 320 240 262 262 160 120\n")
        self.assert_refused(self.run_slam(camera=camera), "320 x 240", "640 x 480")

    def test_times_in_another_unit(self):
        for unit, first, step in (("ns", 1403636579763555584, 33333333), ("us", 0, 33333), ("ms", 0, 33)):
            folder = self.frames_with(lambda lines, _: [f"{first + step * i} {line.split()[-1]}" for i, line in enumerate(lines)])
            for mode in ("lockstep", "live"):
                self.assert_refused(self.run_slam("--mode", mode, images=folder), "rgb.txt", f"--time-unit {unit}")
            shutil.rmtree(folder)

    def test_helper_files_shift_no_time(self):
        folder = os.path.join(self.folder, "mac")
        shutil.copytree(os.path.join(self.frames, "rgb"), folder)
        for name in os.listdir(folder):
            with open(os.path.join(folder, "._" + name), "wb") as f:
                f.write(b"\0\5\26\7\0\2\0\0Mac OS X        ")
        outcome = self.run_slam(images=folder)
        assert outcome.code == 0, outcome
        assert "._" not in outcome.err
        assert float(harness.read_csv(os.path.join(self.out, "frames.csv"))[0]["timestamp"]) == 0

    def test_a_name_that_looks_like_a_protocol(self):
        os.symlink(VIDEO, os.path.join(self.folder, "2024-05-01T10:30:12.mp4"))
        outcome = oaslam("run", "--images", "2024-05-01T10:30:12.mp4", "--camera", CAMERA, "--to", "40", "--out", "o:1",
                         "--record", "2024-05-01T10:30:12_ar.mp4", cwd=self.folder)
        assert outcome.code == 0, outcome
        assert os.path.getsize(os.path.join(self.folder, "2024-05-01T10:30:12_ar.mp4")) > 1000

    def test_nothing_of_a_file_is_a_command_to_the_terminal(self):
        for text in ("1.5 a.png\n\tb\u009b31m\x1b[31m\n", "names\x1b]0;x\x07"):
            outcome = oaslam("evaluate", "trajectory", self.write("t.txt", text), harness.groundtruth("map_front"))
            assert outcome.code == 1, outcome
            assert not any(c in outcome.err for c in "\x1b\x07\u009b"), outcome

    def test_images_that_are_too_small(self):
        os.mkdir(os.path.join(self.folder, "small"))
        for i in range(5):
            with open(os.path.join(self.folder, "small", f"{i}.pgm"), "wb") as f:
                f.write(b"P5\n32 40\n255\n" + bytes(32 * 40))
        for camera in ("auto", "fov:60"):
            self.assert_refused(self.run_slam(images=os.path.join(self.folder, "small"), camera=camera), "small: images of 32 x 40", "33")

    def test_detections_of_other_images(self):
        with open(DETECTIONS) as f:
            images = json.load(f)[:FRAMES]
        for i, image in enumerate(images):
            image["file_name"] = f"kitchen {chr(97 + i % 26)}{chr(97 + i // 26)}.jpg"
        self.assert_refused(self.run_slam("--detections", self.write("d.json", json.dumps(images))), "d.json", "kitchen aa.jpg", "000000")

    # ---- calibration, configuration

    def test_no_calibration(self):
        self.assert_refused(self.run_slam(camera=self.write("camera.yaml", "fx: 500\n")), "camera.yaml")

    def test_damaged_calibration(self):
        camera = self.write("camera.yaml", "image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n")
        outcome = self.run_slam(camera=camera)
        self.assert_refused(outcome, "camera.yaml", "camera_matrix.data")
        assert outcome.code == 1, outcome

    def test_unknown_configuration_key(self):
        config = self.write("config.yaml", "features:\n  cuont: 1000\n")
        self.assert_refused(self.run_slam("--config", config), "config.yaml:2", "features.cuont", "features.count")

    def test_value_out_of_bounds(self):
        self.assert_refused(self.run_slam("--set", "features.count=5"), "--set features.count", "100")

    # ---- detections, detectors

    def test_malformed_json(self):
        self.assert_refused(self.run_slam("--detections", self.write("d.json", '[{"file_name": "0.png", ')), "d.json")

    def check_box(self, box, *words):
        text = '[{"file_name": "000007.png", "detections": [{"category_id": 1, "detection_score": 0.9, "bbox": %s}]}]' % box
        self.assert_refused(self.run_slam("--detections", self.write("d.json", text)), "d.json", *words)

    def test_nan_box(self):
        self.check_box("[1, 2, NaN, 4]")

    def test_null_in_a_box(self):
        self.check_box("[1, 2, null, 4]", "000007.png")

    def test_inverted_box(self):
        self.check_box("[10, 2, 5, 4]", "000007.png", "x1 < x2")

    def test_a_model_that_is_no_detector(self):
        model = self.write("model.onnx", "no network")
        self.assert_refused(self.run_slam("--detector", model), "model.onnx")
        self.assert_refused(oaslam("detect", "--images", VIDEO, "--detector", model, "--out", self.out + ".json"), "model.onnx")

    # ---- map files

    def assert_map_refused(self, path, *words):
        self.assert_refused(self.run_slam("--to", "5", "--map-in", path), *words)
        self.assert_refused(oaslam("info", path), *words)

    def test_map_files_that_are_none(self):
        self.assert_map_refused("/nowhere/desk.map", "/nowhere/desk.map")
        self.assert_map_refused(self.write("text.map", "not a map\n" * 100), "text.map")
        foreign = os.path.join(self.folder, "foreign.map")
        with sqlite3.connect(foreign) as database:
            database.execute("CREATE TABLE meta(key, value)")
        self.assert_map_refused(foreign, "foreign.map")

    def test_damaged_map(self):
        whole = os.path.join(self.folder, "whole.map")
        outcome = self.run_slam("--detections", DETECTIONS, "--to", "80", "--map-out", whole)
        assert outcome.code == 0, outcome
        with open(whole, "rb") as f:
            content = f.read()
        middle = len(content) // 8192 * 4096  # a page begins
        for name, damaged in (("truncated.map", content[: len(content) // 2]),
                              ("zeroed.map", content[:middle] + bytes(4096) + content[middle + 4096:])):
            path = os.path.join(self.folder, name)
            with open(path, "wb") as f:
                f.write(damaged)
            self.assert_map_refused(path, name)
        for name, statement, word in (("newer.map", "PRAGMA user_version = 99", "99"),
                                      ("changed.map", "UPDATE landmarks SET x = x + 1e-9 WHERE id = (SELECT max(id) FROM landmarks)", "landmarks")):
            path = os.path.join(self.folder, name)
            shutil.copy(whole, path)
            with sqlite3.connect(path) as database:
                database.execute(statement)
            self.assert_map_refused(path, name, word)
        for command in (("export", "--format", "tum"), ("localize", "--detections", DETECTIONS)):
            self.assert_refused(oaslam(*command, "--map", whole, "--out", self.out, "--submap", "7"), "whole.map", "submap 7", "0 to 0")

    # ---- output

    def test_output_folder_that_cannot_be(self):
        self.out = os.path.join(self.write("file", ""), "out")
        outcome = self.run_slam()
        self.assert_refused(outcome, self.out)
        assert "/450" not in outcome.err  # refused before the work begins: no line of progress

    def test_map_file_that_cannot_be(self):
        """It is refused before the work begins."""
        in_a_file = os.path.join(self.write("file", ""), "desk.map")
        pipe = os.path.join(self.folder, "pipe")
        os.mkfifo(pipe)
        for path in (in_a_file, self.folder, pipe):
            outcome = self.run_slam("--map-out", path)
            self.assert_refused(outcome, path)
            assert "/450" not in outcome.err  # no line of progress
            self.assert_refused(oaslam("map-objects", "--trajectory", harness.groundtruth("map_front"), "--camera", CAMERA, "--detections", DETECTIONS,
                                       "--out", self.out, "--map-out", path), path)

    def test_map_file_in_a_folder_that_is_not_there_yet(self):
        path = os.path.join(self.folder, "maps", "today", "desk.map")
        outcome = self.run_slam("--to", "80", "--map-out", path)
        assert outcome.code == 0, outcome
        assert oaslam("info", path).code == 0

    def test_interrupt_writes_what_there_is(self):
        command = [harness.BINARY, "run", *harness.clip("map_front"), "--out", self.out, "--map-out", self.out + ".map"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for line in process.stderr:  # plain progress lines, as this is no terminal
            if "90/450" in line or "20 %" in line:
                break
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        assert process.returncode >= 0, err  # ended by itself
        frames = harness.read_csv(os.path.join(self.out, "frames.csv"))
        assert len(frames) >= 90
        assert len(frames) < 450
        assert self.tracked() > 40
        assert harness.read_json(os.path.join(self.out, "summary.json"))["frames"] == len(frames)
        assert oaslam("info", self.out + ".map").code == 0

    # ---- the command line

    def test_usage(self):
        for args in (["run"], ["nonsense"], ["run", "--imgaes", VIDEO], []):
            outcome = oaslam(*args)
            assert outcome.code > 0, outcome
        for args in (["nonsense"], ["run", "--imgaes", VIDEO], ["run", VIDEO, "--relocalization", "smell"]):
            outcome = oaslam(*args)
            assert 100 <= outcome.code <= 127, outcome  # as the manual page says
        assert oaslam("--help").code == 0
        alone = oaslam()
        assert alone.code == 1, alone
        assert "oaslam run walk.mp4" in alone.out
        assert alone.err == ""
