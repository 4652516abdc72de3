"""Slam and what comes out of it."""
import re
import urllib.request

import numpy
import pytest

import oaslam
from conftest import CLIP


def test_results(desk):
    last = desk.results[-1]
    assert last.state == oaslam.TrackingState.TRACKING and str(last.state) == "tracking"
    assert last.frame == len(desk.images) - 1 and last.inliers > 100 and last.objects > 0
    assert last.source == oaslam.PoseSource.MAP and last.has_pose
    pose = last.pose_in(desk.slam.snapshot().world)
    assert pose.shape == (4, 4) and pose.dtype == numpy.float64
    assert numpy.allclose(pose[:3, :3] @ pose[:3, :3].T, numpy.eye(3))
    assert desk.results[0].state == oaslam.TrackingState.PRELIMINARY


def test_map(desk):
    map = desk.slam.snapshot()
    keyframes, landmarks = map.keyframes(), map.landmarks()
    assert len(keyframes) == map.keyframe_count > 5 and len(landmarks) == map.landmark_count > 500
    assert keyframes["world_from_cam"].shape == (len(keyframes), 4, 4) and landmarks["position"].shape == (len(landmarks), 3)
    assert (numpy.diff(landmarks["id"].astype(int)) > 0).all()
    seen = map.observations(oaslam.KeyframeId(keyframes["id"][-1]))
    assert len(seen) > 50 and set(seen["landmark"]) <= set(landmarks["id"])
    # A landmark is seen where the camera projects it to.
    pose, camera = keyframes["world_from_cam"][-1], map.cameras()[keyframes["camera"][-1]]
    positions = landmarks["position"][numpy.searchsorted(landmarks["id"], seen["landmark"])]
    pixel = camera.project((positions - pose[:3, 3]) @ pose[:3, :3])
    assert numpy.median(numpy.linalg.norm(pixel - seen["pixel"], axis=1)) < 1
    descriptors = map.descriptors(oaslam.KeyframeId(keyframes["id"][-1]))
    assert descriptors.shape[1] == 32 and descriptors.dtype == numpy.uint8 and seen["keypoint"].max() < len(descriptors)
    first = oaslam.LandmarkId(landmarks["id"][0])
    assert len(map.observations(first)) == map.find_landmark(first).observations == landmarks["observations"][0]
    assert map.find_landmark(oaslam.LandmarkId(10**9)) is None and map.find_keyframe(oaslam.KeyframeId(keyframes["id"][0])).frame == keyframes["frame"][0]
    thing = map.objects()[0]
    boxes = map.observations(thing.id)
    assert 0 < len(boxes) <= thing.observations and set(boxes["keyframe"]) <= {-1, *keyframes["id"]} and boxes["keyframe"].max() >= 0 and (boxes["score"] > 0).all()
    assert thing.name in repr(thing) and map.submaps == 1
    assert thing.name and thing.covariance.shape == (7, 7) and (thing.ellipsoid.half_axes > 0).all()
    assert thing.ellipsoid.rotation.shape == (3, 3) and map.find_object(thing.id).name == thing.name
    assert not map.is_metric and oaslam.MapSnapshot().keyframe_count == 0


def test_ids(desk):
    assert oaslam.LandmarkId(7) == oaslam.LandmarkId(7) != oaslam.LandmarkId(8) and oaslam.LandmarkId(7) != oaslam.KeyframeId(7)
    assert len({oaslam.ObjectId(7), oaslam.ObjectId(7), oaslam.ObjectId(8)}) == 2
    assert (str(oaslam.ObjectId(7)), repr(oaslam.ObjectId(7)), int(oaslam.ObjectId(7))) == ("7", "ObjectId(7)", 7)
    assert sorted([oaslam.KeyframeId(2), oaslam.KeyframeId(1)])[0].value == 1
    with pytest.raises(TypeError):
        desk.slam.snapshot().find_landmark(oaslam.KeyframeId(0))


