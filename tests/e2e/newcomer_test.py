"""What a newcomer types: a video and nothing else."""
import json
import os
import shutil
import socket
import subprocess
import unittest
import unittest.mock

import harness
from harness import oaslam


class Newcomer(harness.InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.video, cls.out = cls.path("walk.mp4"), cls.path("walk.oaslam")
        shutil.copy(os.path.join(harness.SAMPLE, "map_front", "video.mp4"), cls.video)
        cls.mapped = oaslam("run", cls.video, "--to", 220)
        cls.made = [cls.mapped]

    def test_nothing_but_a_video(self):
        self.assertRegex(self.mapped.err, r"camera: focal length 5[0-4]\d\.\d \+- .* estimated")
        self.assertEqual(self.mapped.out.strip().splitlines()[-1], f"to look at it: oaslam view {self.out}")
        summary = harness.read_json(os.path.join(self.out, "summary.json"))
        self.assertGreater(summary["tracked"], 210)
        self.assertEqual(summary["images"], self.video)
        self.assertTrue(os.path.exists(os.path.join(self.out, "map.svg")))
        self.assertEqual(oaslam("info", os.path.join(self.out, "map.oaslam")).code, 0)

    @harness.needs_detector
    def test_objects_are_mapped_by_the_default_detector(self):
        self.assertRegex(self.mapped.err, r"detector: yolox_nano, \d+ of 220 images looked at")
        summary = harness.read_json(os.path.join(self.out, "summary.json"))
        self.assertGreaterEqual(summary["objects"], 3)
        # Not every image of a slow camera is worth a look.
        self.assertGreater(summary["detector"]["images"], 30)
        self.assertLess(summary["detector"]["images"], 150)

    def test_the_same_on_every_run(self):
        again = self.path("again")
        done = oaslam("run", self.video, "--to", 220, "--out", again)
        self.assertEqual(done.code, 0, done)
        for name in ("trajectory.txt", "objects.json"):
            self.assertEqual(harness.read_bytes(os.path.join(self.out, name)), harness.read_bytes(os.path.join(again, name)))

    @harness.needs_detector
    def test_the_same_where_the_camera_is_lost(self):
        # On one processor the detector has fewer threads, reads less far ahead, and is slower.
        clip, processors, outs = harness.clip("lost_and_back")[:4], os.sched_getaffinity(0), (self.path("lost"), self.path("lost_again"))
        for out, allowed in zip(outs, (processors, {min(processors)})):
            os.sched_setaffinity(0, allowed)
            try:
                done = oaslam("run", *clip, "--detector", "default", "--out", out, "--map-out", out + ".map")
            finally:
                os.sched_setaffinity(0, processors)
            self.assertEqual(done.code, 0, done)
        frames, again = ([{k: v for k, v in row.items() if "ms" not in k} for row in harness.read_csv(os.path.join(out, "frames.csv"))] for out in outs)
        self.assertGreater(sum(f["state"] == "lost" for f in frames), 10)
        self.assertEqual(frames, again)
        self.assertEqual(*(harness.read_json(os.path.join(out, "summary.json"))["detector"]["images"] for out in outs))
        for name in (".map", "/trajectory.txt", "/trajectory_live.txt", "/objects.json"):
            self.assertEqual(*(harness.read_bytes(out + name) for out in outs), name)

    def test_results_are_not_overwritten_unasked(self):
        done = oaslam("run", self.video, "--to", 50)
        self.assertEqual(done.code, 1, done)
        self.assertIn("walk.oaslam: there are results already; --force", done.err)
        copy = self.path("copy.oaslam")
        shutil.copytree(self.out, copy)
        forced = oaslam("run", self.video, "--to", 60, "--out", copy, "--force", "--detector", "none")
        self.assertEqual(forced.code, 0, forced)
        self.assertEqual(harness.read_json(os.path.join(copy, "summary.json"))["frames"], 60)
        for force in ([], ["--force"]):  # the form for scripts overwrites in any case
            done = oaslam("run", "--images", self.video, "--to", 50, "--out", copy, *force)
            self.assertEqual(done.code, 0, done)
            self.assertEqual(harness.read_json(os.path.join(copy, "summary.json"))["frames"], 50)

    def test_where_nothing_can_be_written_is_said_before_the_run(self):
        done = oaslam("run", self.video, "--out", os.path.join(self.video, "out"))
        self.assertEqual(done.code, 1, done)
        self.assertNotIn("estimating", done.err)
        self.assertIn("walk.mp4/out", done.err)

    def test_what_is_named_is_read_before_the_camera_is_estimated(self):
        noise = self.path("noise.txt")
        with open(noise, "w") as f:
            f.write("no number\n")
        with socket.create_server(("127.0.0.1", 0)) as taken:
            for options, words in ((["--detector", noise], "noise.txt"), (["--detector", "none", "--gravity", noise], "noise.txt:1"),
                                   (["--detections", noise], "noise.txt"), (["--classes", self.path("none.yaml")], "none.yaml"), (["--map-in", noise], "noise.txt"),
                                   (["--scale-object", "cup"], "--scale-object"), (["--scale-object", "cpu=1"], "cpu"), (["--groundtruth", noise], "noise.txt"),
                                   (["--scale-from", "gt"], "--groundtruth"), (["--record", self.path("walk.avi")], "walk.avi"),
                                   (["--record", self.path("new.mp4"), "--model", self.path("none.glb")], "none.glb"),
                                   (["--viewer", taken.getsockname()[1]], str(taken.getsockname()[1])), (["--refine-camera", "--camera", noise], "noise.txt")):
                done = oaslam("run", self.video, "--out", self.path("refused"), *options)
                self.assertEqual(done.code, 1, (options, done))
                self.assertIn(words, done.err)
                self.assertNotIn("estimating", done.err, options)
                self.assertFalse(os.path.exists(self.path("refused")), options)

    def test_find_other_images_in_the_map(self):
        other = self.path("other.mp4")
        shutil.copy(os.path.join(harness.SAMPLE, "query_around", "video.mp4"), other)
        done = oaslam("localize", "--map", os.path.join(self.out, "map.oaslam"), other, "--to", 20)
        self.assertEqual(done.code, 0, done)
        self.assertGreater(len(harness.read_tum(self.path("other.localized/poses.txt"))), 15)

    def test_detections_mean_no_detector(self):
        clip = os.path.join(harness.SAMPLE, "map_front")
        done = oaslam("run", self.video, "--to", 60, "--camera", f"{clip}/camera.yaml", "--detections", f"{clip}/detections.json", "--out", self.path("given"))
        self.assertEqual(done.code, 0, done)
        self.assertNotIn("detector", harness.read_json(self.path("given/summary.json")))

    @harness.needs_detector
    def test_detect(self):
        for every in ([], ["--detector", "default"]):
            done = oaslam("detect", self.video, "--to", 3, "--out", self.path("boxes.json"), *every)
            self.assertEqual(done.code, 0, done)
            self.assertEqual(len(harness.read_json(self.path("boxes.json"))), 3)

    @harness.needs_detector
    def test_detect_every(self):
        clip = os.path.join(harness.SAMPLE, "map_front")
        done = oaslam("run", "--images", self.video, "--camera", f"{clip}/camera.yaml", "--to", 45, "--detector", "default", "--detect-every", 10,
                      "--out", self.path("tenth"))
        self.assertEqual(done.code, 0, done)
        self.assertEqual(harness.read_json(self.path("tenth/summary.json"))["detector"]["images"], 5)

    def test_what_cannot_be_understood(self):
        for args, message in ((["run"], "no images given"), (["run", "--force"], "run: no images given: oaslam run PATH"), (["run", "--images", self.video], "--images needs --out"), (["detect", "--out", "x.json"], "no images given"),
                              (["run", self.video, "--images", self.video], "excludes"), (["run", self.path("no.mp4")], "no.mp4"),
                              (["run", self.video, "--out", self.path("y"), "--detect-every", 0], "--detect-every")):
            done = oaslam(*args)
            self.assertNotEqual(done.code, 0, args)
            self.assertIn(message, done.err, args)

    def test_values_that_may_be_left_out_are_numbers(self):
        for options in (["--viewer"], ["--viewer", 0], ["--viewer=0"], ["--follow"], ["--follow", 2.5], ["--viewer", "--follow"]):
            done = oaslam("run", *options, "no.mp4")
            self.assertEqual(done.code, 1, done)
            self.assertIn("no.mp4: there is no such file", done.err)
        for bad in (["--viewer=no.mp4"], ["--viewer", 99999], ["--follow=soon"], ["--follow", -3]):
            done = oaslam("run", *bad, "no.mp4")
            self.assertGreater(done.code, 0, done)
            self.assertIn(bad[0].split("=")[0], done.err)

    def test_a_camera_is_live_unless_told_otherwise(self):
        config = self.path("config.yaml")
        with open(config, "w") as f:
            f.write("runner:\n  mode: sequential\n")
        for options, is_live in (([], True), (["--config", config], False), (["--set", "runner.mode=lockstep"], False), (["--mode", "lockstep"], False)):
            done = oaslam("run", "webcam:99", "--out", self.path("camera"), *options)
            self.assertEqual(done.code, 1, done)
            self.assertIn("webcam:99: cannot be opened", done.err)
            self.assertEqual("live: " in done.err, is_live, done)

    def test_results_are_beside_a_folder_however_it_is_named(self):
        images = self.path("images")
        subprocess.run([harness.EXTRACT, self.video, images, "0", "3"], check=True)
        os.makedirs(os.path.join(images, "a", "b"))
        for name, cwd in ((images, None), (images + "/", None), (".", images), ("..", images + "/a"), ("../..", images + "/a/b"), ("a/..", images)):
            done = oaslam("run", name, "--detector", "none", "--camera", "fov:60", cwd=cwd)
            self.assertEqual(done.code, 0, (name, done))
            shutil.rmtree(self.path("images.oaslam"))
        done = oaslam("run", "/", "--detector", "none", "--camera", "fov:60")
        self.assertEqual(done.code, 1, done)
        self.assertIn("error: /: there is nothing beside it: --out", done.err)

    def test_images_that_are_not_there_leave_nothing_behind(self):
        for command in (["run"], ["localize", "--map", os.path.join(self.out, "map.oaslam")]):
            done = oaslam(*command, self.path("wlak.mp4"))
            self.assertEqual(done.code, 1, done)
            self.assertIn("wlak.mp4: there is no such file", done.err)
        noise, outs = self.path("noise.mp4"), (self.path("new/folder"), self.path("new/maps"))
        with open(noise, "w") as f:
            f.write("no video")
        for command in (["run"], ["run", "--out", outs[0] + "/", "--map-out", outs[1] + "/x.map"], ["localize", "--map", os.path.join(self.out, "map.oaslam")],
                        ["detect", "--out", outs[0] + "/boxes.json"]):
            done = oaslam(*command, noise)
            self.assertEqual(done.code, 1, done)
            self.assertIn("noise.mp4", done.err)
        self.assertFalse([name for name in os.listdir(self.folder) if name.startswith(("wlak", "noise.", "new")) and name != "noise.mp4"])

    def test_alone_it_says_what_it_can_do(self):
        done = oaslam()
        self.assertEqual(done.code, 1)
        for command in ("run walk.mp4", "view walk.oaslam", "localize --map", "merge", "export", "detect"):
            self.assertIn(f"oaslam {command}", done.out)


if __name__ == "__main__":
    unittest.main(verbosity=2)
