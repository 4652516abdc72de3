"""Values are pickled, copied and compared by their members."""
import copy
import inspect
import multiprocessing
import pickle

import numpy
import pytest

import oaslam
from conftest import CLIP

# What stands for more than its members: threads, files, a map.
OBJECTS = {"BackgroundDetector", "CameraEstimator", "Detector", "ImageSource", "LatestImageSource", "MapLocalizer", "MapSnapshot", "MapViewer",
           "MergedMaps", "Slam", "SlamState", "SlamStates"}


def classes(scope):
    for value in vars(scope).values():
        if inspect.isclass(value) and not issubclass(value, Exception) and not hasattr(value, "__members__"):
            yield value
            yield from classes(value)


VALUES = sorted((type_ for type_ in classes(oaslam) if type_.__qualname__ not in OBJECTS), key=lambda type_: type_.__qualname__)


def made_of(type_, state):
    value = type_.__new__(type_)
    value.__setstate__(state)
    return value


@pytest.fixture(scope="session")
def values(desk, desk_map, tmp_path_factory):
    """One of each type, with other members than a new one has."""
    folder = tmp_path_factory.mktemp("values")
    (folder / "classes.yaml").write_text("names: {3: lid, 4: box}\nparts: {lid: box}\n")
    (folder / "list.txt").write_text("0.5 a.png\n0.6 b.png\n")
    config = oaslam.SlamConfig.live()
    config.features.count, config.bundle.objects, config.tracking.min_inliers = 1234, oaslam.BundleObjects.FULL, 20
    place = oaslam.MapSnapshot.load(desk_map)
    keyframe = place.find_keyframe(oaslam.KeyframeId(int(place.keyframes()["id"][3])))
    landmark = place.find_landmark(oaslam.LandmarkId(int(place.landmarks()["id"][3])))
    found = oaslam.MapLocalizer(desk_map).relocalize(desk.images[50].image)
    detection = oaslam.Detection(7, 0.1 + 0.2, oaslam.Box(1, 2, 3, 1 / 3), (1, 2, 3, 4, 0.5), [oaslam.Label(3, 0.25)])
    images = oaslam.ImageDetections("a\udcff.png", [detection])
    detector = oaslam.BackgroundDetector(lambda image: [detection])
    detector.offer(3, desk.images[0].image)
    detector.wait()
    slam = oaslam.Slam(config, desk.camera)
    slam.load(place)
    slam.set_mapping(False)
    detections = oaslam.load_detections(CLIP / "detections.json")
    for image in desk.images[40:50]:
        slam.process(image.image, image.timestamp, detections.find(image.name))
    slam.set_mapping(True)
    presence = slam.presence()[0]
    report = slam.place_anchor(model="cube", pose=numpy.eye(4), size=1)
    anchor, event = slam.anchors()[0], slam.states().events_after(0)[0]
    slam.set_metres_per_unit(2)
    stamped = desk.slam.trajectory()[30]
    estimator = oaslam.CameraEstimator()
    for image in desk.images[:3]:
        estimator.add(image.image, image.timestamp)
    read = oaslam.load_classes(folder / "classes.yaml")
    things = place.objects()
    hits = place.cast(keyframe.world_from_cam[:3, 3], keyframe.world_from_cam[:3, 2])
    # No short film has a camera that is lost in one world and tracked in another.
    state = {**desk.results[-1].__getstate__(), "motion_unit": 0.25}
    members = ("world", "world_from_cam", "covariance", "is_uncertain", "state", "depth", "confidence")
    elsewhere = made_of(oaslam.PoseElsewhere, {**{name: state[name] for name in members}, "world": oaslam.WorldId(99)})
    result = made_of(oaslam.TrackingResult, {**state, "elsewhere": [elsewhere]})
    made = [config, config.features, config.tracking, config.mapping, config.bundle, config.objects, config.relocalization, config.runner,
            desk.camera, estimator.estimate(), found, found.candidates[0], read, read.relations, detection, detection.box, detection.other_labels[0],
            images, oaslam.DetectionTable([images]), detector.take()[0], things[0], things[0].ellipsoid, keyframe, landmark, anchor, report,
            place.estimate_scale(), hits[0], result, elsewhere, stamped, oaslam.ScoredPose(stamped, 0.5), slam.gyroscope(), slam.imu(), event,
            oaslam.list_images(folder / "list.txt")[1], desk.images[7], presence, slam.former_worlds()[0], keyframe.id, landmark.id, things[0].id, place.world]
    return {type(value): value for value in made}


def attributes(value):
    return {name: getattr(value, name) for name, member in inspect.getmembers(type(value)) if isinstance(member, property)}


def are_same(a, b):
    """Of attributes, without ==  of the values."""
    if isinstance(a, numpy.ndarray):
        return a.dtype == b.dtype and numpy.array_equal(a, b)
    if isinstance(a, (list, tuple)):
        return type(a) is type(b) and len(a) == len(b) and all(are_same(x, y) for x, y in zip(a, b))
    if type(a) in VALUES:
        return type(a) is type(b) and all(are_same(x, y) for x, y in zip(attributes(a).values(), attributes(b).values()))
    return a == b


