"""What a newcomer types: a video and nothing else."""
import os
import re
import shutil
import signal
import socket
import subprocess

import harness
from harness import must_run, oaslam


class TestNewcomer(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.video, cls.out = cls.path("walk.mp4"), cls.path("walk.oaslam")
        shutil.copy(os.path.join(harness.SAMPLE, "map_front", "video.mp4"), cls.video)
        cls.mapped = must_run("run", cls.video, "--to", 220)

    def test_nothing_but_a_video(self):
        assert re.search(r"camera: focal length 5[0-4]\d\.\d \+- .* estimated", self.mapped.err)
        assert self.mapped.out.strip().splitlines()[-1] == f"to look at it: oaslam view {self.out}"
        summary = harness.read_json(os.path.join(self.out, "summary.json"))
        assert summary["tracked"] > 210
        assert summary["images"] == self.video
        assert os.path.exists(os.path.join(self.out, "map.svg"))
        # The folder stands for the map in it.
        assert must_run("info", self.out).out == must_run("info", os.path.join(self.out, "map.oaslam")).out

    @harness.needs_detector
    def test_objects_are_mapped_by_the_default_detector(self):
        assert re.search(r"detector: yolox_nano, \d+ of 220 images looked at", self.mapped.err)
        summary = harness.read_json(os.path.join(self.out, "summary.json"))
        assert summary["objects"] >= 3
        # Not every image of a slow camera is worth a look.
        assert 30 < summary["detector"]["images"] < 150

    def test_results_are_not_overwritten_unasked(self):
        done = oaslam("run", self.video, "--to", 50)
        assert done.code == 1, done
        assert "walk.oaslam: there are results already; --force" in done.err
        copy = self.path("copy.oaslam")
        shutil.copytree(self.out, copy)
        must_run("run", self.video, "--to", 60, "--out", copy, "--force", "--detector", "none")
        assert harness.read_json(os.path.join(copy, "summary.json"))["frames"] == 60
        for force in ([], ["--force"]):  # with --images, the form for scripts, results are overwritten in any case
            must_run("run", "--images", self.video, "--to", 50, "--out", copy, *force)
            assert harness.read_json(os.path.join(copy, "summary.json"))["frames"] == 50

    def test_a_run_without_a_map_promises_none(self):
        done = must_run("run", self.video, "--to", 3, "--detector", "none", "--out", self.path("short"))
        assert "0 of 3 frames tracked, 0 keyframes, 0 landmarks, 0 objects; results in" in done.out
        assert "to look at it" not in done.out
        assert "bent map" not in done.err, done

    def test_an_interrupt_while_the_camera_is_estimated_leaves_nothing(self):
        out = self.path("interrupted")
        process = subprocess.Popen([harness.BINARY, "run", self.video, "--detector", "none", "--out", out], stderr=subprocess.PIPE, text=True)
        for line in process.stderr:
            if "estimating" in line:
                break
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 130, err
        assert "error" not in err and "camera" not in err, err
        assert not os.path.exists(out)

    def test_where_nothing_can_be_written_is_said_before_the_run(self):
        done = oaslam("run", self.video, "--out", os.path.join(self.video, "out"))
        assert done.code == 1, done
        assert "estimating" not in done.err
        assert "walk.mp4/out" in done.err

    def test_what_is_named_is_read_before_the_camera_is_estimated(self):
        noise = self.path("noise.txt")
        with open(noise, "w") as f:
            f.write("no number\n")
        with socket.create_server(("127.0.0.1", 0)) as taken:
            for options, words in ((["--detector", noise], "noise.txt"), (["--detector", "none", "--gravity", noise], "noise.txt:1"),
                                   (["--detections", noise], "noise.txt"), (["--classes", self.path("none.yaml")], "none.yaml"), (["--map-in", noise], "noise.txt"),
                                   (["--scale-object", "cup"], "--scale-object"), (["--scale-object", "cpu=1"], "cpu"), (["--groundtruth", noise], "noise.txt"),
                                   (["--scale-from", "gt"], "--groundtruth"), (["--record", self.path("walk.avi")], "walk.avi"),
                                   (["--viewer", "--port", "0", "--model", self.path("none.glb")], "none.glb"),
                                   (["--viewer", "--port", taken.getsockname()[1]], str(taken.getsockname()[1])), (["--refine-camera", "--camera", noise], "noise.txt")):
                done = oaslam("run", self.video, "--out", self.path("refused"), *options)
                assert done.code == 1, (options, done)
                assert words in done.err
                assert "estimating" not in done.err, options
                assert not os.path.exists(self.path("refused")), options

    def test_find_other_images_in_the_map(self):
        other = self.path("other.mp4")
        shutil.copy(os.path.join(harness.SAMPLE, "query_around", "video.mp4"), other)
        done = must_run("localize", "--map", self.out, other, "--to", 20)
        assert done.out.strip().splitlines()[-1] == f"to look at it: oaslam view {self.path('other.localized')} --map {self.out}"
        assert len(harness.read_tum(self.path("other.localized/poses.txt"))) > 15

    def test_detections_mean_no_detector(self):
        clip = os.path.join(harness.SAMPLE, "map_front")
        must_run("run", self.video, "--to", 60, "--camera", f"{clip}/camera.yaml", "--detections", f"{clip}/detections.json", "--out", self.path("given"))
        assert "detector" not in harness.read_json(self.path("given/summary.json"))

    @harness.needs_detector
    def test_detect(self):
        for every in ([], ["--detector", "default"]):
            must_run("detect", self.video, "--to", 3, "--out", self.path("boxes.json"), *every)
            assert len(harness.read_json(self.path("boxes.json"))) == 3

    @harness.needs_detector
    def test_detect_every(self):
        clip = os.path.join(harness.SAMPLE, "map_front")
        must_run("run", "--images", self.video, "--camera", f"{clip}/camera.yaml", "--to", 45, "--detector", "default", "--detect-every", 10,
                 "--out", self.path("tenth"))
        assert harness.read_json(self.path("tenth/summary.json"))["detector"]["images"] == 5

    def test_what_cannot_be_understood(self):
        for args, message in ((["run"], "no images given"), (["run", "--force"], "run: no images given: oaslam run PATH"), (["run", "--images", self.video], "--images needs --out"), (["detect", "--out", "x.json"], "no images given"),
                              (["run", self.video, "--images", self.video], "excludes"), (["run", self.path("no.mp4")], "no.mp4"),
                              (["run", self.video, "--out", self.path("y"), "--detect-every", 0], "--detect-every")):
            done = oaslam(*args)
            assert done.code != 0, args
            assert message in done.err, args

    def test_values_that_may_be_left_out_are_numbers(self):
        for options in (["--viewer"], ["--viewer", 0], ["--viewer=0"], ["--follow"], ["--follow", 2.5], ["--viewer", "--follow"], ["--viewer", "--port", 0], ["--viewer", 0, "--port", 0]):
            done = oaslam("run", *options, "no.mp4")
            assert done.code == 1, done
            assert "no.mp4: there is no such file" in done.err
        for bad in (["--viewer=no.mp4"], ["--viewer", 99999], ["--follow=soon"], ["--follow", -3], ["--port", 8000], ["--port=x", "--viewer"]):
            done = oaslam("run", *bad, "no.mp4")
            assert done.code > 0, done
            assert bad[0].split("=")[0] in done.err

    def test_a_camera_is_live_unless_told_otherwise(self):
        config = self.path("config.yaml")
        with open(config, "w") as f:
            f.write("runner:\n  mode: sequential\n")
        for options, is_live in (([], True), (["--config", config], False), (["--set", "runner.mode=lockstep"], False), (["--mode", "lockstep"], False)):
            done = oaslam("run", "webcam:99", "--out", self.path("camera"), *options)
            assert done.code == 1, done
            assert "webcam:99: cannot be opened" in done.err
            assert ("live: " in done.err) == is_live, done

    def test_results_are_beside_a_folder_however_it_is_named(self):
        images = self.path("images")
        subprocess.run([harness.EXTRACT, self.video, images, "0", "3"], check=True)
        os.makedirs(os.path.join(images, "a", "b"))
        for name, cwd in ((images, None), (images + "/", None), (".", images), ("..", images + "/a"), ("../..", images + "/a/b"), ("a/..", images)):
            done = must_run("run", name, "--detector", "none", "--camera", "fov:60", cwd=cwd)
            shutil.rmtree(self.path("images.oaslam"))
        done = oaslam("run", "/", "--detector", "none", "--camera", "fov:60")
        assert done.code == 1, done
        assert "error: /: there is nothing beside it: --out" in done.err

    def test_images_that_are_not_there_leave_nothing_behind(self):
        for command in (["run"], ["localize", "--map", os.path.join(self.out, "map.oaslam")]):
            done = oaslam(*command, self.path("wlak.mp4"))
            assert done.code == 1, done
            assert "wlak.mp4: there is no such file" in done.err
        static, outs = self.path("static.mp4"), (self.path("new/folder"), self.path("new/maps"))
        with open(static, "w") as f:
            f.write("no video")
        commands = [["run"], ["run", "--out", outs[0] + "/", "--map-out", outs[1] + "/x.map"], ["localize", "--map", os.path.join(self.out, "map.oaslam")]]
        if os.path.exists(harness.MODEL):  # else it says that there is no detector
            commands.append(["detect", "--out", outs[0] + "/boxes.json"])
        for command in commands:
            done = oaslam(*command, static)
            assert done.code == 1, done
            assert "static.mp4" in done.err
        assert not [name for name in os.listdir(self.folder) if name.startswith(("wlak", "static.", "new")) and name != "static.mp4"]

    def test_alone_it_says_what_it_can_do(self):
        done = oaslam()
        assert done.code == 1
        for command in ("run walk.mp4", "view walk.oaslam", "localize --map", "merge", "export", "detect"):
            assert f"oaslam {command}" in done.out
