"""SLAM on the sample's desk. Other tests start from the run and the map that this one leaves."""
import os
import shutil

import harness


def test_the_desk_is_mapped():
    shutil.rmtree(os.path.dirname(harness.DESK), ignore_errors=True)
    done = harness.oaslam("run", *harness.clip("map_front"), "--groundtruth", harness.groundtruth("map_front"), "--out", harness.DESK,
                          "--map-out", harness.DESK_MAP)
    assert done.code == 0, done
