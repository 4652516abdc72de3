"""Depth cameras: --depth, and what is said of depths that are wrong."""
import os

import numpy as np

from harness import InFolder, must_run, oaslam, read_csv, read_tum

WIDTH, HEIGHT, FOCAL, COUNT = 320, 240, 300, 40
STEP = 0.02  # m, to the right
WALL, BOX = 3.0, 1.5  # m: each step moves them by 2 and 4 px
BOX_PX = (100, 60, 220, 180)  # left, top, right, bottom in the first image


def texture(seed, width, height):
    rng = np.random.default_rng(seed)
    return np.kron(rng.integers(20, 235, (height // 4 + 1, width // 4 + 1)), np.ones((4, 4), int))[:height, :width]


def write_pgm(path, image):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    most, kind = (255, ">u1") if image.max() < 256 and "depth" not in path else (65535, ">u2")
    with open(path, "wb") as file:
        file.write(f"P5\n{image.shape[1]} {image.shape[0]}\n{most}\n".encode() + image.astype(kind).tobytes())


def scene():
    """The images, depths and boxes of a camera that moves to the right past a wall with a box before it."""
    wall, box = texture(1, WIDTH + 2 * COUNT, HEIGHT), texture(2, WIDTH, HEIGHT)
    for i in range(COUNT):
        image, depth = wall[:, 2 * i:2 * i + WIDTH].copy(), np.full((HEIGHT, WIDTH), WALL)
        left, right = (max(0, x - 4 * i) for x in BOX_PX[::2])
        rows = slice(BOX_PX[1], BOX_PX[3])
        image[rows, left:right] = box[rows, BOX_PX[0]:BOX_PX[2]][:, BOX_PX[2] - BOX_PX[0] - (right - left):]
        depth[rows, left:right] = BOX
        yield image, depth, (left, BOX_PX[1], right, BOX_PX[3])


def folded_wall(at, texture_of_wall):
    """The image and depth of a camera at x = `at` before a wall whose distance is 2.4 to 3 m, in folds of 1.5 m."""
    x = np.linspace(-4, 10, 8000)
    z = 2.4 + 0.6 * np.abs((x / 1.5) % 2 - 1)
    columns = FOCAL * (x - at) / z + WIDTH / 2
    order = np.argsort(columns)
    depth = np.interp(np.arange(WIDTH), columns[order], z[order])
    place = np.interp(np.arange(WIDTH), columns[order], x[order])
    rows = (np.arange(HEIGHT)[:, None] - HEIGHT / 2) * depth[None, :] / 3 + HEIGHT / 2
    u = np.clip(place[None, :] * 120 + 600, 0, texture_of_wall.shape[1] - 1).astype(int).repeat(HEIGHT, 0)
    return texture_of_wall[np.clip(rows, 0, HEIGHT - 1).astype(int), u], np.tile(depth, (HEIGHT, 1))


class TestDepth(InFolder):
    @classmethod
    def prepare(cls):
        for i, (image, depth, _) in enumerate(scene()):
            write_pgm(cls.path(f"walk/rgb/{i:04d}.pgm"), image)
            write_pgm(cls.path(f"walk/depth/{i:04d}.pgm"), np.round(depth[::2, ::2] * 1000))
            write_pgm(cls.path(f"tum/depth/{i}.pgm"), np.round(depth * 5000))
        cls.camera = cls.path("camera.yaml")
        with open(cls.camera, "w", encoding="utf-8") as file:
            file.write(f"image_width: {WIDTH}\nimage_height: {HEIGHT}\ndistortion_model: plumb_bob\n"
                       f"camera_matrix: {{rows: 3, cols: 3, data: [{FOCAL}, 0, {WIDTH / 2}, 0, {FOCAL}, {HEIGHT / 2}, 0, 0, 1]}}\n"
                       "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n")
        for name, line in (("rgb", "{t:.4f} ../walk/rgb/{i:04d}.pgm\n"), ("depth", "{u:.4f} depth/{i}.pgm\n")):
            with open(cls.path(f"tum/{name}.txt"), "w", encoding="utf-8") as file:
                file.writelines(line.format(i=i, t=100 + i / 30, u=100.008 + i / 30) for i in range(COUNT))

    def odometry(self, name, images, *options):
        done = must_run("odometry", images, "--camera", self.camera, "--out", self.path(f"{name}.txt"), "--report", self.path(f"{name}.csv"), *options)
        poses = read_tum(self.path(f"{name}.txt"))
        way = np.linalg.norm(np.subtract(poses[-1][1], poses[0][1]))
        return done, way, read_csv(self.path(f"{name}.csv"))

    def test_poses_are_in_metres_from_the_first_image_on(self):
        walk = self.path("walk")
        for name, images, options in (("folder", f"{walk}/rgb", ("--depth", f"{walk}/depth")), ("list", self.path("tum"), ())):
            done, way, rows = self.odometry(name, images, *options)
            assert abs(way / (STEP * (COUNT - 1)) - 1) < 0.02, (name, way)
            assert all(row["state"] == "tracking" and float(row["metres_per_unit"]) == 1 for row in rows), name
        assert f"taken for TUM (--dataset): {COUNT} images, {COUNT} depth images" in done.err, done
        _, way, rows = self.odometry("none", self.path("tum"), "--depth", "none")
        assert rows[0]["state"] == "preliminary" and float(rows[-1]["metres_per_unit"]) == 0

    def test_a_map_is_in_metres(self):
        walk = self.path("walk")
        done = must_run("run", "--images", f"{walk}/rgb", "--camera", self.camera, "--depth", f"{walk}/depth", "--out", self.path("run"))
        poses = read_tum(self.path("run/trajectory.txt"))
        assert abs(np.linalg.norm(np.subtract(poses[-1][1], poses[0][1])) / (STEP * (len(poses) - 1)) - 1) < 0.03, done

    def test_a_saved_map_is_seen_with_depths(self):
        walk, room = self.path("walk"), self.path("room.map")
        must_run("run", "--images", f"{walk}/rgb", "--camera", self.camera, "--depth", f"{walk}/depth", "--map-out", room, "--out", self.path("saved"))
        where = {}
        for name, options in (("without", ()), ("with", ("--depth", f"{walk}/depth"))):
            must_run("localize", "--map", room, "--images", f"{walk}/rgb", "--camera", self.camera, "--every-frame", *options, "--out", self.path(name))
            poses = np.array([p[1] for p in read_tum(self.path(f"{name}/poses.txt"))])
            assert len(poses) == COUNT, (name, len(poses))
            where[name] = poses - poses[0]
        truth = STEP * np.arange(COUNT)
        off = {name: np.abs(np.linalg.norm(poses, axis=1) - truth).max() for name, poses in where.items()}
        assert off["with"] < 0.02 and (where["with"] != where["without"]).any(), off
        done = oaslam("localize", "--map", room, "--images", f"{walk}/rgb", "--every-frame", "--depth", f"{walk}/depth", "--out", self.path("auto"))
        assert "--depth: not used" in done.err, done

    def test_a_late_clock_is_named(self):
        """A camera that moves past a folded wall, with depths of three images before."""
        count, step, late = 100, 0.03, 3
        slopes = texture(3, 4000, HEIGHT)
        for i in range(count):
            image, depth = folded_wall(i * step, slopes)
            write_pgm(self.path(f"late/rgb/{i}.pgm"), image)
            if i + late < count:
                write_pgm(self.path(f"late/depth/{i + late}.pgm"), np.round(depth * 5000))
            if i < late:
                write_pgm(self.path(f"late/depth/{i}.pgm"), np.round(depth * 5000))
        for name in ("rgb", "depth"):
            with open(self.path(f"late/{name}.txt"), "w", encoding="utf-8") as file:
                file.writelines(f"{100 + i / 30:.4f} {name}/{i}.pgm\n" for i in range(count))
        done, _, rows = self.odometry("late", self.path("late"))
        assert "they fit the images of 0.10 s before better: the clock of the depth camera is late" in done.err, done
        assert float(rows[-1]["metres_per_unit"]) == 0

    def test_another_camera_is_registered(self):
        with open(self.camera, encoding="utf-8") as file, open(self.path("depth.yaml"), "w", encoding="utf-8") as out:
            out.write(file.read() + "T_cam_depth: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n")
        _, way, _ = self.odometry("registered", self.path("tum"), "--depth-camera", self.path("depth.yaml"))
        assert abs(way / (STEP * (COUNT - 1)) - 1) < 0.02, way

    def test_a_wrong_unit_is_said(self):
        done, _, rows = self.odometry("unit", self.path("tum"), "--depth-unit", "0.2")
        assert done.err.count("its unit is probably wrong (0.2 m)") == 1, done
        assert float(rows[-1]["metres_per_unit"]) == 0

    def test_what_does_not_fit_is_refused(self):
        rgb, depth = self.path("walk/rgb"), self.path("walk/depth")
        with open(self.path("bad.txt"), "w", encoding="utf-8") as file:
            file.write("1.0 depth/1.pgm\nsoon depth/2.pgm\n")
        for options, message in ((("--depth", self.path("nowhere")), "nowhere"),
                                 (("--depth", self.path("bad.txt")), 'bad.txt:2: "soon depth/2.pgm", expected'),
                                 (("--depth", rgb), "8 bits and 1 channels, expected a depth image"),
                                 (("--depth-unit", "0.001"), "--depth-unit, --depth-camera: need --depth"),
                                 (("--depth", depth, "--depth-camera", self.camera), "320")):
            done = oaslam("odometry", rgb, "--camera", self.camera, "--out", self.path("no.txt"), *options)
            assert done.code != 0 and message in done.err and len(done.err.strip().splitlines()) == 1, done
            assert not os.path.exists(self.path("no.txt"))
