"""Poses that must be rejected: in a map with the same objects at other places, and in a map of another room. No ground truth is needed, since all poses are wrong."""
import os
import subprocess

import harness
import pytest
from harness import must_run

MOST_FALSE = 0.005  # share of frames
WRONG_MAPS = 3


class TestWrongMap:
    def accepted(self, mapped, query, folder, *options):
        """Accepted frames, all frames, and their mean confidence."""
        out = os.path.join(folder, "out")
        must_run("localize", "--map", mapped, *query, "--relocalization", "objects", "--every-frame", "--out", out, *options)
        frames = harness.read_csv(os.path.join(out, "frames.csv"))
        return sum(f["status"] != "failed" for f in frames), len(frames), sum(float(f["confidence"]) for f in frames) / len(frames)

    def check(self, mapped, query, folder):
        right, frames, confidence = self.accepted(mapped, query, folder)
        assert right > 0.6 * frames
        wrong = total = 0
        for seed in range(WRONG_MAPS):
            other = os.path.join(folder, f"wrong{seed}.map")
            subprocess.run([harness.REARRANGE, mapped, other, str(seed)], check=True)
            accepted, asked, doubtful = self.accepted(other, query, folder)
            wrong, total = wrong + accepted, total + asked
            assert doubtful < 0.6 * confidence
        assert wrong <= MOST_FALSE * total

    def test_the_sample_with_its_objects_at_exchanged_places(self, tmp_path):
        mapped = os.path.join(tmp_path, "desk.map")
        must_run("map-objects", "--trajectory", harness.groundtruth("map_front"), *harness.clip("map_front")[2:], "--out",
                 os.path.join(tmp_path, "out"), "--map-out", mapped)
        self.check(mapped, harness.clip("query_around")[2:], tmp_path)

    def test_the_papers_desk(self, tmp_path):
        desk = os.path.join(os.environ.get("OASLAM_DATA", ""), "fr2_desk_objects")
        if not os.path.isdir(desk):
            pytest.skip("needs fr2_desk_objects under OASLAM_DATA")
        camera = ["--camera", os.path.join(desk, "camera.yaml"), "--detections", os.path.join(desk, "detections.json")]
        mapped = os.path.join(tmp_path, "desk.map")
        must_run("map-objects", "--trajectory", os.path.join(desk, "reference_trajectory.txt"), *camera, "--to", "700", "--out",
                 os.path.join(tmp_path, "out"), "--map-out", mapped)
        self.check(mapped, [*camera, "--from", "700"], tmp_path)
        # Another room, with objects of the same classes.
        other = harness.clip("query_around")[2:]
        accepted, asked, _ = self.accepted(mapped, other, tmp_path)
        assert accepted <= MOST_FALSE * asked
