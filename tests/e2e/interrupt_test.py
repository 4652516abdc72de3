"""What ends a command leaves its results and no half written file: Ctrl-C, TERM, HUP, once and again."""
import glob
import os
import signal
import subprocess
import time

import harness
import pytest
from harness import must_run, oaslam

FRAMES = 200


class TestInterrupt(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.frames = cls.path("frames")
        subprocess.run([harness.EXTRACT, harness.clip("map_front")[1], cls.frames, "0", str(FRAMES)], check=True)
        cls.names = sorted(os.listdir(os.path.join(cls.frames, "rgb")))
        cls.camera = harness.clip("map_front")[3]

    @pytest.fixture(autouse=True)
    def each_in_a_folder(self, tmp_path):
        self.at = str(tmp_path)

    def list_with_gap(self, before, gap, step=1 / 30):
        """The images, a step apart in seconds, with a gap of so many seconds after the first ones."""
        path = os.path.join(self.at, "list.txt")
        with open(path, "w") as f:
            for i, name in enumerate(self.names):
                f.write(f"{i * step + (gap if i >= before else 0):.4f} {os.path.join(self.frames, 'rgb', name)}\n")
        return path

    def start(self, *command, **options):
        return subprocess.Popen([harness.BINARY, *map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.at, **options)

    def end(self, process, *signals, within, after):
        time.sleep(after)
        assert process.poll() is None, process.communicate()
        begin = time.monotonic()
        for which in signals:
            process.send_signal(which)
            time.sleep(0.01)
        _, err = process.communicate(timeout=60)
        assert time.monotonic() - begin < within, err
        assert not glob.glob(os.path.join(self.at, "**", "*tmp*"), recursive=True)
        return process.returncode, err

    def has_results(self, out):
        info = must_run("info", os.path.join(self.at, out + ".map")).out
        assert "landmarks" in info, info
        summary = harness.read_json(os.path.join(self.at, out, "summary.json"))
        assert summary["interrupted"] is True and summary["keyframes"] > 1
        return summary

    @pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
    def test_a_signal_saves_what_there_is(self, which):
        process = self.start("run", *harness.clip("map_front"), "--mode", "live", "--out", "o", "--map-out", "o.map", "--record", "o.mp4")
        code, err = self.end(process, which, within=20, after=3)
        assert code == 130, err
        self.has_results("o")
        assert os.path.getsize(os.path.join(self.at, "o.mp4")) > 1000

    @pytest.mark.parametrize("signals", [[signal.SIGINT] * 2, [signal.SIGHUP] * 3, [signal.SIGTERM, signal.SIGHUP]])
    def test_further_signals_still_leave_it(self, signals):
        process = self.start("run", *harness.clip("map_front"), "--mode", "live", "--out", "o", "--map-out", "o.map", "--record", "o.mp4")
        code, err = self.end(process, *signals, within=10, after=3)
        assert code == 130, err
        self.has_results("o")

    def test_a_gap_in_a_live_film_does_not_hold_it(self):
        process = self.start("run", "--images", self.list_with_gap(120, 3600), "--camera", self.camera, "--mode", "live", "--out", "o", "--map-out", "o.map")
        _, err = process.communicate(timeout=60)
        assert process.returncode == 0, err
        assert int(harness.read_csv(os.path.join(self.at, "o", "frames.csv"))[-1]["frame"]) == FRAMES - 1

    def test_a_wait_ends_within_a_second(self):
        images = self.list_with_gap(FRAMES, 0, step=1.9)  # it waits nearly all the time
        process = self.start("run", "--images", images, "--camera", self.camera, "--mode", "live", "--out", "o")
        code, err = self.end(process, signal.SIGTERM, within=1, after=3)
        assert code == 130, err
        assert 1 <= harness.read_json(os.path.join(self.at, "o", "summary.json"))["frames"] <= 3

    @pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
    def test_before_there_is_anything_it_ends_at_once(self, which):
        os.mkdir(os.path.join(self.at, "images"))
        for command in (["run", "--images", "images", "--follow", "--camera", self.camera, "--out", "a/b"], ["run", "--images", harness.clip("map_front")[1], "--out", "a/b"],
                        ["detect", "images", "--follow", "--detector", harness.MODEL, "--out", "a/b.json"]):
            if command[0] == "detect" and not os.path.exists(harness.MODEL):
                continue
            code, err = self.end(self.start(*command), which, within=1, after=0.7)
            assert code == 130, err
            assert os.listdir(self.at) == ["images"], command

    @pytest.mark.parametrize("which", [signal.SIGTERM, signal.SIGHUP])
    def test_localize(self, which):
        process = self.start("localize", "--map", harness.DESK_MAP, "--images", self.list_with_gap(FRAMES, 0), "--camera", self.camera, "--out", "o", "--every-frame")
        code, err = self.end(process, which, within=5, after=1.2)
        assert code == 130, err
        assert len(harness.read_tum(os.path.join(self.at, "o", "poses.txt"))) > 0
        assert "nan" not in open(os.path.join(self.at, "o", "map.svg")).read()

    @pytest.mark.parametrize("which", [signal.SIGTERM, signal.SIGHUP])
    def test_view_ends_well(self, which):
        process = self.start("view", harness.DESK_MAP, "--port", 0)
        assert process.stdout.readline().startswith("http")
        code, err = self.end(process, which, within=2, after=0.1)
        assert code == 0, err

    @pytest.mark.parametrize("which", [signal.SIGTERM, signal.SIGHUP])
    def test_serve_ends_well(self, which):
        process = self.start("serve", "--maps", os.path.dirname(harness.DESK_MAP), "--port", 0, "--detector", "none")
        assert process.stdout.readline().startswith("http")
        code, err = self.end(process, which, within=2, after=0.1)
        assert code == 0, err

    def test_nohup(self):
        process = subprocess.Popen(["nohup", harness.BINARY, "run", *harness.clip("map_front"), "--to", "150", "--mode", "live", "--out", "o"], cwd=self.at,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(1.5)
        process.send_signal(signal.SIGHUP)
        assert process.wait(timeout=60) == 0

    def test_who_no_longer_reads_the_messages_does_not_end_it(self):
        process = self.start("run", *harness.clip("map_front"), "--to", 150, "--out", "o", "--verbose")
        process.stderr.close()
        process.stdout.close()
        assert process.wait(timeout=120) in (0, 1)
        assert harness.read_json(os.path.join(self.at, "o", "summary.json"))["frames"] == 150
