"""The interface for C, called without a compiler: by ctypes, in the library that the module uses."""
import ctypes
import pathlib
import re

import numpy
import pytest

import oaslam
from conftest import CLIP

OK, INPUT_ERROR, REFUSED = 0, 1, 3
OFFLINE = 1
Handle = ctypes.c_void_p


class Pose(ctypes.Structure):
    _fields_ = [("translation", ctypes.c_double * 3), ("rotation", ctypes.c_double * 4)]


class Camera(ctypes.Structure):
    _fields_ = [("is_fisheye", ctypes.c_int32), ("width", ctypes.c_int32), ("height", ctypes.c_int32),
                *((name, ctypes.c_double) for name in ("fx", "fy", "cx", "cy")), ("distortion", ctypes.c_double * 5)]


class Detection(ctypes.Structure):
    _fields_ = [("category_id", ctypes.c_int32), *((name, ctypes.c_double) for name in ("score", "x1", "y1", "x2", "y2"))]


class Image(ctypes.Structure):
    _fields_ = [("pixels", ctypes.c_void_p), ("width", ctypes.c_int32), ("height", ctypes.c_int32), ("channels", ctypes.c_int32),
                ("bytes_per_row", ctypes.c_size_t), ("timestamp", ctypes.c_double), ("detections", ctypes.POINTER(Detection)),
                ("detection_count", ctypes.c_size_t), ("gravity_in_cam", ctypes.POINTER(ctypes.c_double)),
                ("detections_follow", ctypes.c_int32), ("angular_velocity", ctypes.c_void_p), ("angular_velocity_count", ctypes.c_size_t),
                ("motion", ctypes.c_void_p), ("features", ctypes.c_void_p), ("imu", ctypes.c_void_p), ("imu_count", ctypes.c_size_t),
                ("depth", ctypes.c_void_p), *((name, ctypes.c_int32) for name in ("depth_is_float", "depth_width", "depth_height")),
                ("depth_bytes_per_row", ctypes.c_size_t), ("depth_unit", ctypes.c_double), ("depth_camera", ctypes.c_void_p),
                ("cam_from_depth", ctypes.c_void_p)]


class PosesOfResult(ctypes.Structure):
    _fields_ = [("has_pose", ctypes.c_int32), ("pose", Pose), ("elsewhere", Pose * 8)]


class Result(ctypes.Structure):
    _fields_ = [("frame", ctypes.c_int32), ("timestamp", ctypes.c_double), ("state", ctypes.c_int), ("source", ctypes.c_int), ("world", ctypes.c_uint32),
                ("is_uncertain", ctypes.c_int32), ("confidence", ctypes.c_double), ("seconds_without_map", ctypes.c_double), ("depth", ctypes.c_double), ("focal_ratio", ctypes.c_double),
                ("covariance", ctypes.c_double * 36), ("matched", ctypes.c_int32), ("inliers", ctypes.c_int32), ("detections", ctypes.c_int32),
                ("objects", ctypes.c_int32), ("elsewhere_count", ctypes.c_int32), ("elsewhere", ctypes.c_uint32 * 8), ("reserved", PosesOfResult)]


class AnchorRequest(ctypes.Structure):
    _fields_ = [("name", ctypes.c_char_p), ("model", ctypes.c_char_p), ("is_at_pixel", ctypes.c_int32), ("pixel", ctypes.c_double * 2),
                ("origin", ctypes.c_double * 3), ("direction", ctypes.c_double * 3),
                ("is_on_object", ctypes.c_int32), ("object", ctypes.c_uint32), ("size", ctypes.c_double), ("pose", ctypes.POINTER(Pose))]


class Object(ctypes.Structure):
    _fields_ = [("id", ctypes.c_uint32), ("category_id", ctypes.c_int32), ("name", ctypes.c_char_p), ("center", ctypes.c_double * 3),
                ("half_axes", ctypes.c_double * 3), ("rotation", ctypes.c_double * 4), ("observations", ctypes.c_int32), ("has_moved", ctypes.c_int32)]


class Options(ctypes.Structure):
    _fields_ = [("mode", ctypes.c_int), ("prior", ctypes.POINTER(Pose)), ("camera", ctypes.POINTER(Camera)), ("unknown_camera", ctypes.c_int32),
                ("follow", ctypes.c_int32)]


class Relocalization(ctypes.Structure):
    _fields_ = [("evidence", ctypes.c_int), ("world", ctypes.c_uint32), ("world_from_cam", Pose), ("confidence", ctypes.c_double),
                ("sigma_position", ctypes.c_double), ("inlier_points", ctypes.c_int32), ("matched_objects", ctypes.c_int32), ("has_camera", ctypes.c_int32),
                ("camera", Camera)]


