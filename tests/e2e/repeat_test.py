"""The same bytes on every run, however many processors there are."""
import os

import harness
from harness import oaslam


@harness.needs_detector
def test_the_same_with_a_detector_where_the_camera_is_lost(tmp_path):
    # On one processor the detector has fewer threads, reads less far ahead, and is slower.
    clip, processors, outs = harness.clip("lost_and_back")[:4], os.sched_getaffinity(0), (str(tmp_path / "lost"), str(tmp_path / "again"))
    for out, allowed in zip(outs, (processors, {min(processors)})):
        os.sched_setaffinity(0, allowed)
        try:
            done = oaslam("run", *clip, "--detector", "default", "--out", out, "--map-out", out + ".map")
        finally:
            os.sched_setaffinity(0, processors)
        assert done.code == 0, done
    frames, again = ([{k: v for k, v in row.items() if "ms" not in k} for row in harness.read_csv(os.path.join(out, "frames.csv"))] for out in outs)
    assert sum(f["state"] == "lost" for f in frames) > 10
    assert frames == again
    one, two = (harness.read_json(os.path.join(out, "summary.json"))["detector"]["images"] for out in outs)
    assert one == two
    for name in (".map", "/trajectory.txt", "/trajectory_live.txt", "/objects.json"):
        one, two = (harness.read_bytes(out + name) for out in outs)
        assert one == two, name
