"""`oaslam detect` with a real network, and a run that uses its boxes, by each library that runs networks."""
import os
import signal
import subprocess
import time

import films
import harness
import numpy as np
import pytest
from harness import must_run, oaslam
from ros_writer import Cdr, write_mcap

pytestmark = harness.needs_detector
FRAMES = 40
VIDEO = os.path.join(harness.SAMPLE, "map_front", "video.mp4")


@pytest.fixture(params=["opencv", "onnxruntime"])
def detector(request):
    if request.param == "onnxruntime" and "ONNX Runtime" not in oaslam("--version").out:
        pytest.skip("ONNX Runtime is not built in")
    return ["--detector", harness.MODEL, "--detector-backend", request.param]


class TestDetect:
    def test_detections_are_those_that_run_uses(self, tmp_path, detector):
        found = os.path.join(tmp_path, "detections.json")
        source = harness.clip("map_front")[:2] + ["--to", FRAMES]
        outcome = must_run("detect", *source, *detector, "--out", found, "--quiet")
        assert outcome.err.count("\n") < 4, outcome  # lines of its own, none of the library
        images = harness.read_json(found)
        assert [i["file_name"] for i in images] == [f"{i:06d}" for i in range(FRAMES)]
        counts = []
        for name, boxes in (("file", ["--detections", found]), ("network", detector + ["--detect-every", 1])):
            out = os.path.join(tmp_path, name)
            must_run("run", *source, *harness.clip("map_front")[2:4], *boxes, "--out", out)
            counts.append([int(f["detections"]) for f in harness.read_csv(os.path.join(out, "frames.csv"))])
        assert sum(counts[0]) > FRAMES
        assert counts[0] == counts[1]
        assert counts[0] == [len(i["detections"]) for i in images]

    def test_images_of_one_name_in_two_folders(self, tmp_path, detector):
        lines = []
        for k, folder in enumerate(("left", "right")):
            os.mkdir(tmp_path / folder)
            for i, image in enumerate(films.read(VIDEO, 30 * k + 15)[30 * k:]):
                films.write(f"{tmp_path}/{folder}/{i:03}.png", image[None])
                lines.append(f"{(30 * k + i) / 30} {folder}/{i:03}.png")
        images, found, out = (os.path.join(tmp_path, name) for name in ("images.txt", "found.json", "out"))
        with open(images, "w") as f:
            f.write("\n".join(lines))
        must_run("detect", images, *detector, "--out", found, "--to", 20)
        must_run("detect", images, *detector, "--out", found, "--resume")
        counts = {i["file_name"]: len(i["detections"]) for i in harness.read_json(found)}
        assert list(counts) == [line.split()[1] for line in lines]
        must_run("run", "--images", images, "--camera", "fov:65", "--detections", found, "--out", out)
        assert [int(f["detections"]) for f in harness.read_csv(os.path.join(out, "frames.csv"))] == list(counts.values())

    def test_images_of_a_recording(self, tmp_path, detector):
        """A topic of a recording gives the boxes of its images, with the names that `run` gives these."""
        recording, found, expected = (os.path.join(tmp_path, name) for name in ("two.mcap", "found.json", "expected.json"))
        messages = []
        for i, image in enumerate(films.read(VIDEO, 12)):
            grey = image[:, :, 1].copy()
            films.write(f"{tmp_path}/{i:06d}.png", np.repeat(grey[None, :, :, None], 3, axis=3))
            for topic, pixels in (("/left/image_raw", grey[::-1]), ("/right/image_raw", grey)):
                messages.append((i / 30, topic, "sensor_msgs/Image", Cdr(i / 30, "camera").image(pixels, "mono8")))
        write_mcap(recording, messages)
        outcome = oaslam("detect", recording, *detector, "--out", found)
        assert outcome.code == 1 and "--topic NAME chooses one: /left/image_raw" in outcome.err, outcome
        must_run("detect", recording, "--topic", "/right/image_raw", *detector, "--out", found, "--to", 5)
        must_run("detect", recording, "--topic", "/right/image_raw", *detector, "--out", found, "--resume")
        must_run("detect", tmp_path, *detector, "--out", expected)
        boxes = [i["detections"] for i in harness.read_json(expected)]
        assert sum(map(len, boxes)) > 12
        assert [i["detections"] for i in harness.read_json(found)] == boxes
        must_run("run", recording, "--topic", "/right/image_raw", *harness.clip("map_front")[2:4], "--detections", found, "--out", tmp_path / "out")
        assert [int(f["detections"]) for f in harness.read_csv(tmp_path / "out" / "frames.csv")] == [len(b) for b in boxes]

    def test_goes_on_where_it_was_interrupted(self, tmp_path, detector):
        whole, parts = os.path.join(tmp_path, "whole.json"), os.path.join(tmp_path, "parts.json")
        source = harness.clip("map_front")[:2]
        for out, options in ((whole, ["--to", 12]), (parts, ["--to", 5]), (parts, ["--to", 12, "--resume"])):
            outcome = must_run("detect", *source, *detector, "--out", out, *options)
        assert "5 images are done" in outcome.err
        assert harness.read_bytes(whole) == harness.read_bytes(parts)
        with open(parts, "w") as f:
            f.write("[{")
        outcome = oaslam("detect", *source, *detector, "--out", parts, "--resume")
        assert outcome.code == 1, outcome
        assert "parts.json" in outcome.err

    def test_interrupted_before_the_first_image(self, tmp_path, detector):
        images, out = os.path.join(tmp_path, "images"), os.path.join(tmp_path, "found.json")
        os.mkdir(images)
        command = [harness.BINARY, "detect", "--images", images, "--follow", *detector, "--out", out]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        process.stderr.readline()  # the layout of the network: all is set up
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
        assert process.returncode == 130, err
        assert "error" not in err
        assert not os.path.exists(out)

    def test_a_kill_does_not_lose_all(self, tmp_path, detector):
        out = os.path.join(tmp_path, "found.json")
        process = subprocess.Popen([harness.BINARY, "detect", *harness.clip("map_front")[:2], *detector, "--out", out, "--quiet"])
        deadline = time.time() + 300
        while process.poll() is None and not os.path.exists(out) and time.time() < deadline:
            time.sleep(0.02)
        process.kill()
        process.wait()
        assert process.returncode == -signal.SIGKILL
        assert [i["file_name"] for i in harness.read_json(out)] == [f"{i:06d}" for i in range(200)]

    def test_live_nobody_waits_for_the_detector(self, tmp_path, detector):
        source = harness.clip("map_front")[:4]
        must_run("run", *source, *detector, "--mode", "live", "--to", 150, "--out", tmp_path)
        summary = harness.read_json(os.path.join(tmp_path, "summary.json"))
        frames = harness.read_csv(os.path.join(tmp_path, "frames.csv"))
        told = summary["detector"]
        assert 0 < told["images"] <= len(frames), (told, len(frames))  # at its own pace
        assert told["rate_hz"] > 0
        seen = sum(int(f["detections"]) > 0 for f in frames)
        assert 0 < seen <= told["images"], (seen, told)
