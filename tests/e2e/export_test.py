"""oaslam export: each format is opened by an independent reader, and its axes, signs and pixels are checked by projecting landmarks of the map."""
import base64
import math
import os
import re
import shutil
import subprocess

import harness
import numpy as np
import pytest
from harness import must_run, oaslam, rotation
from map_reader import MapFile
from model_readers import NODE_MODULES, Scene, inverse_rotate, read_ply, run, transform, validate_gltf

SPHERE_TRIANGLES = 528


def needs(program, package):
    return pytest.mark.skipif(not shutil.which(program), reason=f"{program} is not installed (package {package})")


def project(saved, keyframe, point):
    """Projects into the ideal image, in which pixel centres are at integers."""
    k = saved.keyframes[keyframe]
    c = saved.cameras[k["camera"]]
    x, y, z = rotation(k["q"]) @ point + k["t"]
    return c["fx"] * x / z + c["cx"], c["fy"] * y / z + c["cy"]


def ideal_error_px(saved):
    return harness.rmse([math.dist(project(saved, k, saved.landmarks[l]), saved.keypoints[k][n]) for l, k, n in saved.observations])


class TestExport(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.map_file = harness.DESK_MAP
        cls.map = MapFile(cls.map_file)
        cls.seen = [(landmark, keyframe, cls.map.keypoints[keyframe][keypoint]) for landmark, keyframe, keypoint in cls.map.observations]
        cls.error_px = ideal_error_px(cls.map)
        assert len(cls.map.objects) > 10 and len(cls.map.landmarks) > 500

    def export(self, form, name, *options, path=None):
        out = os.path.join(self.folder, name)
        must_run("export", "--map", path or self.map_file, "--format", form, "--out", out, *options)
        return out

    def assert_close(self, a, b, tolerance=1e-4):
        assert math.dist(a, b) < tolerance * max(1, math.hypot(*a)), (a, b)

    def y_up(self, gltf):
        """The rotation of the node that rotates the map's frame to y up."""
        q = gltf["nodes"][0]["rotation"]
        return lambda point: rotation(q) @ point

    # ---- PLY

    def test_ply(self):
        vertices, faces = read_ply(self.export("ply", "points.ply"))
        assert (len(vertices), faces) == (len(self.map.landmarks), 0)
        for vertex, landmark in zip(vertices, self.map.landmarks.values()):
            self.assert_close(vertex[:3], landmark)
        vertices, faces = read_ply(self.export("ply", "objects.ply", "--ellipsoids"))
        assert faces == SPHERE_TRIANGLES * len(self.map.objects)

    @needs("assimp", "assimp-utils")
    def test_ply_is_read_by_assimp(self):
        self.export("ply", "objects.ply", "--ellipsoids")
        scene = Scene(os.path.join(self.folder, "objects.ply"), self.folder)
        assert sum(len(m["faces"]) for m in scene.meshes) == SPHERE_TRIANGLES * len(self.map.objects)

    # ---- glTF

    def check_scene(self, scene, to_scene):
        for i, o in self.map.objects.items():
            vertices = scene.vertices(f"{o['label']} {i}")
            center = to_scene(o["center"])
            self.assert_close(np.mean(vertices, axis=0), center, 0.05 * max(o["half_axes"]))
            # Each vertex lies on the ellipsoid: its own equation, in the frame of the map.
            axes = [to_scene(axis) for axis in rotation(o["q"]).T]
            radii = np.linalg.norm((vertices - center) @ np.transpose(axes) / o["half_axes"], axis=1)
            assert radii == pytest.approx(np.ones(len(vertices)), abs=1e-3)
        points = scene.vertices("landmarks")
        assert len(points) == len(self.map.landmarks)
        for point, landmark in zip(points, self.map.landmarks.values()):
            self.assert_close(point, to_scene(landmark))
        assert len(scene.vertices("trajectory")) > 400
        for i, k in self.map.keyframes.items():
            corners = scene.vertices(f"keyframe {i}")
            center = to_scene(-rotation(k["q"]).T @ k["t"])
            assert min(math.dist(c, center) for c in corners) < 1e-4

    @needs("assimp", "assimp-utils")
    def test_gltf_is_read_by_assimp(self):
        text, binary = self.export("gltf", "desk.gltf"), self.export("gltf", "desk.glb")
        to_scene = self.y_up(harness.read_json(text))
        for path in (text, binary):
            self.check_scene(Scene(path, self.folder), to_scene)

    def test_gltf_is_valid(self):
        if not shutil.which("node") or not os.path.isdir(NODE_MODULES):
            pytest.skip("no gltf-validator: needs node and npm ci in tests/e2e")
        for name in ("valid.gltf", "valid.glb"):
            issues = validate_gltf(self.export("gltf", name))
            assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:5]

    def test_gltf_cameras_see_what_the_detector_saw(self):
        gltf = harness.read_json(self.export("gltf", "desk.gltf"))
        nodes = {n["name"]: n for n in gltf["nodes"]}
        assert nodes["map"]["children"] == list(range(1, len(gltf["nodes"])))
        camera = gltf["cameras"][0]["perspective"]
        height, width = 480, 640
        focal_y = height / 2 / math.tan(camera["yfov"] / 2)
        focal_x = width / 2 / (math.tan(camera["yfov"] / 2) * camera["aspectRatio"])
        detections = {int(i["file_name"].split(".")[0]): i["detections"]
                      for i in harness.read_json(harness.clip("map_front")[5])}
        found = missed = 0
        for i, keyframe in self.map.keyframes.items():
            node = nodes[f"keyframe {i}"]
            for detection in detections[round(keyframe["time"] * 30)]:
                x1, y1, x2, y2 = detection["bbox"]
                mapped = [o for o in gltf["nodes"] if o.get("extras", {}).get("category_id") == detection["category_id"]]
                if not mapped or detection["detection_score"] < 0.5:
                    continue
                hit = False
                for o in mapped:
                    p = rotation(node["rotation"]).T @ np.subtract(o["translation"], node["translation"])
                    if p[2] < 0:  # a glTF camera looks along -z, with y up
                        u, v = width / 2 - focal_x * p[0] / p[2], height / 2 + focal_y * p[1] / p[2]
                        hit |= x1 < u < x2 and y1 < v < y2
                found, missed = found + hit, missed + (not hit)
        assert found > 100
        assert missed < 0.05 * found
        # Up on the desk is up in the model: the cameras of the sample are held upright and look down at it.
        to_scene = self.y_up(gltf)
        ups = [to_scene(rotation(nodes[f"keyframe {i}"]["rotation"])[:, 1])[1] for i in self.map.keyframes]
        assert min(ups) > 0.3
        truth = harness.map_alignment()
        for i, o in self.map.objects.items():  # z is up in the sample's world
            world, scene = harness.apply(truth, o["center"]), to_scene(o["center"])
            others = [(harness.apply(truth, p["center"])[2] - world[2], to_scene(p["center"])[1] - scene[1]) for p in self.map.objects.values()]
            assert all(a * b > 0 for a, b in others if abs(a) > 0.3), (i, others)

    def test_gltf_has_the_camera_as_an_animation(self):
        gltf = harness.read_json(self.export("gltf", "desk.gltf"))
        data = base64.b64decode(gltf["buffers"][0]["uri"].split(",", 1)[1])

        def numbers(accessor):
            described = gltf["accessors"][accessor]
            width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[described["type"]]
            begin = gltf["bufferViews"][described["bufferView"]]["byteOffset"]
            return np.frombuffer(data, np.float32, described["count"] * width, begin).reshape(-1, width)
        animation, = gltf["animations"]
        node = gltf["nodes"][animation["channels"][0]["target"]["node"]]
        assert node["name"] == "camera" and "camera" in node
        values = {c["target"]["path"]: animation["samplers"][c["sampler"]] for c in animation["channels"]}
        times = numbers(values["translation"]["input"])[:, 0]
        positions, rotations = numbers(values["translation"]["output"]), numbers(values["rotation"]["output"])
        trajectory = harness.read_tum(os.path.join(harness.DESK, "trajectory.txt"))
        assert len(times) == len(positions) == len(rotations) == len(trajectory)
        assert np.all(np.diff(times) > 0) and times[0] == 0
        for i, (time, position, q) in enumerate(trajectory):
            assert times[i] == pytest.approx(time - trajectory[0][0], abs=1e-4)
            assert positions[i] == pytest.approx(position, abs=1e-4)
            # It looks along -z with y up.
            assert rotation(rotations[i]) == pytest.approx(rotation(q) @ np.diag([1, -1, -1]), abs=1e-4)
            assert i == 0 or rotations[i] @ rotations[i - 1] > 0

    # ---- COLMAP

    def read_colmap(self, folder):
        def lines(name):
            with open(os.path.join(folder, name)) as f:
                return [line.rstrip("\n") for line in f if not line.startswith("#")]
        cameras = {int(f[0]): (f[1], [float(v) for v in f[4:]]) for f in map(str.split, lines("cameras.txt"))}
        views = lines("images.txt")
        images = {}
        for head, points in zip(views[::2], views[1::2]):
            f, p = head.split(), points.split()
            w, x, y, z = map(float, f[1:5])
            images[int(f[0])] = {"q": [x, y, z, w], "t": list(map(float, f[5:8])), "camera": int(f[8]), "name": " ".join(f[9:]),
                                 "points": [(float(p[i]), float(p[i + 1]), int(p[i + 2])) for i in range(0, len(p), 3)]}
        points = {int(f[0]): f[1:] for f in map(str.split, lines("points3D.txt"))}
        return cameras, images, points

    def test_colmap_projects_onto_observations(self):
        cameras, images, points = self.read_colmap(self.export("colmap", "colmap"))
        assert set(points) == {i + 1 for i in self.map.landmarks}
        assert set(images) == {i + 1 for i in self.map.keyframes}
        model, (fx, fy, cx, cy) = cameras[1]
        assert (model, cx, cy) == ("PINHOLE", 320.0, 240.0)  # 319.5, 239.5 where pixel centres are integers
        errors = []
        for image in images.values():
            for u, v, point in image["points"]:
                if point == -1:
                    continue
                x, y, z = rotation(image["q"]) @ np.array(points[point][:3], float) + image["t"]
                assert z > 0
                errors.append(math.dist((fx * x / z + cx, fy * y / z + cy), (u, v)))
        assert len(errors) == len(self.seen)
        assert harness.rmse(errors) == pytest.approx(self.error_px, abs=1e-3)
        for i, fields in points.items():
            for image, keypoint in zip(fields[7::2], fields[8::2]):
                assert images[int(image)]["points"][int(keypoint)][2] == i

    def colmap(self, *args):
        done = run("colmap", *args, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    def colmap_error_px(self, folder):
        """The initial reprojection error in COLMAP's bundle adjustment, RMS over observations."""
        out = os.path.join(self.folder, "adjusted")
        os.makedirs(out, exist_ok=True)
        log = self.colmap("bundle_adjuster", "--input_path", folder, "--output_path", out, "--BundleAdjustment.max_num_iterations", 1,
                          "--log_to_stderr", 1)
        residuals = int(re.search(r"Residuals : (\d+)", log).group(1))
        assert residuals > 1000
        # It prints the square root of the cost per residual (two a point), half the squares, in pixels.
        return 2 * float(re.search(r"Initial cost : ([\d.e-]+)", log).group(1)), residuals

    @needs("colmap", "colmap")
    def test_colmap_reads_it(self):
        folder = self.export("colmap", "colmap")
        report = self.colmap("model_analyzer", "--path", folder)
        for words, number in (("Registered images", len(self.map.keyframes)), ("Points", len(self.map.landmarks)), ("Observations", len(self.seen))):
            assert int(re.search(rf"{words}: (\d+)", report).group(1)) == number, report
        error, residuals = self.colmap_error_px(folder)
        assert residuals == 2 * len(self.seen)
        assert error == pytest.approx(self.error_px, abs=0.01)

    @needs("colmap", "colmap")
    def test_colmap_reads_distorted_cameras(self):
        """Maps of the same clip with wrong lenses: they are bent, but their key points are in pixels of the given lens."""
        fisheye = "camera_model: pinhole\n  distortion_model: equidistant\n  distortion_coeffs: [0.05, -0.02, 0.01, 0.002]"
        radial = "camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.03, 0.001, -0.002]"
        for name, lens, model in (("fisheye", fisheye, "OPENCV_FISHEYE"), ("radtan", radial, "OPENCV")):
            camera, saved = os.path.join(self.folder, name + ".yaml"), os.path.join(self.folder, name + ".map")
            with open(camera, "w") as f:
                f.write(f"cam0:\n  {lens}\n  intrinsics: [525, 525, 319.5, 239.5]\n  resolution: [640, 480]\n")
            must_run("run", *harness.clip("map_front")[:2], "--camera", camera, "--to", 150, "--out", self.folder, "--map-out", saved)
            folder = self.export("colmap", name, path=saved)
            cameras, images, points = self.read_colmap(folder)
            assert cameras[1][0] == model
            for u, v, _ in (p for image in images.values() for p in image["points"]):
                assert 0 < u < 640 and 0 < v < 480  # pixels of the distorted image, not of the ideal one
            error, _ = self.colmap_error_px(folder)
            assert error < 1.3 * ideal_error_px(MapFile(saved)) + 0.1

    # ---- Nerfstudio

    def check_nerfstudio(self, folder):
        """A reader of the documented convention: OpenGL camera axes, z up, pixel centres at +0.5."""
        scene = harness.read_json(os.path.join(folder, "transforms.json"))
        cloud, _ = read_ply(os.path.join(folder, scene["ply_file_path"]))
        points = dict(zip(self.map.landmarks, cloud))
        applied = scene["applied_transform"]
        for i, point in points.items():
            self.assert_close(point[:3], transform(applied, self.map.landmarks[i]))
        frames = dict(zip(self.map.keyframes, scene["frames"]))
        errors = []
        for landmark, keyframe, px in self.seen:
            x, y, z = inverse_rotate(frames[keyframe]["transform_matrix"], points[landmark][:3])
            assert z < 0  # in front: a camera looks along -z
            u, v = scene["cx"] - scene["fl_x"] * x / z, scene["cy"] + scene["fl_y"] * y / z
            errors.append(math.dist((u - 0.5, v - 0.5), px))
        assert harness.rmse(errors) == pytest.approx(self.error_px, abs=1e-3)
        for frame in scene["frames"]:
            turn = np.array(frame["transform_matrix"])[:3, :3]
            assert turn[2, 1] > 0.3  # the camera's y is up in a world with z up
            assert np.linalg.det(turn) == pytest.approx(1, abs=5e-7)
        return scene

    def test_nerfstudio(self):
        scene = self.check_nerfstudio(self.export("nerfstudio", "nerf"))
        assert (scene["camera_model"], scene["w"], scene["h"]) == ("OPENCV", 640, 480)
        assert scene["frames"][0]["file_path"] == f"images/{self.map.keyframes[min(self.map.keyframes)]['time']:.6f}.png"

    # ---- images

    def test_images_of_a_video_are_written(self):
        video = harness.clip("map_front")[1]
        folder = self.export("nerfstudio", "nerf_video", "--images", video)
        scene = self.check_nerfstudio(folder)
        assert len(scene["frames"]) == len(self.map.keyframes)
        for frame, keyframe in zip(scene["frames"], self.map.keyframes.values()):
            assert frame["file_path"] == f"images/{round(keyframe['time'] * 30):06d}.png"
            assert os.path.exists(os.path.join(folder, frame["file_path"]))
        cloud, _ = read_ply(os.path.join(folder, scene["ply_file_path"]))
        assert sum(max(v[3:]) - min(v[3:]) > 30 for v in cloud) > 0.1 * len(cloud)  # a desk of many colours

    def test_images_of_a_folder_are_found_by_time(self):
        frames = os.path.join(self.folder, "frames")
        subprocess.run([harness.EXTRACT, harness.clip("map_front")[1], frames, "0", "450"], check=True)
        _, images, _ = self.read_colmap(self.export("colmap", "colmap_tum", "--images", frames))
        for i, image in images.items():
            assert image["name"] == f"rgb/{round(self.map.keyframes[i - 1]['time'] * 30):06d}.png"
        scene = harness.read_json(os.path.join(self.export("nerfstudio", "nerf_tum", "--images", frames), "transforms.json"))
        for frame in scene["frames"]:
            assert os.path.exists(os.path.join(self.folder, "nerf_tum", frame["file_path"])), frame["file_path"]
        # Half of the images: keyframes without one stay out, and what fewer than two see.
        half = self.export("colmap", "colmap_half", "--images", frames, "--to", "225")
        _, images, points = self.read_colmap(half)
        assert 0 < len(images) < len(self.map.keyframes) and 0 < len(points) < len(self.map.landmarks)
        for image in images.values():
            assert {p for _, _, p in image["points"]} - {-1} <= set(points)
        if shutil.which("colmap"):
            self.colmap("model_analyzer", "--path", half)

    def test_exports_are_datasets_and_ground_truths(self):
        """Read back: as images with a camera, and as poses of images by name, in COLMAP's own layout too."""
        video = harness.clip("map_front")[1]
        nerf, colmap = self.export("nerfstudio", "back_nerf", "--images", video), self.export("colmap", "back_colmap", "--images", video)
        sparse = os.path.join(self.folder, "back_sparse")
        os.makedirs(f"{sparse}/sparse")
        shutil.copytree(f"{colmap}/images", f"{sparse}/images")
        shutil.copytree(colmap, f"{sparse}/sparse/0", ignore=shutil.ignore_patterns("images"))
        tum, count = os.path.join(harness.DESK, "trajectory.txt"), len(self.map.keyframes)
        for folder in (nerf, colmap, sparse):
            out = folder + "_out"
            done = must_run("odometry", folder, "--out", out + ".txt")
            assert f"{count} images, camera {folder}/" in done.err and f" of {count} images with a pose" in done.err, done
            # The map knows its images, the trajectory is told them, or nobody does.
            images = [] if folder == nerf else ["--images", video]
            compared = must_run("evaluate", "trajectory", self.map_file if folder == nerf else tum, folder, *images, "--align", "se3").out
            assert re.search(r"ATE position +0\.000", compared) and f"poses {count} of" in compared, compared
            outcome = oaslam("evaluate", "trajectory", tum, folder)
            assert outcome.code == 1 and folder in outcome.err and "--images" in outcome.err, outcome
        # Names that are times need no images.
        bare = self.export("colmap", "back_bare")
        compared = must_run("evaluate", "trajectory", tum, bare, "--align", "none").out
        assert re.search(r"ATE position +0\.000", compared) and f"poses {count} of" in compared, compared
        outcome = oaslam("run", "--images", bare, "--out", os.path.join(self.folder, "no"))
        assert outcome.code == 1 and bare in outcome.err, outcome

    # ---- TUM

    def test_tum(self):
        assert harness.read_bytes(self.export("tum", "desk.txt")) == harness.read_bytes(os.path.join(harness.DESK, "trajectory.txt"))

    # ---- the same again, other maps, bad input

    def test_same_bytes_again(self):
        for form, name in (("ply", "a.ply"), ("gltf", "a.glb")):
            path = self.export(form, name)
            before = harness.read_bytes(path)
            self.export(form, name)
            assert harness.read_bytes(path) == before, name

    def test_map_without_points(self):
        saved = os.path.join(self.folder, "objects.map")
        must_run("map-objects", "--trajectory", harness.groundtruth("map_front"), *harness.clip("map_front")[2:], "--out",
                 os.path.join(self.folder, "objects_out"), "--map-out", saved)
        for form, name in (("ply", "o.ply"), ("gltf", "o.glb"), ("colmap", "o_colmap"), ("nerfstudio", "o_nerf"), ("tum", "o.txt")):
            self.export(form, name, path=saved)
        if shutil.which("colmap"):
            self.colmap("model_analyzer", "--path", os.path.join(self.folder, "o_colmap"))

    def test_bad_input(self):
        out = os.path.join(self.folder, "bad")
        video = harness.clip("query_around")[1]
        noise = os.path.join(self.folder, "noise.map")
        with open(noise, "w") as f:
            f.write("not a map")
        for options, words in (
                (("--map", "/nowhere.map", "--format", "ply", "--out", out), "/nowhere.map"),
                (("--map", noise, "--format", "ply", "--out", out), "noise.map"),
                (("--map", self.map_file, "--format", "stl", "--out", out), "stl"),
                (("--map", self.map_file, "--format", "gltf", "--out", out + ".txt"), ".glb"),
                (("--map", self.map_file, "--format", "ply", "--out", out + ".obj"), ".ply"),
                (("--map", self.map_file, "--format", "ply", "--out", self.folder), "folder"),
                (("--map", self.map_file, "--format", "ply", "--out", noise + "/a.ply"), "noise.map"),
                (("--map", self.map_file, "--format", "colmap", "--out", noise), "noise.map"),
                (("--map", self.map_file, "--format", "ply", "--out", out, "--images", video), "--images"),
                (("--map", self.map_file, "--format", "tum", "--out", out, "--ellipsoids"), "--ellipsoids"),
                (("--map", self.map_file, "--format", "colmap", "--out", out, "--images", "/nowhere.mp4"), "/nowhere.mp4"),
                (("--map", self.map_file, "--format", "colmap", "--out", out, "--images", video, "--from", "1", "--fps", "0.001"), "(fps)"),
                (("--map", self.map_file, "--format", "colmap", "--out", out, "--images", "webcam:0"), "webcam"),
                (("--map", self.map_file, "--format", "ply"), "--out")):
            outcome = oaslam("export", *options)
            assert outcome.code > 0, (options, outcome)
            assert words in outcome.err + outcome.out
            assert "unexpected" not in outcome.err
