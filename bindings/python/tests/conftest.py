"""What the tests share: the sample, and its first clip, mapped once."""
import os
import pathlib
import types

import pytest

import oaslam

SOURCE = pathlib.Path(os.environ["OASLAM_SOURCE_DIR"])
CLIP = SOURCE / "data" / "sample" / "map_front"
FRAMES = 100
# The detector of the tests: none is found in the folders of the user.
MODELS = pathlib.Path(os.environ.get("OASLAM_DATA", "/nonexistent")) / "models"
os.environ.update(OASLAM_MODELS=str(MODELS), XDG_DATA_HOME="/nonexistent")
needs_detector = pytest.mark.skipif(not (MODELS / "yolox_nano.onnx").exists(), reason="needs models/yolox_nano.onnx under OASLAM_DATA")


def run(slam, images, detections):
    return [slam.process(image.image, image.timestamp, detections.find(image.name)) for image in images]


def mapped(mode=oaslam.RunnerMode.LOCKSTEP, **options):
    """The first images of the clip, mapped: slam, camera, images and results."""
    images = list(oaslam.open_images(CLIP / "video.mp4", to=FRAMES, **options))
    config = oaslam.SlamConfig.offline()
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
