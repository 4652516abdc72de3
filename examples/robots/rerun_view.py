"""Shows a recording of OA-SLAM (oaslam run --record out.mcap) in Rerun: python3 rerun_view.py out.mcap

Needs `pip install rerun-sdk`. Rerun draws transforms, poses, landmarks and images of ROS 2 messages, but no markers: the
objects are seen as outlines in the image.
"""
import sys

import rerun as rr
import rerun.blueprint as rrb

IMAGE = "/oaslam/image/compressed"

rr.init("oaslam", spawn=True)
rr.send_blueprint(rrb.Blueprint(
    rrb.Horizontal(
        rrb.Spatial3DView(origin="/", name="Map"),
        rrb.Vertical(rrb.Spatial2DView(origin=IMAGE, name="Image"), rrb.TextLogView(origin="/oaslam/events", name="Events")),
        column_shares=[5, 3]),
    collapse_panels=True))
rr.log_file_from_path(sys.argv[1])
