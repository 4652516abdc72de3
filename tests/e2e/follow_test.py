"""A folder that grows while it is read: oaslam run --follow."""
import os
import shutil
import signal
import subprocess
import time

import harness
import pytest
from harness import must_run, oaslam

FRAMES = 60


class TestFollow(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.frames = cls.path("frames")
        subprocess.run([harness.EXTRACT, harness.clip("map_front")[1], cls.frames, "0", str(FRAMES)], check=True)
        cls.names = sorted(os.listdir(os.path.join(cls.frames, "rgb")))
        assert len(cls.names) == FRAMES

    @pytest.fixture(autouse=True)
    def each_in_a_folder(self, tmp_path):
        self.folder, self.images, self.out = map(str, (tmp_path, tmp_path / "images", tmp_path / "out"))
        os.mkdir(self.images)

    def bring(self, begin, end):
        for name in self.names[begin:end]:
            shutil.copy(os.path.join(self.frames, "rgb", name), os.path.join(self.images, name + ".part"))
            os.rename(os.path.join(self.images, name + ".part"), os.path.join(self.images, name))

    def start(self, *options):
        command = [harness.BINARY, "run", "--images", self.images, *harness.clip("map_front")[2:], "--out", self.out, "--map-out", self.out + ".map",
                   "--follow", *options]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def frames_done(self):
        return len(harness.read_csv(os.path.join(self.out, "frames.csv")))

    def test_the_same_as_the_finished_folder(self):
        process = self.start()  # on an empty folder
        for begin in range(0, FRAMES, 20):
            time.sleep(0.3)
            self.bring(begin, begin + 20)
        open(os.path.join(self.images, "stop"), "w").close()
        out, err = process.communicate(timeout=120)
        assert process.returncode == 0, out + err
        assert self.frames_done() == FRAMES
        again = os.path.join(self.folder, "again")
        must_run("run", "--images", self.images, *harness.clip("map_front")[2:], "--out", again)
        assert harness.read_bytes(os.path.join(self.out, "trajectory.txt")) == harness.read_bytes(os.path.join(again, "trajectory.txt"))
        assert len(harness.read_tum(os.path.join(again, "trajectory.txt"))) > 30

    def test_ends_when_nothing_comes(self):
        self.bring(0, 10)
        process = self.start("0.5")
        out, err = process.communicate(timeout=60)
        assert process.returncode == 0, out + err
        assert self.frames_done() == 10

    def test_interrupt_saves_what_there_is(self):
        self.bring(0, 40)
        process = self.start()
        deadline = time.time() + 60
        while process.poll() is None and time.time() < deadline and not os.path.isdir(self.out):
            time.sleep(0.1)
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 130, err
        assert self.frames_done() > 0
        assert oaslam("info", self.out + ".map").code == 0

    def test_live_takes_the_newest(self):
        process = self.start("1", "--mode", "live")
        self.bring(0, FRAMES)
        out, err = process.communicate(timeout=60)
        assert process.returncode == 0, out + err
        frames = [int(f["frame"]) for f in harness.read_csv(os.path.join(self.out, "frames.csv"))]
        assert frames == sorted(set(frames))
        assert frames[-1] == FRAMES - 1  # images may be skipped, but not the last one

    def test_live_bad_input_ends_it(self):
        self.bring(0, 3)
        command = [harness.BINARY, "run", "--images", self.images, "--camera", os.path.join(self.folder, "no.yaml"), "--out", self.out, "--follow",
                   "--mode", "live"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=30)  # otherwise the folder would be followed forever
        assert done.returncode == 1, done
        assert "no.yaml" in done.stderr

    def test_bad_input(self):
        for images, words in ((harness.clip("map_front")[1], "--follow"), (self.frames, "rgb.txt"), (os.path.join(self.folder, "none"), "--follow")):
            outcome = oaslam("run", "--images", images, *harness.clip("map_front")[2:], "--out", self.out, "--follow")
            assert outcome.code == 1, outcome
            assert words in outcome.err
        assert oaslam("run", "--images", self.images, *harness.clip("map_front")[2:], "--out", self.out, "--follow", "-3").code > 0
