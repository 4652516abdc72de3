"""Runs without a calibration: the camera is estimated from the images."""
import os
import re
import subprocess

import harness
import pytest
from harness import must_run, oaslam

TRUE_FOCAL = 525.0


def without_camera(name):
    """Options that name a clip of the sample, but not its camera."""
    folder = os.path.join(harness.SAMPLE, name)
    return ["--images", f"{folder}/video.mp4", "--detections", f"{folder}/detections.json"]


class TestAutoCamera(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.out, cls.map = os.path.join(cls.folder, "run"), os.path.join(cls.folder, "desk.map")
        cls.slam = must_run("run", *without_camera("map_front"), "--out", cls.out, "--map-out", cls.map, "--groundtruth", harness.groundtruth("map_front"))

    def focal_of(self, folder):
        with open(os.path.join(folder, "camera.yaml")) as f:
            text = f.read()
        return float(re.search(r"camera_matrix:.*?data: \[([-+.\de]+),", text, re.S).group(1))

    def test_the_focal_length_is_found(self):
        assert self.focal_of(self.out) / TRUE_FOCAL == pytest.approx(1, abs=0.015)
        summary = harness.read_json(os.path.join(self.out, "summary.json"))
        assert summary["camera"]["source"] == "images"
        assert summary["camera"]["fx"] == pytest.approx(self.focal_of(self.out), abs=1e-3)
        assert summary["camera"]["sigma_f"] < 0.01 * TRUE_FOCAL
        assert summary["ate"] < 0.005
        assert "focal length" in self.slam.err + self.slam.out

    def test_what_is_written_is_read_again(self):
        out = os.path.join(self.folder, "again")
        clip = without_camera("map_front") + ["--to", "60"]
        assert oaslam("run", *clip, "--camera", os.path.join(self.out, "camera.yaml"), "--out", out).code == 0
        assert self.focal_of(out) == pytest.approx(self.focal_of(self.out), abs=1e-3)
        assert harness.read_json(os.path.join(out, "summary.json"))["camera"]["source"] == "given"

    def test_the_same_each_time(self):
        folders = [os.path.join(self.folder, name) for name in ("one", "two")]
        for folder in folders:
            must_run("run", *without_camera("map_front"), "--to", "200", "--refine-camera", "--camera", "fov:75", "--out", folder)
        for name in ("camera.yaml", "trajectory.txt", "keyframes.txt", "objects.json"):
            one, two = (harness.read_bytes(os.path.join(folder, name)) for folder in folders)
            assert one == two, name
        assert self.focal_of(folders[0]) / TRUE_FOCAL == pytest.approx(1, abs=0.03)

    def test_a_camera_that_stands_still_is_not_guessed_in_silence(self):
        folder = os.path.join(self.folder, "still")
        subprocess.run([harness.EXTRACT, os.path.join(harness.SAMPLE, "map_front", "video.mp4"), folder, "0", "1"], check=True)
        name = os.listdir(os.path.join(folder, "rgb"))[0]
        listed = os.path.join(self.folder, "still.txt")
        with open(listed, "w") as f:
            f.writelines(f"{i / 30:.6f} still/rgb/{name}\n" for i in range(40))
        outcome = must_run("run", "--images", listed, "--out", os.path.join(self.folder, "nowhere"))
        assert "not determined by the images" in outcome.out + outcome.err

    def test_single_images_are_localized(self):
        out = os.path.join(self.folder, "query")
        must_run("localize", "--map", self.map, *without_camera("query_around"), "--to", "60", "--every-frame", "--out", out)
        frames = [f for f in harness.read_csv(os.path.join(out, "frames.csv")) if f["status"] != "failed"]
        assert len(frames) > 40
        for frame in frames:
            assert float(frame["focal_length"]) / TRUE_FOCAL == pytest.approx(1, abs=0.1)

    def test_detections_alone_need_a_calibration(self):
        detections = os.path.join(harness.SAMPLE, "query_around", "detections.json")
        outcome = oaslam("localize", "--map", self.map, "--detections", detections, "--relocalization", "objects", "--out", os.path.join(self.folder, "boxes"))
        assert outcome.code != 0
        assert "--camera auto needs --images" in outcome.out + outcome.err