def test_map_file(desk, desk_map, tmp_path):
    map = oaslam.MapSnapshot.load(desk_map)
    assert map.keyframe_count > 5 and len(map.trajectory()) > map.keyframe_count and map.category_names()[41] == "cup"
    map.save(tmp_path / "copy.map")
    assert (oaslam.MapSnapshot.load(tmp_path / "copy.map").landmarks()["position"] == map.landmarks()["position"]).all()
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    slam.load(map)
    assert slam.snapshot().world == map.world
    found = oaslam.MapLocalizer(map).relocalize(desk.images[50].image, camera=desk.camera)
    assert found.world == map.world and found.world_from_cam is not None


def test_metres_by_the_usual_sizes_of_objects(desk):
    assert not oaslam.MapSnapshot().estimate_scale().success and "vertical" in oaslam.MapSnapshot().estimate_scale().why_not
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    detections = oaslam.load_detections(CLIP / "detections.json")
    for image, true in zip(desk.images, oaslam.load_trajectory(CLIP / "groundtruth.txt")):
        # An accelerometer tells the vertical, which so short a clip does not show.
        slam.process(image.image, image.timestamp, detections.find(image.name), gravity_in_cam=true.world_from_cam[:3, :3].T @ [0, 0, -9.81])
    slam.finish()
    estimate = slam.whole_map().estimate_scale()
    assert estimate.success and estimate.why_not == "" and estimate.objects >= estimate.classes >= 3 and 0 < estimate.relative_sigma < 0.15
    slam.set_metres_per_unit(estimate)
    map = slam.snapshot()
    assert map.is_metric and map.unit_sigma == estimate.relative_sigma
    assert abs(map.estimate_scale().metres_per_unit - 1) < 0.05
    slam.set_metres_per_unit(1.5)
    assert slam.snapshot().unit_sigma == 0


def test_camera(desk):
    pixels = numpy.array([[10.0, 20.0], [300.0, 200.0]])
    rays = desk.camera.lift(pixels)
    assert rays.shape == (2, 3) and (rays[:, 2] == 1).all()
    assert numpy.allclose(desk.camera.project(3 * rays), pixels) and numpy.allclose(desk.camera.project(rays[0]), pixels[0])
    assert numpy.isnan(desk.camera.project((0, 0, -1))).all()
    with pytest.raises(ValueError, match="3 numbers"):
        desk.camera.project((1, 2))


def test_worlds(desk, desk_map):
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    slam.set_mapping(False)
    slam.load(desk_map)
    world = slam.snapshot().world
    result = slam.process(desk.images[50].image, 0)
    assert result.pose_in(world) is not None and result.world == world
    slam.set_metres_per_unit(2)
    assert slam.snapshot().world != world
    assert slam.process(desk.images[51].image, 1).pose_in(world) is None


def test_edits_of_objects(desk, desk_map, tmp_path):
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    slam.load(desk_map)
    first, second = (object.id for object in slam.snapshot().objects()[:2])
    slam.edit_object(first, name="my mug")
    assert slam.snapshot().find_object(first).name == "my mug"
    slam.edit_object(second, remove=True)
    assert slam.snapshot().find_object(second) is None
    with pytest.raises(oaslam.InputError, match="no object"):
        slam.edit_object(second, name="gone")
    map = oaslam.MapSnapshot.load(desk_map)
    assert oaslam.edit_object(map, first, name="mine").find_object(first).name == "mine" != map.find_object(first).name


def test_maps_are_merged_and_exported(desk, desk_map, tmp_path):
    map = oaslam.MapSnapshot.load(desk_map)
    merged = oaslam.merge_maps(map, map, mode=oaslam.RelocalizationMode.POINTS)
    assert merged.map.keyframe_count > map.keyframe_count and "found" in merged.evidence
    assert oaslam.merge_maps(map, oaslam.MapSnapshot()).map is None
    oaslam.export_map(map, oaslam.MapFormat.PLY, tmp_path / "a.ply", with_ellipsoids=True)
    assert (tmp_path / "a.ply").read_bytes().startswith(b"ply") and str(oaslam.MapFormat.COLMAP) == "colmap"
    with pytest.raises(oaslam.InputError, match="glb"):
        oaslam.export_map(map, oaslam.MapFormat.GLTF, tmp_path / "a.ply")


