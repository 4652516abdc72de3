"""Finds many images in a saved map, on all cores:  localize_many.py MAP SOURCE [CAMERA]

SOURCE: a folder of images, a list of them, or a video. CAMERA: a calibration or fov:DEGREES; without one, the focal length is estimated for each image.
"""
import collections
import concurrent.futures
import os
import sys
from typing import Deque, Tuple

import numpy
import numpy.typing

import oaslam

Image = numpy.typing.NDArray[numpy.uint8]


def main() -> None:
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    localizer = oaslam.MapLocalizer(sys.argv[1])

    def find(image: Image) -> oaslam.RelocalizationResult:
        if len(sys.argv) < 4:
            return localizer.relocalize(image)
        height, width = image.shape[:2]
        return localizer.relocalize(image, camera=oaslam.load_camera(sys.argv[3], (width, height)))

    def say(name: str, result: oaslam.RelocalizationResult) -> None:
        pose = result.world_from_cam
        print(name, f"not found: {result.why_not}" if pose is None else "{:.3f} {:.3f} {:.3f}".format(*pose[:3, 3]))

    # As many images at a time as there are cores, since the library lets Python go on while it works; the answers come in the order of the images.
    cores = os.cpu_count() or 1
    at_work: Deque[Tuple[str, "concurrent.futures.Future[oaslam.RelocalizationResult]"]] = collections.deque()
    with concurrent.futures.ThreadPoolExecutor(cores) as pool:
        for image in oaslam.open_images(sys.argv[2]):
            if image.image is None:
                continue
            at_work.append((image.name, pool.submit(find, image.image)))
            if len(at_work) == cores:
                name, answer = at_work.popleft()
                say(name, answer.result())
        for name, answer in at_work:
            say(name, answer.result())


if __name__ == "__main__":
    try:
        main()
    except oaslam.InputError as error:
        sys.exit(f"localize_many.py: {error}")