@pytest.mark.parametrize("type_", VALUES, ids=lambda type_: type_.__qualname__)
def test_a_value_is_pickled_copied_and_compared(values, type_):
    value = values[type_]
    for other in (pickle.loads(pickle.dumps(value)), pickle.loads(pickle.dumps(value, 0)), copy.copy(value), copy.deepcopy(value)):
        assert type(other) is type_ and other == value and not other != value and are_same(other, value)
    assert value != 3 and value != None  # noqa: E711


def test_a_change_makes_a_difference(desk, values):
    camera = copy.copy(desk.camera)
    camera.fx += 1e-9
    assert camera != desk.camera
    for type_, name, other in ((oaslam.Box, "x2", 9), (oaslam.Detection, "box", oaslam.Box()), (oaslam.FeaturesConfig, "descriptor", oaslam.DescriptorKind.ORB),
                               (oaslam.Label, "score", 0.26), (oaslam.RunnerConfig, "seed", 1)):
        changed = copy.deepcopy(values[type_])
        setattr(changed, name, other)
        assert changed != values[type_] and pickle.loads(pickle.dumps(changed)) == changed
    changed = copy.deepcopy(values[oaslam.SlamConfig])
    changed.features.count += 1  # of the copy alone
    assert changed != values[oaslam.SlamConfig] and values[oaslam.SlamConfig].features.count == 1234
    assert len({str(result) for result in desk.results}) > 1 and desk.results[-1] != desk.results[-2]
    assert desk.results[:5] == copy.deepcopy(desk.results[:5])


def test_a_result_keeps_its_poses(values):
    result = values[oaslam.TrackingResult]
    other = pickle.loads(pickle.dumps(result))
    for world in (result.world, oaslam.WorldId(99)):
        assert result.pose_in(world) is not None and numpy.array_equal(result.pose_in(world), other.pose_in(world))


def test_enumerators_by_name():
    for type_ in vars(oaslam).values():
        for name, value in getattr(type_, "__members__", {}).items():
            assert pickle.loads(pickle.dumps(value)) == value == copy.deepcopy(value) and name.encode() in pickle.dumps(value)


def test_a_pickle_of_another_version_is_refused(values):
    box = oaslam.Box(1, 2, 3, 4)
    state = box.__getstate__()
    for wrong, says in (({"x1": 1, "y1": 2}, r"oaslam.Box: pickled by another version of oaslam, with the members \['x1', 'y1'\]; this one has \['x1', 'y1', 'x2', 'y2'\]"),
                        ({**state, "z": 1}, "with the members .*'z'"), ({**state, "x1": "wide"}, "oaslam.Box: .*its member x1 is 'wide'"),
                        ({}, "with the members \\[\\];")):
        with pytest.raises(ValueError, match=says):
            made_of(oaslam.Box, wrong)
    nested = values[oaslam.MapSnapshot.Object]
    for name, wrong in (("covariance", numpy.eye(6)), ("id", 3), ("ellipsoid", None)):
        with pytest.raises(ValueError, match=f"oaslam.MapSnapshot.Object: .*its member {name} is"):
            made_of(type(nested), {**nested.__getstate__(), name: wrong})
    with pytest.raises(TypeError):
        made_of(oaslam.Box, (1, 2, 3, 4))
    with pytest.raises(AttributeError, match="BIFOCAL"):
        pickle.loads(pickle.dumps(oaslam.LensModel.FISHEYE).replace(b"\x07FISHEYE", b"\x07BIFOCAL"))


def test_what_is_no_value_says_so(desk, desk_map):
    for thing in (desk.slam, oaslam.MapLocalizer(desk_map), desk.slam.states(), oaslam.BackgroundDetector(lambda image: [])):
        for call in (pickle.dumps, lambda thing: pickle.dumps(thing, 0), copy.copy, copy.deepcopy):
            with pytest.raises(TypeError, match=f"cannot pickle 'oaslam.{type(thing).__name__}' object"):
                call(thing)


def of_worker(arguments):
    camera, config, image, detections = arguments
    slam = oaslam.Slam(config, camera)
    return slam.process(image.image, image.timestamp, detections), config.features.count


def fails(path):
    oaslam.load_camera(path)


def test_values_go_to_processes_and_come_back(desk):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        config = oaslam.SlamConfig.offline()
        config.features.count = 700
        detections = [oaslam.Detection(7, 0.9, oaslam.Box(1, 2, 30, 40))]
        result, count = pool.apply(of_worker, ((desk.camera, config, desk.images[0], detections),))
        with pytest.raises(oaslam.InputError, match="none.yaml"):
            pool.apply(fails, ("none.yaml",))
    assert (result.frame, result.detections, count) == (0, 1, 700)
