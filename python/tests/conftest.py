"""What the tests share: the sample, and its first clip, mapped once."""
import os
import pathlib
import types

import pytest

import oaslam

SOURCE = pathlib.Path(os.environ["OASLAM_SOURCE_DIR"])
CLIP = SOURCE / "data" / "sample" / "map_front"
FRAMES = 100


def run(slam, images, detections):
    return [slam.process(image.image, image.timestamp, detections.find(image.name)) for image in images]


def mapped(mode=oaslam.RunnerMode.LOCKSTEP, **options):
    """The first images of the clip, mapped: slam, camera, images and results."""
    images = list(oaslam.open_images(CLIP / "video.mp4", to=FRAMES, **options))
    config = oaslam.SlamConfig()
    config.runner.mode = mode
    height, width = images[0].image.shape[:2]
    camera = oaslam.load_camera(CLIP / "camera.yaml", (width, height))
    slam = oaslam.Slam(config, camera)
    results = run(slam, images, oaslam.load_detections(CLIP / "detections.json"))
    slam.finish()
    return types.SimpleNamespace(slam=slam, camera=camera, images=images, results=results)


@pytest.fixture(scope="session")
def desk():
    return mapped()


@pytest.fixture(scope="session")
def desk_map(desk, tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "desk.map"
    desk.slam.save(path)
    return path
