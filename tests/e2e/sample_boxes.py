"""Boxes of the sample's true ellipsoids, for tests that change what the detector sees."""
import os

import harness
import numpy as np

WIDTH, HEIGHT, FOCAL, CX, CY = 640, 480, 525.0, 319.5, 239.5


def things():
    return harness.read_json(os.path.join(harness.SAMPLE, "map_front", "objects_gt.json"))["objects"]


def project(center, axes, rotation, position, quaternion):
    """The box of an ellipsoid's outline (the dual conic of its dual quadric); None unless in front. Poses are camera to world."""
    into_camera = harness.rotation(quaternion).T
    p = into_camera @ np.subtract(center, position)
    half_axes = into_camera @ rotation * axes
    conic = half_axes @ half_axes.T - np.outer(p, p)
    if p[2] <= 0 or conic[2, 2] >= -1e-9:
        return None
    roots = np.sqrt(conic[:2, 2] ** 2 - conic.diagonal()[:2] * conic[2, 2])
    ends = [FOCAL * (conic[:2, 2] + s * roots) / conic[2, 2] + (CX + 0.5, CY + 0.5) for s in (1, -1)]  # conic[2, 2] is negative
    return [*ends[0], *ends[1]]


def area(box):
    return max(box[2] - box[0], 0) * max(box[3] - box[1], 0)


def iou(a, b):
    both = area([max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])])
    return both / (area(a) + area(b) - both)


def detect(category, box, rng, min_inside):
    """As the sample's own boxes: edges off by 3 % of the size, one in eight missed, cut at the image's border. None where missed."""
    if box is None or rng.random() < 0.12:
        return None
    size = np.sqrt(area(box))
    box = [e + rng.gauss(0, 0.03 * size) for e in box]
    cut = [min(max(box[i], 0), (WIDTH, HEIGHT)[i % 2]) for i in range(4)]
    if size < 12 or area(cut) < min_inside * area(box):
        return None
    return {"category_id": category, "detection_score": 0.8, "bbox": cut}
