"""A map that was continued with another film: its recordings are told apart."""
import os
import sqlite3
import subprocess

import films
import harness
import numpy as np
from harness import must_run, oaslam

CAMERA = os.path.join(harness.SAMPLE, "map_front", "camera.yaml")


def cut(source, begin, count, out):
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-ss", str(begin), "-i", source, "-frames:v", str(count), "-c:v", "libx264", "-preset", "veryfast", "-crf", "14", out], check=True)


class TestRecordings(harness.InFolder):
    @classmethod
    def prepare(cls):
        video = os.path.join(harness.SAMPLE, "map_front", "video.mp4")
        cls.a, cls.b, cls.map = cls.path("a film.mp4"), cls.path("b.mp4"), cls.path("ab.map")
        cut(video, 0, 150, cls.a)
        cut(video, 5, 150, cls.b)  # both begin at 0 s
        must_run("run", "--images", cls.a, "--camera", CAMERA, "--out", cls.path("a"), "--map-out", cls.path("a.map"), "--quiet")
        must_run("run", "--images", cls.b, "--camera", CAMERA, "--map-in", cls.path("a.map"), "--map-out", cls.map, "--out", cls.path("b"), "--quiet")
        with sqlite3.connect(cls.map) as db:
            cls.recordings = db.execute("SELECT name, images, first_frame FROM recordings ORDER BY number").fetchall()
            of = db.execute("SELECT frame_index, timestamp FROM keyframes").fetchall()
        cls.times = [[t for f, t in of if (f >= cls.recordings[1][2]) == second] for second in (False, True)]

    def test_the_map_names_both(self):
        assert [(r[0], r[1]) for r in self.recordings] == [("a film", self.a), ("b", self.b)]
        info = must_run("info", self.map).out
        assert "1 (a film): " in info and "2 (b): " in info
        assert min(len(t) for t in self.times) > 3

    def test_pictures_are_of_their_own_film(self):
        out = self.path("nerf")
        must_run("export", "--map", self.map, "--format", "nerfstudio", "--images", "auto", "--out", out)
        frames = harness.read_json(f"{out}/transforms.json")["frames"]
        assert len(frames) == sum(map(len, self.times))
        right = {"1-a_film": films.read(self.a), "2-b": films.read(self.b)}
        for frame in frames:
            _, folder, name = frame["file_path"].split("/")
            difference = films.read(f"{out}/{frame['file_path']}")[0].astype(int) - right[folder][int(name[:-4])]
            assert np.abs(difference).mean() < 2

    def test_one_is_taken_by_its_images_or_its_number(self):
        for args in (["--images", self.b], ["--recording", "2", "--images", self.b], ["--recording", "b"]):
            out = self.path("one")
            must_run("export", "--map", self.map, "--format", "colmap", *args, "--out", out)
            with open(f"{out}/images.txt") as f:
                names = [line.split()[9] for line in f.read().splitlines()[2::2]]
            assert len(names) == len(self.times[1]), args

    def test_images_that_may_be_of_either_are_refused(self):
        other = self.path("other.mp4")
        os.link(self.b, other)
        for args, words in ((["--images", other], ["2 recordings: 1 (a film), 2 (b)", "--recording"]), (["--recording", "3"], ['no recording "3"']),
                            (["--images", self.a, "--images", self.a, "--images", self.b], ["given 3 times"])):
            outcome = oaslam("export", "--map", self.map, "--format", "colmap", *args, "--out", self.path("refused"))
            assert outcome.code != 0
            for word in words:
                assert word in outcome.err, outcome
        assert not os.path.exists(self.path("refused"))

    def test_times_are_not_mixed(self):
        refused = oaslam("export", "--map", self.map, "--format", "tum", "--out", self.path("ab.tum"))
        assert refused.code != 0 and "times overlap" in refused.err and "--recording" in refused.err
        must_run("export", "--map", self.map, "--format", "tum", "--out", self.path("tum"))
        for name in ("1-a_film.txt", "2-b.txt"):
            with open(self.path(f"tum/{name}")) as f:
                times = [float(line.split()[0]) for line in f]
            assert times == sorted(set(times)) and len(times) > 100
        must_run("export", "--map", self.map, "--format", "tum", "--recording", "1", "--out", self.path("a.tum"))
        assert harness.read_bytes(self.path("a.tum")) == harness.read_bytes(self.path("tum/1-a_film.txt"))
        # Results of the second run are of its recording alone.
        with open(self.path("b/keyframes.txt")) as f:
            assert len(f.readlines()) == len(self.times[1])

    def test_evaluate_shows_each(self):
        truth = harness.read_tum(harness.groundtruth("map_front"))
        for name, begin in (("a", 0), ("b", 5)):
            with open(self.path(f"truth_{name}.txt"), "w") as f:
                for t, p, q in truth:
                    f.write(" ".join(map(str, [t - begin, *p, *q])) + "\n")
        both = must_run("evaluate", "trajectory", self.map, self.path("truth_a.txt"), self.path("truth_b.txt")).out
        errors = [float(line.split()[2]) for line in both.splitlines() if line.startswith("ATE position")]
        assert len(errors) == 2 and max(errors) < 0.01, both
        assert "recording 1 (a film)" in both and "recording 2 (b)" in both
        one = oaslam("evaluate", "trajectory", self.map, self.path("truth_a.txt"))
        assert one.code != 0 and "2 recordings" in one.err

    def test_a_merged_map_knows_both(self):
        merged = self.path("merged.map")
        must_run("run", "--images", self.b, "--camera", CAMERA, "--out", self.path("b_alone"), "--map-out", self.path("b.map"), "--quiet")
        must_run("merge", self.path("a.map"), self.path("b.map"), "--out", merged)
        assert "1 (a film): " in must_run("info", merged).out
        must_run("export", "--map", merged, "--format", "nerfstudio", "--images", "auto", "--out", self.path("merged"))
        assert sorted(os.listdir(self.path("merged/images"))) == ["1-a_film", "2-b"]
