"""--record: a video with one picture for each image, the same results with and without it, and refused options."""
import os
import subprocess

import harness
from harness import must_run, oaslam

COUNT = 120


def frames_of(video, folder):
    """Paths of a video's frames, as our own reader gives them."""
    subprocess.run([harness.EXTRACT, video, folder, "0", "-1"], check=True)
    return sorted(os.listdir(os.path.join(folder, "rgb")))


def without_times(path):
    """Rows of frames.csv without measured times."""
    return [{k: v for k, v in row.items() if "ms" not in k} for row in harness.read_csv(path)]


class TestRecord(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.map, cls.video = cls.path("desk.map"), cls.path("desk.mp4")
        cls.clip = [*harness.clip("map_front"), "--to", COUNT]
        cls.recorded = must_run("run", *cls.clip, "--out", cls.path("recorded"), "--map-out", cls.map, "--record", cls.video)

    def test_a_frame_for_each_image(self):
        assert len(frames_of(self.video, self.path("frames"))) == COUNT
        assert "FFMPEG" not in self.recorded.err
        assert "[" not in self.recorded.err.replace("[info]", "")  # no other library says anything, as "[name @ address] ..."

    def test_the_results_are_the_same(self):
        must_run("run", *self.clip, "--out", self.path("plain"), "--map-out", self.path("plain.map"))
        assert harness.read_bytes(self.path("plain.map")) == harness.read_bytes(self.map)
        for name in ("trajectory.txt", "trajectory_live.txt", "keyframes.txt", "objects.json"):
            assert harness.read_bytes(self.path("plain/" + name)) == harness.read_bytes(self.path("recorded/" + name)), name
        assert without_times(self.path("plain/frames.csv")) == without_times(self.path("recorded/frames.csv"))

    def test_localize(self):
        for options in ((), ("--every-frame",)):
            video = self.path("localized.mp4")
            must_run("localize", "--map", self.map, *harness.clip("map_front"), "--from", 40, "--to", 60, "--out", self.path("localized"),
                     "--record", video, *options)
            assert len(frames_of(video, self.path("localized" + "".join(options)))) == 20

    def test_anchors_are_drawn(self):
        anchored = self.path("anchored.map")
        an_object = max(harness.read_json(self.path("recorded/objects.json")), key=lambda o: o["observations"])["id"]
        must_run("anchors", self.map, "--place", f"it=robot@object:{an_object}", "--out", anchored)
        pictures = []
        for map_file in (self.map, anchored):
            name = os.path.basename(map_file)
            must_run("localize", "--map", map_file, *harness.clip("map_front"), "--from", 60, "--to", 70, "--out", self.path("content"), "--record", self.path(name + ".mp4"))
            folder = self.path(name + ".frames")
            pictures.append([harness.read_bytes(os.path.join(folder, "rgb", frame)) for frame in frames_of(self.path(name + ".mp4"), folder)])
        plain, with_content = pictures
        assert len(plain) == 10
        assert all(a != b for a, b in zip(plain, with_content, strict=True))

    def test_a_folder_of_grey_images(self):
        frames = self.path("grey")
        subprocess.run([harness.EXTRACT, harness.clip("map_front")[1], frames, "0", "20"], check=True)
        must_run("run", "--images", frames, "--camera", harness.clip("map_front")[3], "--out", self.path("grey_out"), "--record", self.path("grey.mp4"))
        assert len(frames_of(self.path("grey.mp4"), self.path("grey_frames"))) == 20

    def test_bad_input(self):
        for options, words in (
                (("--record", "/nowhere/a.mp4"), "/nowhere"),
                (("--record", "/proc/a.mp4"), "/proc/a.mp4"),
                (("--record", self.path("a.avi")), ".mp4")):
            outcome = oaslam("run", *self.clip, "--out", self.path("bad"), *options)
            assert outcome.code == 1, (options, outcome)
            assert words in outcome.err
            assert not os.path.exists(self.path("a.mp4"))
        outcome = oaslam("localize", "--map", self.map, *harness.clip("map_front")[2:], "--relocalization", "objects", "--out", self.path("bad"),
                         "--record", self.path("a.mp4"))
        assert outcome.code == 1, outcome
        assert "--record needs --images" in outcome.err
