"""Sources of images, detectors, and the other files."""
import os
import threading

import numpy
import pytest

import oaslam
from conftest import CLIP, MODELS, needs_detector


def test_images_are_not_copied_on_their_way_out():
    images = oaslam.open_images(CLIP / "video.mp4", color=True, to=3)
    assert images.size == 3
    first = images.next()
    assert first.image.shape == (480, 640, 3) and first.image.dtype == numpy.uint8 and first.name == "000000"
    assert numpy.shares_memory(first.image, first.image) and not first.image.flags.owndata
    kept = first.image
    copy = kept.copy()
    assert [image.index for image in images] == [1, 2] and images.next() is None
    del first, images
    assert (kept == copy).all()  # it keeps what it shows


def test_grey_and_colour_agree():
    grey, color = (oaslam.open_images(CLIP / "video.mp4", color=color, to=1).next().image for color in (False, True))
    assert grey.shape == (480, 640)
    weighed = color @ (0.114, 0.587, 0.299)
    assert abs(grey - weighed).max() < 3


def test_a_live_source():
    source = oaslam.open_images(CLIP / "video.mp4", to=20)
    latest = oaslam.LatestImageSource(source)
    with pytest.raises(RuntimeError, match="another"):
        source.next()
    indices = [image.index for image in latest]
    assert indices[-1] == 19 and indices == sorted(indices) and len(indices) + latest.dropped == 20


def test_a_source_is_stopped_from_another_thread(tmp_path):
    source = oaslam.open_images(tmp_path, follow_quiet_s=0)
    threading.Timer(0.3, source.stop).start()
    assert source.next() is None


def test_listed_images(tmp_path):
    for i in range(3):
        (tmp_path / f"{i}.png").write_bytes(b"")
    listed = oaslam.list_images(tmp_path, fps=10, from_=1)
    assert [image.path for image in listed] == [str(tmp_path / "1.png"), str(tmp_path / "2.png")]
    assert listed[1].timestamp == pytest.approx(0.2)
    assert oaslam.list_images(CLIP / "video.mp4") is None
    assert oaslam.open_images(tmp_path).next().image is None  # unreadable


def test_names_that_are_not_utf8(tmp_path):
    name = os.fsdecode(b"a\xff.pgm")
    (tmp_path / name).write_bytes(b"P5 16 16 255\n" + bytes(16 * 16))
    listed, = oaslam.list_images(tmp_path)
    assert os.fsencode(listed.path).endswith(b"/a\xff.pgm")
    image = oaslam.open_images(os.fsencode(tmp_path / name)).next()
    assert image.image.shape == (16, 16) and image.path == listed.path and image.name == name
    box = oaslam.Detection(7, 0.9, oaslam.Box(1, 2, 3, 4))
    table = oaslam.DetectionTable([oaslam.ImageDetections(image.name, [box])])
    assert len(table.find(name)) == 1 and table.images[0].file_name == name
    oaslam.save_trajectory(tmp_path / os.fsdecode(b"\xff.txt"), [oaslam.StampedPose(1, numpy.eye(4))])
    assert len(oaslam.load_trajectory(tmp_path / os.fsdecode(b"\xff.txt"))) == 1
    with pytest.raises(oaslam.InputError) as error:
        oaslam.load_trajectory(tmp_path / os.fsdecode(b"\xfe.txt"))
    assert os.fsdecode(b"/\xfe.txt: there is no such file") in str(error.value)
    with pytest.raises(ValueError, match="null"):
        oaslam.save_trajectory("a\0b", [])


@needs_detector
def test_detector():
    assert oaslam.find_detector_model() == oaslam.find_detector_model("yolox_nano") == str(MODELS / "yolox_nano.onnx")
    detector = oaslam.Detector.load(min_score=0.3)
    image = oaslam.open_images(CLIP / "video.mp4", color=True, from_=60, to=61).next().image
    found = detector.detect(image)
    assert found and all(0.3 < d.score <= 1 and 0 <= d.box.x1 < d.box.x2 <= 640 for d in found)
    assert detector.layout == oaslam.DetectorLayout.YOLOX and detector.input_size[0] > 0
    assert oaslam.detector_layout_from_string("yolox") == detector.layout and oaslam.network_backend_from_string("?") is None
    with pytest.raises(oaslam.InputError):
        oaslam.Detector.load(layout=oaslam.DetectorLayout.YOLOV8)


def test_a_detector_that_is_not_there():
    with pytest.raises(oaslam.InputError, match="no detector museum: museum.onnx is in none of .*, /nonexistent/oaslam/models, "):
        oaslam.Detector.load("museum")
    assert oaslam.find_detector_model("./museum.onnx") == "./museum.onnx"


def test_detections(tmp_path):
    table = oaslam.load_detections(CLIP / "detections.json")
    assert len(table.images) > 100 and table.find("000050") == [] or len(table.find("000050")) > 0
    one = oaslam.Detection(41, 0.75, oaslam.Box(1, 2, 3, 4), other_labels=[oaslam.Label(45, 0.25)])
    oaslam.save_detections(tmp_path / "boxes.json", [oaslam.ImageDetections("a.png", [one])])
    read, = oaslam.load_detections(tmp_path / "boxes.json").find("a.png")
    assert (read.category_id, read.score, read.box) == (41, 0.75, oaslam.Box(1, 2, 3, 4)) and read.other_labels == (oaslam.Label(45, 0.25),)
    assert oaslam.DetectionTable().find("a.png") == []


def test_classes(tmp_path):
    (tmp_path / "classes.yaml").write_text("names: {0: cup, 1: handle}\nparts: {handle: cup}\nmovable: [cup]\n")
    classes = oaslam.load_classes(tmp_path / "classes.yaml")
    assert classes.names == {0: "cup", 1: "handle"} and classes.relations.is_part_of(1, 0) and classes.relations.is_movable(1)
    assert classes.relations == oaslam.ClassRelations(whole_of={1: 0}, movable={0})
    assert oaslam.name_of(oaslam.coco_class_names(), 41) == "cup" and oaslam.name_of({}, 3) == "class 3"
    assert oaslam.part_of_itself({1: 2, 2: 1}) in (1, 2)


def test_cameras(tmp_path):
    camera = oaslam.load_camera(CLIP / "camera.yaml")
    (tmp_path / "copy.yaml").write_text(oaslam.camera_text(camera, "a copy"))
    again = oaslam.load_camera(tmp_path / "copy.yaml", (camera.width, camera.height))
    assert (again.fx, again.width, again.model) == (camera.fx, camera.width, oaslam.LensModel.PINHOLE)
    assert oaslam.load_camera("fov:60", (640, 480)).is_guess
    with pytest.raises(oaslam.InputError, match="^here"):
        oaslam.check_calibration(oaslam.Camera(width=640, height=480, fx=-1, fy=1, cx=0, cy=0), "here")


def test_scored_poses(tmp_path):
    pose = numpy.eye(4)
    pose[:3, 3] = 1, 2, 3
    oaslam.save_scored_poses(tmp_path / "poses.txt", [oaslam.ScoredPose(oaslam.StampedPose(4, pose), 5)])
    read, = oaslam.load_scored_poses(tmp_path / "poses.txt")
    assert (read.pose.world_from_cam == pose).all() and (read.pose.timestamp, read.score) == (4, 5)
