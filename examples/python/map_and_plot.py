# Maps a video, plots the trajectory and the objects from above, and opens the viewer. The cells (# %%) are for an editor that runs them one by one; as a program:
#   map_and_plot.py VIDEO CAMERA FOLDER [--no-viewer]
# %% What is mapped, and where the results go.
import os
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy

import oaslam

if len(sys.argv) < 4:
    sys.exit("usage: map_and_plot.py VIDEO CAMERA FOLDER [--no-viewer]")
video, camera, folder = sys.argv[1:4]
os.makedirs(folder, exist_ok=True)
oaslam.set_log_sink(lambda level, message: print(message) if level == oaslam.LogLevel.WARNING else None)

# %% The map. A detector (`oaslam models get yolox_nano` fetches it) looks at every third image; mapping runs in parallel, with the same result every time.
detector = oaslam.Detector.load()
slam = None
for image in oaslam.open_images(video, color=True):
    if image.image is None:
        continue
    if slam is None:
        height, width = image.image.shape[:2]
        slam = oaslam.Slam(oaslam.SlamConfig.offline(), oaslam.load_camera(camera, (width, height)))
    result = slam.process(image.image, image.timestamp, detector.detect(image.image) if image.index % 3 == 0 else [])
    if result.frame % 100 == 0:
        print(f"frame {result.frame}: {result.state}")
if slam is None:
    sys.exit(f"{video}: no image")
slam.finish()
slam.save(os.path.join(folder, "map.oaslam"))
oaslam.save_trajectory(os.path.join(folder, "trajectory.txt"), slam.trajectory())
map = slam.snapshot()
print(f"{map.keyframe_count} keyframes, {map.landmark_count} landmarks, objects: {', '.join(o.name for o in map.objects())}")

# %% From above: x to the right, z (forward, of the first camera) upwards.
path = numpy.array([pose.world_from_cam[:3, 3] for pose in slam.trajectory()])
points = map.landmarks()["position"]
figure, axes = plt.subplots(figsize=(8, 8))
axes.plot(points[:, 0], points[:, 2], ",", color="0.6")
axes.plot(path[:, 0], path[:, 2], label="camera")
angles = numpy.linspace(0, 2 * numpy.pi, 60)
for thing in map.objects():
    e = thing.ellipsoid
    shadow = (e.rotation * e.half_axes)[[0, 2]]  # of the ellipsoid in the plane: the ellipse of shadow @ shadow.T
    values, vectors = numpy.linalg.eigh(shadow @ shadow.T)
    outline = vectors * numpy.sqrt(values) @ [numpy.cos(angles), numpy.sin(angles)]
    axes.plot(e.center[0] + outline[0], e.center[2] + outline[1], color="C1")
    axes.annotate(thing.name, (e.center[0], e.center[2]), ha="center", va="center", fontsize=8)
low, high = numpy.percentile(numpy.vstack([points, path])[:, [0, 2]], [2, 98], axis=0)
axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x", ylabel="z", title=os.path.basename(video))
axes.legend()
figure.savefig(os.path.join(folder, "map.png"), dpi=120)

# %% The map in space, in a browser, until Ctrl-C.
if "--no-viewer" not in sys.argv:
    subprocess.run(["oaslam", "view", os.path.join(folder, "map.oaslam")])
