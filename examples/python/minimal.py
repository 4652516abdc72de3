"""Passes the images of a video, and boxes of a detector in this file, to the library:  minimal.py VIDEO FOCAL_LENGTH_PX [FRAMES]"""
import sys
from typing import List

import cv2
import numpy
import numpy.typing

import oaslam

Image = numpy.typing.NDArray[numpy.uint8]


def detect(bgr: Image) -> List[oaslam.Detection]:
    """Any detector can be used. This one reports every large, strongly coloured region as an object of class 0."""
    saturated = cv2.inRange(cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV), (0, 140, 60), (180, 255, 255))
    contours, _ = cv2.findContours(saturated, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    boxes = [cv2.boundingRect(contour) for contour in contours]
    return [oaslam.Detection(0, 0.9, oaslam.Box(x, y, x + w, y + h)) for x, y, w, h in boxes if w * h > 1500]


def main() -> None:
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    video = cv2.VideoCapture(sys.argv[1])
    is_read, image = video.read()
    if not is_read:
        sys.exit(__doc__)
    height, width = image.shape[:2]
    focal = float(sys.argv[2])
    camera = oaslam.Camera(width=width, height=height, fx=focal, fy=focal, cx=0.5 * (width - 1), cy=0.5 * (height - 1))
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), camera)
    frames = int(sys.argv[3]) if len(sys.argv) > 3 else 1 << 30
    i = 0
    while i < frames and is_read:
        result = slam.process(image, i / 30, detect(image))
        pose = result.pose_in(result.world)
        if pose is not None:
            x, y, z = pose[:3, 3]
            print(f"{i} {result.state} {x:.3f} {y:.3f} {z:.3f}")
        is_read, image = video.read()
        i += 1
    slam.finish()
    map = slam.snapshot()
    print(f"{map.keyframe_count} keyframes, {map.landmark_count} landmarks, {len(map.objects())} objects")


if __name__ == "__main__":
    main()
