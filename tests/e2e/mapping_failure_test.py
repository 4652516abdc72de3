"""run: memory runs out while the mapper works. What was mapped before is saved, and the error is said."""
import os
import shutil
import subprocess
import tempfile
import unittest

import harness
from harness import oaslam

FRAMES = 120


class MappingFailure(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="oaslam_failure_")
        self.map = os.path.join(self.folder, "desk.map")

    def tearDown(self):
        shutil.rmtree(self.folder)

    def run_with(self, allocations=None):
        """allocations: that the threads beside the first may have; None: any number."""
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
        self.assertEqual(outcome.code, 0, outcome)
        _, all_tracked = self.counts()
        with open(os.path.join(self.folder, "told")) as f:
            allocations = int(f.read())
        os.remove(self.map)
        outcome = self.run_with(allocations // 2)
        self.assertEqual(outcome.code, 2, outcome)
        self.assertEqual(outcome.err.count("mapping has ended: std::bad_alloc"), 1, outcome)
        keyframes, tracked = self.counts()
        self.assertGreaterEqual(keyframes, 3, outcome)
        self.assertGreater(tracked, 10)
        self.assertLess(tracked, all_tracked)
        self.assertEqual(len(harness.read_tum(os.path.join(self.folder, "trajectory.txt"))), tracked)
        info = oaslam("info", self.map)
        self.assertEqual(info.code, 0, info)
        self.assertRegex(info.out, rf"keyframes +{keyframes} \(")

    def test_memory_that_is_out_from_the_start(self):
        outcome = self.run_with(0)
        self.assertEqual(outcome.code, 2, outcome)
        self.assertIn("mapping has ended", outcome.err)
        self.assertEqual(oaslam("info", self.map).code, 0)


if __name__ == "__main__":
    unittest.main()
