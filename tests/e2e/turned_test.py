"""Images of a camera that is held sideways or upside down: the detector gets them upright, boxes come back in the images as they are."""
import os

import films
import harness
import numpy as np
import pytest
from harness import must_run, needs_detector

VIDEO = os.path.join(harness.SAMPLE, "map_front", "video.mp4")
# The clockwise turn that brings the images upright again, and the counterclockwise quarters that made them.
TURNS = {90: 1, 180: 2, 270: 3}


def turned_back(box, degrees, width=640, height=480):
    """A box of the turned image (x y w h), in that which stands upright, of this size."""
    x1, y1, x2, y2 = box
    corners = {90: lambda x, y: (width - y, x), 180: lambda x, y: (width - x, height - y), 270: lambda x, y: (y, height - x)}[degrees]
    a, b = corners(x1, y1), corners(x2, y2)
    return min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1])


def overlap(a, b):
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0
    area = lambda c: (c[2] - c[0]) * (c[3] - c[1])
    return width * height / (area(a) + area(b) - width * height)


@needs_detector
class TestTurned(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.images = films.read(VIDEO, 200)[::20]
        cls.upright = cls.boxes("0", lambda image: image, "--detector-turn", "0")

    @classmethod
    def boxes(cls, name, turn, *args, images=None, rate=2):
        folder = cls.path(name)
        os.makedirs(folder, exist_ok=True)
        for i, image in enumerate(cls.images if images is None else images):
            films.write(f"{folder}/{i:03}.png", turn(image)[None])
        cls.said = must_run("detect", folder, "--fps", rate, *args, "--out", cls.path(f"{name}.json")).err
        return [[(d["category_id"], d["bbox"]) for d in image["detections"] if d["detection_score"] > 0.4]
                for image in sorted(harness.read_json(cls.path(f"{name}.json")), key=lambda i: i["file_name"])]

    @pytest.mark.parametrize("degrees", TURNS)
    def test_the_better_turn_is_found(self, degrees):
        found = self.boxes(f"turned{degrees}", lambda image: np.ascontiguousarray(np.rot90(image, TURNS[degrees])))
        assert f"turned by {degrees} degrees" in self.said
        pairs = [(box, [turned_back(b, degrees) for c, b in turned if c == category])
                 for upright, turned in zip(self.upright, found) for category, box in upright]
        assert len(pairs) > 10
        assert sum(max((overlap(box, b) for b in others), default=0) > 0.8 for box, others in pairs) > 0.85 * len(pairs)

    def test_upright_images_stay(self):
        assert self.boxes("upright", lambda image: image) == self.upright
        assert "turned by" not in self.said

    def test_a_film_that_begins_upside_down_is_turned_back(self):
        images = films.read(VIDEO, 200)[::4]
        images = [np.ascontiguousarray(np.rot90(image, 2)) if i < 5 else image for i, image in enumerate(images)]
        found = self.boxes("begins", lambda image: image, images=images, rate=7.5)
        assert self.said.index("turned by 180 degrees") < self.said.index("as they are from now on")
        assert found[-20:] == self.boxes("kept", lambda image: image, "--detector-turn", "0", images=images, rate=7.5)[-20:]
