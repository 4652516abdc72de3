"""What does not fit is refused, with a message that says what was expected."""
import numpy
import pytest

import oaslam

IMAGE = numpy.zeros((480, 640), numpy.uint8)
POSE = numpy.eye(4)


@pytest.fixture
def slam():
    return oaslam.Slam(oaslam.SlamConfig.offline(), oaslam.Camera(width=640, height=480, fx=500, fy=500, cx=319.5, cy=239.5))


@pytest.mark.parametrize("image, error, message", [
    ([[1]], TypeError, "NumPy array of uint8, not list"),
    (None, TypeError, "not NoneType"),
    (IMAGE.astype(float), TypeError, r"uint8, not float64 of shape \(480, 640\)"),
    (IMAGE[0], ValueError, r"\(height, width\).*uint8 of shape \(640,\)"),
    (numpy.zeros((480, 640, 2), numpy.uint8), ValueError, r"uint8 of shape \(480, 640, 2\)"),
    (IMAGE[:0], ValueError, r"shape \(0, 640\)"),
    (IMAGE[:, ::-1], ValueError, "ascontiguousarray"),
    (IMAGE[::-1], ValueError, "ascontiguousarray"),
    (numpy.zeros((480, 640, 3), numpy.uint8)[..., ::-1], ValueError, "ascontiguousarray"),
    (IMAGE.T, ValueError, "ascontiguousarray"),
    (numpy.broadcast_to(IMAGE[:1], (480, 640)), ValueError, "ascontiguousarray"),
    (IMAGE[:240], oaslam.InputError, "640x240"),
])
def test_images(slam, image, error, message):
    with pytest.raises(error, match=message):
        slam.process(image, 0)


@pytest.mark.parametrize("pose, error, message", [
    ("here", TypeError, "array of numbers, not str"),
    (POSE[:3], ValueError, r"shape \(4, 4\), not \(3, 4\)"),
    (2 * POSE, ValueError, "rotation"),
    (numpy.diag([1, 1, -1, 1]), ValueError, "rotation"),
    (numpy.full((4, 4), numpy.nan), ValueError, "not finite"),
    (POSE.T + numpy.eye(4, k=-3), ValueError, "last row"),
])
def test_poses(slam, pose, error, message):
    with pytest.raises(error, match=message):
        slam.force_relocalization(pose)


@pytest.mark.parametrize("image", [
    IMAGE[:, :, None],
    numpy.ascontiguousarray(IMAGE[:, :, None]),
    numpy.zeros((480, 640, 4), numpy.uint8)[..., :4],
    numpy.zeros((960, 700), numpy.uint8)[::2, :640],
])
def test_images_of_odd_strides_are_taken(slam, image):
    assert slam.process(image, 0).keypoints == 0


def test_an_image_of_one_row_or_column_has_any_stride(slam):
    for image in (IMAGE[:1], IMAGE[:, :1], IMAGE[:1, None, 0], IMAGE[::-1][:1], IMAGE[:, ::-1][:, :1]):
        with pytest.raises(oaslam.InputError, match=f"{image.shape[1]}x{image.shape[0]}"):
            slam.process(image, 0)


def test_what_is_looked_for_must_be_known(slam):
    with pytest.raises(TypeError):
        slam.relocalize("image")
    with pytest.raises(oaslam.InputError, match="said to be unknown"):
        slam.relocalize(IMAGE, camera=oaslam.load_camera("fov:60", (64, 48)), unknown_camera=True)
    with pytest.raises(oaslam.InputError, match="without an image"):
        slam.relocalize(unknown_camera=True)


def test_poses_of_other_types_are_taken(slam):
    slam.force_relocalization(POSE.tolist())
    slam.force_relocalization(POSE.astype(numpy.float32))
    slam.force_relocalization(numpy.asfortranarray(POSE))


@pytest.mark.parametrize("gravity, error", [((0, 1), ValueError), ((0, numpy.inf, 0), ValueError), ("down", TypeError)])
def test_vectors(slam, gravity, error):
    with pytest.raises(error, match="a vector"):
        slam.process(IMAGE, 0, gravity_in_cam=gravity)


def test_a_gyroscope(slam):
    rows = numpy.array([[0.5, 0, 1, 0], [0.51, 0, 1, 0]])
    slam.process(IMAGE, 0.5, angular_velocity=rows)
    slam.process(IMAGE, 0.6, angular_velocity=[(0.6, 0, 1, 0)])
    with pytest.raises(oaslam.InputError, match="sample 1: angular velocity: time stamp 0.500000"):
        slam.process(IMAGE, 0.7, angular_velocity=rows[::-1])
    with pytest.raises(oaslam.InputError, match="sample 0: angular velocity: 180 rad/s, allowed: 0 to 100"):
        slam.process(IMAGE, 0.7, angular_velocity=[(0.7, 0, 180, 0)])
    with pytest.raises(oaslam.InputError, match="time stamp 700.000000, allowed: at most 1 s later than the image's, 0.700000"):
        slam.process(IMAGE, 0.7, angular_velocity=[(700, 0, 1, 0)])
    with pytest.raises(TypeError):
        slam.process(IMAGE, 0.7, angular_velocity=[(0, 1, 0)])


