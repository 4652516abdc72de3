"""Localization in a saved map of the sample, and SLAM that goes on in it."""
import os
import re
import subprocess
import xml.etree.ElementTree

import harness
import pytest
from harness import must_run, oaslam


class TestLocalize(harness.InFolder):
    def localize(self, name, *args):
        """Lines of frames.csv, and metres of error of each pose."""
        folder = os.path.join(self.folder, name)
        must_run("localize", "--map", harness.DESK_MAP, "--out", folder, *args)
        truth = harness.read_tum(harness.groundtruth("query_around"))
        poses = harness.read_tum(os.path.join(folder, "poses.txt"))
        errors = harness.distances(harness.pairs(poses, truth), harness.map_alignment())
        assert len(errors) == len(poses)
        frames = harness.read_csv(os.path.join(folder, "frames.csv"))
        assert sum(f["status"] != "failed" for f in frames) == len(poses)
        return frames, errors

    def test_localization_by_points_and_objects(self):
        frames, errors = self.localize("both", *harness.clip("query_around"), "--relocalization", "points+objects", "--every-frame",
                                       "--to", "150")
        assert len(frames) == 150
        assert sum(e < 0.2 for e in errors) > 0.7 * 150
        assert sum(e < 0.3 for e in errors) > 0.95 * len(errors)
        self.check_evaluation(os.path.join(self.folder, "both"), errors)

    def test_photos_of_other_sizes_are_found_each_by_itself(self):
        photos = self.path("photos")
        os.mkdir(photos)
        video = os.path.join(harness.SAMPLE, "map_front", "video.mp4")
        for name, at, change in (("0.png", 1, "null"), ("1.png", 3, "transpose=1"), ("2.png", 5, "null"), ("3.png", 7, "scale=480:360")):
            subprocess.run(["ffmpeg", "-nostdin", "-loglevel", "error", "-ss", str(at), "-i", video, "-frames:v", "1", "-vf", change,
                            os.path.join(photos, name)], check=True)
        camera = harness.clip("map_front")[3]
        for options in ((), ("--camera", camera)):
            out = self.path("photos_out" + str(len(options)))
            must_run("localize", "--map", harness.DESK_MAP, "--images", photos, "--every-frame", *options, "--out", out)
            frames = harness.read_csv(os.path.join(out, "frames.csv"))
            assert [f["status"] != "failed" for f in frames] == [True] * 4
            for frame, focal in zip(frames, (525, 525, 525, 393.75)):
                assert float(frame["focal_length"]) == pytest.approx(focal, rel=0.05)

    def test_learned_descriptors_find_the_desk_from_as_far_round(self):
        part = [*harness.clip("query_around")[:4], "--relocalization", "points", "--every-frame", "--from", "60", "--to", "90"]
        found = {kind: self.localize(kind, *part, "--set", f"features.descriptor={kind}")[1] for kind in ("orb", "learned+orb")}
        assert len(found["learned+orb"]) >= len(found["orb"]) > 10
        assert sum(e < 0.2 for e in found["learned+orb"]) > 0.9 * len(found["learned+orb"])

    def check_evaluation(self, folder, errors):
        """The program's own evaluation agrees with that of the test."""
        plot = os.path.join(folder, "curve.svg")
        outcome = must_run("evaluate", "relocalization", "--poses", os.path.join(folder, "poses.txt"),
                           "--groundtruth", harness.groundtruth("query_around"), "--map-groundtruth", harness.groundtruth("map_front"),
                           "--map-trajectory", os.path.join(harness.DESK, "keyframes.txt"), "--plot", plot)
        recall = next(line for line in outcome.out.splitlines() if line.split()[:1] == ["recall"])
        within_20cm = float(recall.split()[5])  # recall A % B % C % ...: within 5, 10, 20 cm
        assert within_20cm == pytest.approx(100 * sum(e <= 0.2 for e in errors) / 150, abs=1.5)
        xml.etree.ElementTree.parse(plot)

    def test_poses_that_no_object_tells_are_not_counted_by_objects(self):
        out = self.path("no_boxes")
        done = must_run("localize", "--map", harness.DESK_MAP, *harness.clip("query_around")[:4], "--to", "150", "--out", out)
        counts = re.search(r"^(\d+) of 150 images localized \((\d+) by points, 0 by points from objects, 0 by objects alone, (\d+) followed from these\); results in",
                           done.out, re.MULTILINE)
        assert counts, done
        localized, by_points, followed = map(int, counts.groups())
        states = [f["status"] for f in harness.read_csv(os.path.join(out, "frames.csv"))]
        assert (by_points, followed) == (states.count("points"), states.count("followed"))
        assert localized == by_points + followed == len(harness.read_tum(os.path.join(out, "poses.txt")))
        assert followed > 0, done

    def test_localization_by_detections_alone(self):
        clip = harness.clip("query_around")
        frames, errors = self.localize("objects", *clip[2:], "--relocalization", "objects", "--every-frame")
        assert len(frames) == 300
        assert {f["status"] for f in frames} <= {"objects", "failed"}
        assert sum(e < 0.3 for e in errors) > 0.6 * 300
        assert sum(e < 0.5 for e in errors) > 0.95 * len(errors)

    def test_few_boxes_tell_more_over_several_images(self):
        folder = harness.clip("query_around")
        few = [*folder[2:-1], folder[-1].replace("detections.json", "detections_sparse.json"), "--relocalization", "objects"]
        assert "sparse" in few[-3]
        alone, _ = self.localize("alone", *few, "--every-frame")
        following, errors = self.localize("following", *few)
        groups, _ = self.localize("groups", *few, "--forget-every", "10")
        found = lambda frames: sum(f["status"] == "objects" for f in frames)
        assert found(following) > found(alone) + 30
        assert found(following) > found(groups)
        assert sum(e > 0.5 for e in errors) == 0
        # The first image of each group is found as it is by itself.
        assert [f["status"] for f in groups[::10]] == [f["status"] for f in alone[::10]]
        assert [f["object_score"] for f in groups[::10]] == [f["object_score"] for f in alone[::10]]

    def test_forgetting_is_refused_where_it_makes_no_sense(self):
        clip = harness.clip("query_around")[2:]
        for options in (["--forget-every", "0"], ["--forget-every", "-3"], ["--forget-every", "x"], ["--forget-every", "3", "--every-frame"]):
            outcome = oaslam("localize", "--map", harness.DESK_MAP, "--out", os.path.join(self.folder, "refused"), *clip, "--relocalization", "objects", *options)
            assert outcome.code in (105, 108), outcome  # CLI11's ValidationError and ExcludesError
            assert "--forget-every" in outcome.err

    def test_localization_as_in_the_paper(self):
        """Three objects fit some pose of almost any map: a pose is always given, right or not, and nothing is said of how sure it is."""
        paper = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "tools", "paper.yaml")
        frames, errors = self.localize("paper", *harness.clip("query_around")[2:], "--relocalization", "objects", "--every-frame", "--config", paper)
        assert {f["status"] for f in frames} == {"objects"}
        assert {float(f["confidence"]) for f in frames} == {0}
        assert sum(e < 0.2 for e in errors) > 0.6 * 300
        _, ours = self.localize("ours", *harness.clip("query_around")[2:], "--relocalization", "objects", "--every-frame")
        assert sorted(ours)[150] < sorted(errors)[150]

    def test_each_curve_may_have_a_map_of_its_own(self):
        folder = os.path.join(self.folder, "few")
        self.localize("few", *harness.clip("query_around")[2:], "--relocalization", "objects", "--to", "40")
        maps = [os.path.join(harness.DESK, name) for name in ("keyframes.txt", "trajectory.txt")]
        poses = os.path.join(folder, "poses.txt")

        def evaluate(curves, trajectories):
            options = sum((["--poses", poses] for _ in range(curves)), []) + sum((["--map-trajectory", m] for m in trajectories), [])
            return oaslam("evaluate", "relocalization", *options, "--groundtruth", harness.groundtruth("query_around"),
                          "--map-groundtruth", harness.groundtruth("map_front"))

        def lines_of(outcome):
            assert outcome.code == 0, outcome
            return [line for line in outcome.out.splitlines() if line.startswith("few:")]

        each = lines_of(evaluate(2, maps))
        assert each == lines_of(evaluate(1, maps[:1])) + lines_of(evaluate(1, maps[1:]))
        assert lines_of(evaluate(2, maps[:1])) == 2 * each[:1]
        refused = evaluate(3, maps)
        assert refused.code == 1, refused
        assert "--map-trajectory: given 2 times for 3 --poses" in refused.err

    def test_going_on_in_a_saved_map(self):
        folder = os.path.join(self.folder, "again")
        must_run("run", *harness.clip("map_front"), "--from", "100", "--to", "180", "--map-in", harness.DESK_MAP, "--out", folder)
        frames = harness.read_csv(os.path.join(folder, "frames.csv"))
        assert sum(f["state"] in ("tracking", "relocalized") for f in frames) > 0.9 * 80
        matched = harness.pairs(harness.read_tum(os.path.join(folder, "trajectory.txt")),
                                harness.read_tum(harness.groundtruth("map_front")))
        assert harness.rmse(harness.distances(matched, harness.map_alignment())) < 0.03
