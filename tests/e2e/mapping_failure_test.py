"""run: memory runs out while the mapper works. What was mapped before is saved, and the error is said."""
import os
import re
import subprocess

import harness
import pytest
from harness import must_run, oaslam

FRAMES = 120


class TestMappingFailure:
    @pytest.fixture(autouse=True)
    def each_in_a_folder(self, tmp_path):
        self.folder, self.map = str(tmp_path), str(tmp_path / "desk.map")

    def run_with(self, allocations=None):
        """`allocations`: how many the mapper may make before memory runs out; None: any number."""
        env = dict(os.environ, LD_PRELOAD=os.environ["OASLAM_FAILING_MEMORY"], OASLAM_ALLOCATIONS_TOLD=os.path.join(self.folder, "told"))
        if allocations is not None:
            env["OASLAM_ALLOCATIONS"] = str(allocations)
        done = subprocess.run([harness.BINARY, "run", *harness.clip("map_front"), "--to", str(FRAMES), "--out", self.folder, "--map-out", self.map],
                              capture_output=True, text=True, timeout=300, env=env)
        return harness.Outcome(done.returncode, done.stdout, done.stderr)

    def counts(self):
        summary = harness.read_json(os.path.join(self.folder, "summary.json"))
        return summary["keyframes"], summary["tracked"]

    def test_what_was_mapped_before_is_saved(self):
        outcome = self.run_with()
        assert outcome.code == 0, outcome
        _, all_tracked = self.counts()
        with open(os.path.join(self.folder, "told")) as f:
            allocations = int(f.read())
        os.remove(self.map)
        outcome = self.run_with(allocations // 2)
        assert outcome.code == 2, outcome
        assert outcome.err.count("mapping has ended: std::bad_alloc") == 1, outcome
        keyframes, tracked = self.counts()
        assert keyframes >= 3, outcome
        assert tracked > 10
        assert tracked < all_tracked
        assert len(harness.read_tum(os.path.join(self.folder, "trajectory.txt"))) == tracked
        info = must_run("info", self.map)
        assert re.search(rf"keyframes +{keyframes} \(", info.out)

    def test_memory_that_is_out_from_the_start(self):
        outcome = self.run_with(0)
        assert outcome.code == 2, outcome
        assert "mapping has ended" in outcome.err
        assert oaslam("info", self.map).code == 0