def test_events(desk, desk_map):
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    slam.load(desk_map)
    slam.process(desk.images[50].image, 0)
    states = slam.states()
    events = states.events_after(0)
    assert [event.number for event in events] == list(range(1, len(events) + 1))
    assert events[0].kind == oaslam.SlamEventKind.WORLD and events[-1].state == oaslam.TrackingState.RELOCALIZED
    assert slam.place_anchor(name="here", model="flag", pose=numpy.eye(4))
    (placed,) = states.events_after(events[-1].number)
    assert (placed.kind, placed.anchor, str(placed.kind)) == (oaslam.SlamEventKind.ANCHOR_PLACED, "here", "anchor placed")


def test_events_of_submaps():
    """The camera is lost between two views of a bench, begins other submaps, and finds by objects where the last one is."""
    kind = oaslam.SlamEventKind
    folder = CLIP.parent / "lost_and_back"
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), oaslam.load_camera(folder / "camera.yaml"))
    table = oaslam.load_detections(folder / "detections.json")
    for image in oaslam.open_images(folder / "video.mp4", to=310):
        result = slam.process(image.image, image.timestamp, table.find(f"{image.index:06}.jpg"))
    events = [event for event in slam.states().events_after(0) if event.kind != kind.STATE]
    assert {event.kind for event in events[:-1]} == {kind.SUBMAP_BEGAN} and events[-1].kind == kind.SUBMAP_JOINED
    began, joined = events[-2:]
    assert began.submap == joined.submap and joined.world == result.world
    assert 200 < began.frame < joined.frame and began.timestamp == pytest.approx(began.frame / 30)
    assert result.pose_in(began.submap) is not None
    assert slam.former_worlds() == []
    slam.set_metres_per_unit(2)
    assert [(former.world, former.scale) for former in slam.former_worlds()] == [(result.world, 2)]


def test_process_and_relocalize_take_an_image_in_one_order():
    names = [re.findall(r"(\w+):", function.__doc__.splitlines()[0])[1:4] for function in (oaslam.Slam.process, oaslam.Slam.relocalize, oaslam.MapLocalizer.relocalize)]
    assert names == [["image", "timestamp", "detections"]] * 3


def test_configurations():
    assert oaslam.SlamConfig.live().runner.mode == oaslam.RunnerMode.LIVE
    assert oaslam.SlamConfig.offline().runner.mode == oaslam.RunnerMode.LOCKSTEP


def test_tracked_points(desk):
    points = desk.slam.tracked_points()
    found = points[points["landmark"] >= 0]
    assert len(found) == desk.results[-1].inliers and len(points) == desk.results[-1].keypoints
    assert set(found["landmark"]) <= set(desk.slam.snapshot().landmarks()["id"])
    assert numpy.isfinite(found["position"]).all()


def test_states(desk):
    states = desk.slam.states()
    newest = states.newest()
    assert newest.result.frame == desk.results[-1].frame and newest.map.keyframe_count > 5
    assert states.wait_for_next(newest, 0.01) is None
    del newest
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    states = slam.states()
    first = states.newest()
    assert first.result.frame == -1 and first.map.keyframe_count == 0 and not states.has_ended
    del slam
    assert states.has_ended and states.wait_for_next(first, 10) is None  # at once, since the Slam has gone


def test_viewer(desk):
    viewer = oaslam.MapViewer(desk.slam, port=0, title="desk")
    viewer.show(desk.slam, desk.images[-1].image, desk.results[-1])
    viewer.show_map(desk.slam)
    with urllib.request.urlopen(viewer.url, timeout=30) as page:
        assert b"</html>" in page.read()
    with pytest.raises(oaslam.InputError, match="70000"):
        oaslam.MapViewer(desk.slam, port=70000)