def test_an_imu(slam):
    slam.set_imu(numpy.eye(4))
    slam.process(IMAGE, 0.5, imu=numpy.array([[0.5, 0, 1, 0, 0, -9.8, 0], [0.51, 0, 1, 0, 0, -9.8, 0]]))
    slam.process(IMAGE, 0.6, imu=[(0.6, 0, 1, 0, 0, -9.8, 0)])
    assert slam.imu().accelerometer == oaslam.AccelerometerState.UNKNOWN and slam.imu().problem == ""
    assert slam.imu().gyroscope == slam.gyroscope() and slam.imu().sigma_metre == 0
    with pytest.raises(oaslam.InputError, match="sample 0: acceleration: 5000 m/s.2, allowed: 0 to 1000"):
        slam.process(IMAGE, 0.7, imu=[(0.7, 0, 1, 0, 0, 5000, 0)])
    with pytest.raises(oaslam.InputError, match="imu and angular_velocity: give only one"):
        slam.process(IMAGE, 0.7, imu=[(0.7, 0, 1, 0, 0, -9.8, 0)], angular_velocity=[(0.7, 0, 1, 0)])
    with pytest.raises(TypeError):
        slam.process(IMAGE, 0.7, imu=[(0.7, 0, 1, 0)])
    with pytest.raises(oaslam.InputError, match="at most 10 m"):
        far = numpy.eye(4)
        far[0, 3] = 64
        slam.set_imu(far)


def test_a_depth(slam):
    height, width = IMAGE.shape[:2]
    slam.process(IMAGE, 0.5, depth=numpy.full((height // 2, width // 2), 2000, numpy.uint16))
    slam.process(IMAGE, 0.6, depth=numpy.full((height, width), 2, numpy.float32))
    with pytest.raises(oaslam.InputError, match="has another shape than the camera's"):
        slam.process(IMAGE, 0.7, depth=numpy.zeros((height, height // 2), numpy.uint16))
    with pytest.raises(oaslam.InputError, match="depth: unit 5 m, allowed: above 0 to 1"):
        slam.process(IMAGE, 0.7, depth=numpy.zeros((height, width), numpy.uint16), depth_unit=5)
    with pytest.raises(TypeError, match="uint16 or float32"):
        slam.process(IMAGE, 0.7, depth=numpy.zeros((height, width)))
    slam.relocalize(IMAGE, depth=numpy.full((height, width), 2, numpy.float32))
    with pytest.raises(oaslam.InputError, match="has another shape than the camera's"):
        slam.relocalize(IMAGE, depth=numpy.zeros((height, height // 2), numpy.uint16))


def test_input_errors(slam, tmp_path):
    assert issubclass(oaslam.InputError, ValueError) and issubclass(oaslam.MappingError, RuntimeError)
    slam.process(IMAGE, 1)
    with pytest.raises(oaslam.InputError, match="time stamp 1.0"):
        slam.process(IMAGE, 1)
    with pytest.raises(oaslam.InputError, match="detection 0"):
        slam.process(IMAGE, 2, [oaslam.Detection(0, 0.5, oaslam.Box(5, 5, 1, 1))])
    with pytest.raises(TypeError):
        slam.process(IMAGE, 2, [(0, 0.5)])
    for read in (oaslam.load_detections, oaslam.load_trajectory, oaslam.load_classes, oaslam.load_camera, oaslam.open_images, oaslam.Detector.load,
                 oaslam.MapLocalizer):
        with pytest.raises(oaslam.InputError, match="nowhere"):
            read(tmp_path / "nowhere")
    with pytest.raises(TypeError):
        oaslam.load_trajectory(5)
    with pytest.raises(oaslam.InputError, match="features.count"):
        config = oaslam.SlamConfig.offline()
        config.features.count = 1
        oaslam.Slam(config, oaslam.Camera(width=640, height=480, fx=500, fy=500, cx=319.5, cy=239.5))
    with pytest.raises(ValueError, match="at most 5"):
        oaslam.Camera(width=1, height=1, fx=1, fy=1, cx=0, cy=0, distortion=[0] * 6)


@pytest.mark.parametrize("section, name, words", [
    ("runner", "mode", oaslam.RunnerMode), ("bundle", "objects", oaslam.BundleObjects), ("relocalization", "objects", oaslam.ObjectMethod),
    ("features", "descriptor", oaslam.DescriptorKind),
])
def test_the_text_of_an_enumerator_is_its_word(section, name, words):
    for word in words.__members__.values():
        config = oaslam.SlamConfig.offline()
        oaslam.apply_setting(f"{section}.{name}={word}", config)
        assert getattr(getattr(config, section), name) == word


def test_settings():
    config = oaslam.SlamConfig.offline()
    assert config.validate() == []
    oaslam.apply_setting("runner.mode=live", config)
    assert config.runner.mode == oaslam.RunnerMode.LIVE and "mode: live" in oaslam.config_to_yaml(config)
    with pytest.raises(oaslam.InputError, match="runner.mode"):
        oaslam.apply_setting("runner.mod=live", config)
    with pytest.raises(AttributeError):
        config.runner.mod = oaslam.RunnerMode.LIVE
    with pytest.raises(TypeError):
        config.runner.mode = "live"


def test_what_would_be_lost_cannot_be_changed():
    relations = oaslam.ClassRelations(whole_of={1: 2}, movable={0})
    with pytest.raises(AttributeError):
        relations.movable.add(3)
    with pytest.raises(TypeError):
        relations.whole_of[3] = 4
    detection = oaslam.Detection(0, 0.5, oaslam.Box(0, 0, 1, 1), other_labels=[oaslam.Label(1, 0.2)])
    with pytest.raises(AttributeError):
        detection.other_labels.append(oaslam.Label(2, 0.1))
    camera = oaslam.Camera(width=1, height=1, fx=1, fy=1, cx=0, cy=0)
    with pytest.raises(TypeError):
        camera.distortion[0] = 1
    camera.distortion = (0.1, 0, 0, 0, 0)
    assert camera.has_distortion() and "0.1" in repr(camera)
