"""Tracks a live camera:  live_camera.py SOURCE CAMERA PICTURE [SECONDS]

SOURCE: webcam:0, or a video that is played at its own speed. CAMERA: a calibration or fov:DEGREES. Tracking and mapping, a detector, a display and a viewer run
side by side; the display gets the newest state without a lock, the viewer is a page for browsers. What was drawn last is written to PICTURE.
Without a detector (`oaslam models get yolox_nano` fetches one) there are no objects.
"""
import sys
import threading
import time
from collections.abc import Callable

import cv2
import numpy
import numpy.typing

import oaslam

Image = numpy.typing.NDArray[numpy.uint8]


def show(states: oaslam.SlamStates, stop: threading.Event) -> None:
    """Prints a line for each state that is new when the one before is printed."""
    shown = None
    while not stop.is_set():
        state = states.wait_for_next(shown, 0.1)
        if state is not None:
            shown = state
            print(f"{state.result.frame} {state.result.state}: {state.map.keyframe_count} keyframes, {state.map.landmark_count} landmarks, "
                  f"{len(state.map.objects())} objects")


def picture_of(image: Image, points: numpy.typing.NDArray[numpy.void]) -> Image:
    picture: Image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    for x, y in points["pixel"][points["landmark"] >= 0]:
        cv2.circle(picture, (round(x), round(y)), 3, (60, 220, 60), 1, cv2.LINE_AA)
    return picture


def detect_if_here() -> Callable[[Image], list[oaslam.Detection]]:
    try:
        return oaslam.Detector.load("default").detect
    except oaslam.InputError as error:
        print(f"live_camera.py: points alone: {error}", file=sys.stderr)
        return lambda image: []


def main() -> None:
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    # For a camera, LatestImageSource would drop images that come while one is tracked.
    images = oaslam.open_images(sys.argv[1], color_if_free=True)
    first = images.next()
    if first is None or first.image is None:
        sys.exit("live_camera.py: no image")
    height, width = first.image.shape[:2]
    slam = oaslam.Slam(oaslam.SlamConfig.live(), oaslam.load_camera(sys.argv[2], (width, height)))
    boxes = oaslam.BackgroundDetector(detect_if_here())
    stop = threading.Event()
    display = threading.Thread(target=show, args=(slam.states(), stop))
    display.start()

    viewer = oaslam.MapViewer(slam, port=0, title=sys.argv[1])
    print(f"viewer: {viewer.url}", flush=True)

    start, begin = time.monotonic(), first.timestamp
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else 1e9
    picture = None
    try:
        for image in images:
            if image.image is None:
                continue
            if image.timestamp - begin >= seconds:
                break
            time.sleep(max(0, start + image.timestamp - begin - time.monotonic()))
            result = slam.process(image.image, image.timestamp, detections_follow=True)
            boxes.offer(result.frame, image.image)
            for late in boxes.take():
                slam.add_detections(late.frame, late.detections)
            viewer.show(slam, image.image, result)
            if result.has_pose:
                picture = picture_of(image.image, slam.tracked_points())
    finally:  # also after Ctrl-C, since a program ends with its last thread
        stop.set()
        display.join()
    slam.finish()
    viewer.show_map(slam)
    if picture is None:
        sys.exit("live_camera.py: nothing was tracked")
    cv2.imwrite(sys.argv[3], picture)
    print(f"{slam.snapshot().keyframe_count} keyframes in the end")


if __name__ == "__main__":
    try:
        main()
    except oaslam.InputError as error:
        sys.exit(f"live_camera.py: {error}")