@pytest.fixture(scope="module")
def c():
    """The library, as this process has loaded it."""
    paths = set(re.findall(r"(/\S*liboaslam\.so\S*)", pathlib.Path("/proc/self/maps").read_text()))
    if not paths:
        pytest.skip("the module contains the library")
    library = ctypes.CDLL(paths.pop())
    library.oaslam_error.restype = ctypes.c_char_p
    library.oaslam_map_objects.restype = ctypes.POINTER(Object)
    library.oaslam_map_world.restype = ctypes.c_uint32
    return library


def image_of(image, detections=()):
    boxes = (Detection * len(detections))(*((d.category_id, d.score, d.box.x1, d.box.y1, d.box.x2, d.box.y2) for d in detections))
    height, width = image.image.shape
    return Image(image.image.ctypes.data, width, height, 1, image.image.strides[0], image.timestamp, boxes, len(boxes), None)


def test_what_an_application_does(c, desk, tmp_path):
    camera = Camera()
    assert c.oaslam_camera_load(str(CLIP / "camera.yaml").encode(), 640, 480, ctypes.byref(camera)) == OK and camera.fx == desk.camera.fx
    slam = Handle()
    assert c.oaslam_slam_create(OFFLINE, None, ctypes.byref(camera), ctypes.byref(slam)) == OK
    table = oaslam.load_detections(CLIP / "detections.json")
    result, pose = Result(), Pose()
    for image, expected in zip(desk.images, desk.results):
        assert c.oaslam_slam_process(slam, ctypes.byref(image_of(image, table.find(image.name))), ctypes.byref(result)) == OK
        assert c.oaslam_pose_in(ctypes.byref(result), result.world, ctypes.byref(pose)) == expected.has_pose
        if expected.has_pose:  # the same numbers as by the module
            assert (pose.translation == expected.pose_in(expected.world)[:3, 3]).all()
        assert (result.state, result.inliers) == (int(expected.state), -1 if expected.inliers is None else expected.inliers)
    assert c.oaslam_pose_in(ctypes.byref(result), result.world + 1, ctypes.byref(pose)) == 0
    assert numpy.allclose(numpy.reshape(result.covariance, (6, 6)), desk.results[-1].covariance)
    assert c.oaslam_slam_finish(slam) == OK

    map, count = Handle(), ctypes.c_size_t()
    assert c.oaslam_slam_map(slam, ctypes.byref(map)) == OK and c.oaslam_map_world(map) == result.world
    objects = c.oaslam_map_objects(map, ctypes.byref(count))
    expected = desk.slam.snapshot().objects()
    assert [(o.id, o.name.decode()) for o in objects[:count.value]] == [(o.id.value, o.name) for o in expected]
    c.oaslam_map_destroy(map)
    name = ctypes.create_string_buffer(65)
    request = AnchorRequest(model=b"flag", is_on_object=1, object=expected[0].id.value, origin=tuple(expected[0].ellipsoid.center - (0, 1, 0)),
                            direction=(0, 1, 0))
    assert c.oaslam_slam_place_anchor(slam, ctypes.byref(request), name) == OK and name.value == b"flag 1"
    assert c.oaslam_slam_remove_anchor(slam, b"none") == REFUSED and b"no anchor" in c.oaslam_error()
    path = str(tmp_path / "c.map").encode()
    assert c.oaslam_slam_save(slam, path) == OK
    c.oaslam_slam_destroy(slam)
    assert [anchor.name for anchor in oaslam.MapSnapshot.load(path).anchors()] == ["flag 1"]

    localizer, found = Handle(), Relocalization()
    assert c.oaslam_map_load(path, ctypes.byref(map)) == OK and c.oaslam_localizer_create(map, ctypes.byref(localizer)) == OK
    world = c.oaslam_map_world(map)
    c.oaslam_map_destroy(map)
    options = Options(mode=2, camera=ctypes.pointer(camera))
    boxes = image_of(desk.images[50], table.find(desk.images[50].name))
    boxes.pixels = None
    for looked_for in (image_of(desk.images[50]), boxes):
        assert c.oaslam_localizer_relocalize(localizer, ctypes.byref(looked_for), ctypes.byref(options), ctypes.byref(found)) == OK
        assert (found.evidence > 0 and found.world == world) or looked_for is boxes
    c.oaslam_localizer_destroy(localizer)


def test_each_function_of_a_slam_is_there(c):
    other_names = {"anchors": "map_anchors", "snapshot": "slam_map", "states": "slam_events", "gyroscope": "slam_imu"}
    for name in dir(oaslam.Slam):
        if not name.startswith("_"):
            assert hasattr(c, "oaslam_" + other_names.get(name, "slam_" + name)), name


def test_errors_are_told_and_change_nothing(c):
    camera, slam = Camera(), Handle()
    assert c.oaslam_slam_create(OFFLINE, None, ctypes.byref(camera), ctypes.byref(slam)) == INPUT_ERROR
    assert b"image width" in c.oaslam_error() and slam.value is None
    assert c.oaslam_map_load(b"/nowhere.map", ctypes.byref(slam)) == INPUT_ERROR and b"nowhere.map" in c.oaslam_error()
