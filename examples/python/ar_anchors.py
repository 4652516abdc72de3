"""Places content in the middle of an image, and draws where it is in a later one:  ar_anchors.py SOURCE CAMERA PICTURE [FRAMES]

SOURCE: a video or a folder of images. CAMERA: a calibration or fov:DEGREES.
"""
import sys
from typing import Optional, Tuple

import cv2
import numpy
import numpy.typing

import oaslam

Image = numpy.typing.NDArray[numpy.uint8]
Array = numpy.typing.NDArray[numpy.float64]
COLORS = [(60, 60, 230), (60, 200, 60), (230, 120, 40)]  # x, y (up), z


def project(camera: oaslam.Camera, world_from_cam: Array, point: Array) -> Optional[Tuple[int, int]]:
    """Pixel of a point; what is behind the camera is nowhere."""
    x, y = camera.project(world_from_cam[:3, :3].T @ (point - world_from_cam[:3, 3]))
    return (round(x), round(y)) if numpy.isfinite(x) else None


def draw(anchor: oaslam.AnchorPose, camera: oaslam.Camera, world_from_cam: Array, picture: Image) -> None:
    rotation, origin = anchor.world_from_anchor[:3, :3], anchor.world_from_anchor[:3, 3]
    at = project(camera, world_from_cam, origin)
    for axis, color in enumerate(COLORS):
        end = project(camera, world_from_cam, origin + anchor.size * rotation[:, axis])
        if at and end:
            cv2.arrowedLine(picture, at, end, color, 3, cv2.LINE_AA)


def main() -> None:
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    slam, picture = None, None
    for image in oaslam.open_images(sys.argv[1], color=True, to=int(sys.argv[4]) if len(sys.argv) > 4 else -1):
        if image.image is None:
            continue
        if slam is None:
            height, width = image.image.shape[:2]
            camera = oaslam.load_camera(sys.argv[2], (width, height))
            slam = oaslam.Slam(oaslam.SlamConfig.offline(), camera)
        result = slam.process(image.image, image.timestamp)
        pose = result.pose_in(result.world)
        if pose is None or result.state != oaslam.TrackingState.TRACKING:
            continue
        if not slam.anchors():  # where the ray of the image's middle meets the map
            placed = slam.place_anchor(name="here", model="axes", origin=pose[:3, 3], direction=pose[:3, 2])
            if not placed:
                print(f"not yet: {placed.why_not}", file=sys.stderr)
        picture = image.image.copy()
        for anchor in slam.anchors():
            draw(anchor, camera, pose, picture)
            at = project(camera, pose, anchor.world_from_anchor[:3, 3])
            if at:
                print(result.frame, *at)
    if picture is None:
        sys.exit("ar_anchors.py: nothing was tracked")
    cv2.imwrite(sys.argv[3], picture)


if __name__ == "__main__":
    try:
        main()
    except oaslam.InputError as error:
        sys.exit(f"ar_anchors.py: {error}")