def test_saved_map(desk, desk_map):
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    slam.set_mapping(False)
    slam.load(desk_map)
    image = desk.images[50]
    found = slam.relocalize(image.image, mode=oaslam.RelocalizationMode.POINTS)
    assert found.evidence == oaslam.PoseEvidence.POINTS and found.candidates[0].score > 30
    true = desk.slam.trajectory()[50]
    assert true.timestamp == image.timestamp
    assert numpy.allclose(found.world_from_cam, true.world_from_cam, atol=0.02)
    near = slam.relocalize(image.image, mode=oaslam.RelocalizationMode.POINTS, prior=true.world_from_cam)
    assert near.world_from_cam is not None
    assert slam.process(image.image, 0).has_pose
    slam.reset()
    assert slam.snapshot().keyframe_count == 0
    with pytest.raises(oaslam.InputError, match="no.map"):
        slam.load("no.map")


def test_anchors(desk, desk_map):
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    slam.load(desk_map)
    thing = slam.snapshot().objects()[0]
    above = thing.ellipsoid.center - (0, 1, 0)
    placed = slam.place_anchor(name="flag", model="axes", origin=above, direction=(0, 1, 0), object=thing.id)
    assert placed.name == "flag", placed.why_not
    assert "newest image has no pose" in slam.place_anchor(model="axes", pixel=(320, 240)).why_not
    pose = numpy.eye(4)
    pose[:3, 3] = 1, 2, 3
    assert slam.place_anchor(name="here", model="axes", pose=pose, size=0.5).name == "here"
    assert [anchor.name for anchor in slam.anchors()] == ["flag", "here"]
    assert numpy.allclose(slam.anchors()[1].world_from_anchor, pose) and slam.anchors()[0].object == thing.id
    assert slam.edit_anchor("here", name="there", size=2).name == "there" and slam.anchors()[1].size == 2
    assert "no anchor" in slam.edit_anchor("here", size=2).why_not
    assert slam.remove_anchor("there") and not slam.remove_anchor("there")


def test_a_map_goes_through_bytes(desk_map):
    map = oaslam.MapSnapshot.load(desk_map)
    content = map.to_bytes()
    assert content == open(desk_map, "rb").read()
    again = oaslam.MapSnapshot.from_bytes(content)
    assert again.keyframe_count == map.keyframe_count and again.to_bytes() == content
    with pytest.raises(oaslam.InputError, match="^map: "):
        oaslam.MapSnapshot.from_bytes(content[:100])
    with pytest.raises(oaslam.InputError, match="map.*submap 7"):
        oaslam.MapSnapshot.from_bytes(content, 7)


def test_rays_meet_the_map(desk, desk_map):
    map = oaslam.MapSnapshot.load(desk_map)
    thing = map.objects()[0]
    above = thing.ellipsoid.center - (0, 1, 0)
    hits = map.cast(above, (0, 1, 0))
    assert [hit.distance for hit in hits] == sorted(hit.distance for hit in hits)
    first = next(hit for hit in hits if hit.object == thing.id)
    assert first.kind == oaslam.HitKind.OBJECT and first.distance < 1
    assert numpy.allclose(first.position, above + numpy.array((0, first.distance, 0))) and first.normal[1] < 0
    with pytest.raises(oaslam.InputError, match="direction not zero"):
        map.cast(above, (0, 0, 0))
    assert desk.slam.cast((320, 300))
    with pytest.raises(oaslam.InputError, match="not in the image"):
        desk.slam.cast((-1, 0))


def test_late_detections(desk):
    detections = oaslam.load_detections(CLIP / "detections.json")
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    seen = []
    for image in desk.images:
        result = slam.process(image.image, image.timestamp, detections_follow=True)
        seen.append(slam.add_detections(result.frame, detections.find(image.name)))
    assert seen[0] is None and seen[-1] > 0


def test_estimated_camera(desk):
    estimator = oaslam.CameraEstimator(focal_length_35mm=30)
    with pytest.raises(oaslam.InputError, match="no images"):
        estimator.estimate()
    for image in desk.images[:10]:
        estimator.add(image.image, image.timestamp)
    assert estimator.duration() == pytest.approx(0.3, abs=0.1) and not estimator.is_full()
    estimate = estimator.estimate()
    assert not estimate.is_determined and estimate.why_not
    assert oaslam.describe(estimate).startswith("focal length")
