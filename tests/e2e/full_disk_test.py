"""A disk that is full, read-only or gone: what cannot be written is named, the status is not 0, and the rest is saved."""
import os
import shutil
import subprocess

import harness
import pytest
from harness import must_run, oaslam


class TestFullDisk(harness.InFolder):
    @pytest.fixture(autouse=True)
    def each_in_a_folder(self, tmp_path):
        self.at = str(tmp_path)
        self.out = str(tmp_path / "out")

    def full(self, *names):
        """Files of the results that lie on a disk without space."""
        os.makedirs(self.out, exist_ok=True)
        for name in names:
            os.symlink("/dev/full", os.path.join(self.out, name))

    RUN = ["frames.csv", "camera.yaml", "trajectory.txt", "trajectory_live.txt", "keyframes.txt", "objects.json", "map.svg", "summary.json"]

    @pytest.mark.parametrize("name", RUN)
    def test_run_names_the_file_and_saves_the_rest(self, name):
        self.full(name)
        done = oaslam("run", *harness.clip("map_front"), "--to", 90, "--out", self.out, "--map-out", self.out + ".map")
        assert done.code == 1, done
        assert f"{name}: cannot be written: No space left on device" in done.err
        assert must_run("info", self.out + ".map")
        for other in self.RUN:
            if other != name:
                assert os.path.getsize(os.path.join(self.out, other)) > 0, other

    def test_run_names_all_of_them(self):
        self.full(*self.RUN)
        done = oaslam("run", *harness.clip("map_front"), "--to", 60, "--out", self.out, "--map-out", self.out + ".map")
        assert done.code == 1, done
        for name in self.RUN:
            assert f"{name}: cannot be written: No space left on device" in done.err
        assert must_run("info", self.out + ".map")

    LOCALIZE = ["frames.csv", "presence.json", "poses.txt", "candidates.txt", "map.svg"]

    @pytest.mark.parametrize("name", LOCALIZE)
    def test_localize(self, name):
        self.full(name)
        done = oaslam("localize", "--map", harness.DESK_MAP, *harness.clip("query_around"), "--to", 10, "--out", self.out)
        assert done.code == 1, done
        assert f"{name}: cannot be written" in done.err
        for other in self.LOCALIZE:
            if other != name:
                assert os.path.exists(os.path.join(self.out, other)), other

    def test_odometry(self):
        full = os.path.join(self.at, "t.txt")
        for options in (["--out", full, "--report", "/dev/full"], ["--out", "/dev/full", "--report", full]):
            done = oaslam("odometry", harness.clip("map_front")[1], *harness.clip("map_front")[2:4], "--to", 60, *options)
            assert done.code == 1, done
            assert "/dev/full: cannot be written" in done.err
            assert os.path.getsize(full) > 0

    def test_map_objects(self):
        self.full("objects.json")
        clip = harness.clip("map_front")
        done = oaslam("map-objects", "--trajectory", os.path.join(harness.DESK, "trajectory.txt"), *clip[2:], "--out", self.out, "--map-out", self.out + ".map")
        if "none of its poses" in done.err:
            pytest.skip("the sample's detections have no time stamps")
        assert done.code == 1, done
        assert "objects.json: cannot be written" in done.err
        assert os.path.getsize(self.out + ".map") > 0

    def test_standard_output(self):
        with open("/dev/full", "w") as full:
            for command in (["info", harness.DESK_MAP], ["--help"], ["objects", harness.DESK_MAP], ["evaluate", "trajectory", os.path.join(harness.DESK, "trajectory.txt"), harness.groundtruth("map_front")]):
                done = subprocess.run([harness.BINARY, *command], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
                assert done.returncode != 0, command
                assert "standard output: cannot be written" in done.stderr, (command, done.stderr)

    @pytest.mark.parametrize("form,name", [("ply", "m.ply"), ("gltf", "m.glb"), ("gltf", "m.gltf"), ("tum", "m.txt"), ("mcap", "m.mcap")])
    def test_exports(self, form, name):
        os.mkdir(self.out)
        os.symlink("/dev/full", os.path.join(self.out, name))
        done = oaslam("export", "--map", harness.DESK_MAP, "--format", form, "--out", os.path.join(self.out, name))
        assert done.code == 1, done
        assert f"{name}: cannot be written: No space left on device" in done.err

    @pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to mount a small disk")
    def test_a_small_disk(self):
        disk = os.path.join(self.at, "disk")
        os.mkdir(disk)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "none", disk], capture_output=True).returncode != 0:
            pytest.skip("no small disk can be mounted")
        try:
            here = os.path.join(self.at, "here")
            done = oaslam("run", *harness.clip("map_front"), "--to", 120, "--out", here, "--map-out", f"{disk}/m.map", "--record", f"{disk}/r.mp4")
            assert done.code == 1, done
            assert f"{disk}/m.map: " in done.err and f"{disk}/r.mp4: could not be written whole" in done.err
            assert harness.read_json(os.path.join(here, "summary.json"))["frames"] == 120
            assert os.listdir(disk) == []
            with pytest.raises(OSError), open(f"{disk}/fill", "wb", buffering=0) as f:
                while f.write(bytes(4096)) == 4096:
                    pass
                f.write(b"x")
            done = oaslam("run", *harness.clip("map_front"), "--to", 90, "--out", here, "--map-out", os.path.join(self.at, "m.map"), "--record", f"{disk}/r.mp4")
            assert done.code == 1, done
            assert must_run("info", os.path.join(self.at, "m.map"))
            done = oaslam("export", "--map", harness.DESK_MAP, "--format", "colmap", "--images", harness.clip("map_front")[1], "--out", f"{disk}/colmap")
            assert done.code == 1 and f"{disk}/colmap" in done.err, done
        finally:
            subprocess.run(["umount", disk], check=True)
        shutil.rmtree(disk)

    def test_a_file_that_may_not_grow(self):
        clip = harness.clip("map_front")
        done = subprocess.run(f"ulimit -f 100; exec {harness.BINARY} run --images {clip[1]} --camera {clip[3]} --to 120 --out {self.out} --map-out {self.out}.map", shell=True,
                              capture_output=True, text=True, timeout=120)
        assert done.returncode == 1, done
        assert f"{self.out}.map: " in done.stderr
        assert harness.read_json(os.path.join(self.out, "summary.json"))["frames"] == 120
        assert not os.path.exists(self.out + ".map")

    def test_a_folder_that_is_gone(self):
        process = subprocess.Popen([harness.BINARY, "run", *harness.clip("map_front"), "--out", self.out, "--map-out", os.path.join(self.at, "m.map"), "--mode", "live", "--to", "90"],
                                   stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        while process.poll() is None and not os.path.isdir(self.out):
            pass
        shutil.rmtree(self.out)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 1
        assert "summary.json: cannot be written: No such file or directory" in err
        assert must_run("info", os.path.join(self.at, "m.map"))
