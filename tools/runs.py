"""Shared by the programs of tools/: finds the sequences, runs the built command, and reads what it writes and prints.

Python's standard library only; the yardstick needs python3-opencv.
"""
import collections
import concurrent.futures
import csv
import hashlib
import json
import math
import multiprocessing
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DATA = os.path.abspath(os.environ.get("OASLAM_DATA", os.path.join(ROOT, "..", "shared", "data")))
SAMPLE = os.path.join(ROOT, "data", "sample")
RELEASE = os.path.join(ROOT, "build", "release")
BUILD = os.environ.get("OASLAM_BUILD", RELEASE)
OASLAM = os.path.join(RELEASE, "oaslam")
SEEDS = [(0, 2), (1, 2), (2, 1), (3, 3), (4, 4)]  # (seed, lag) of five runs; the first is the default
PROGRAM = os.path.basename(sys.argv[0])


# ---------------------------------------------------------------- sequences
def find(name):
    """The folder of a sequence: a clip of the sample, or a folder below OASLAM_DATA; None where it is absent."""
    folders = [os.path.join(parent, name) for parent in (SAMPLE, DATA, os.path.join(DATA, "desk_sample"))]
    return next((folder for folder in folders if os.path.isdir(folder)), None)


def benchmark_sequences():
    """Names for a table, and folders, of the sequences for speed and for settings, as far as they are present."""
    for title, name in (("redkitchen",) * 2, ("fr3_office_200",) * 2, ("sample map_front", "map_front"), ("sample loop", "loop")):
        if find(name):
            yield title, find(name)


def clip(folder, camera=None):
    """Arguments for the images of a sequence. `camera`: instead of the sequence's own."""
    video = os.path.join(folder, "video.mp4")
    return ["--images", video if os.path.exists(video) else folder, "--camera", camera or os.path.join(folder, "camera.yaml")]


def detections(folder, name="detections.json"):
    """Arguments for the boxes of a sequence; none where it has none."""
    path = os.path.join(folder, name)
    return ["--detections", path] if os.path.exists(path) else []


# ---------------------------------------------------------------- running
Done = collections.namedtuple("Done", "printed cpu_s peak_mb")


def call(*command, quiet=False, watch=None):
    """Runs a command; returns what it printed, its CPU seconds and its peak memory (MiB). Ends this program where the command fails.
    `quiet`: the command's own messages are shown only if it fails. `watch`: a list that gets the seconds and the memory (MiB) of the process, once a second."""
    with tempfile.TemporaryFile("w+") as messages:
        try:
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=messages if quiet else None, text=True)
        except OSError as error:
            sys.exit(f"{PROGRAM}: {command[0]}: {error.strerror}")
        if watch is not None:
            threading.Thread(target=watch_memory, args=(process.pid, watch), daemon=True).start()
        printed = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            messages.seek(0)
            sys.exit(f"{messages.read()}{PROGRAM}: failed with exit status {process.returncode}: {' '.join(command)}")
    return Done(printed, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def watch_memory(pid, samples):
    begin = time.monotonic()
    while True:
        try:
            with open(f"/proc/{pid}/status") as f:
                resident = next((line for line in f if line.startswith("VmRSS:")), None)
        except OSError:
            return
        if resident is None:  # it has ended
            return
        samples.append((time.monotonic() - begin, int(resident.split()[1]) / 1024))
        time.sleep(1)


def kept(binary, args, out, yardstick_of=None):
    """Runs the command with `--out out`, unless `out` has the results of the same command already, made by the same program.
    `yardstick_of`: a sequence whose yardstick is measured before and after, for `yardstick_in`."""
    command = [binary, *args, "--out", out, "--quiet"]
    try:
        with open(binary, "rb") as f:
            which = " ".join(command) + " " + hashlib.sha256(f.read()).hexdigest()
    except OSError as error:
        sys.exit(f"{PROGRAM}: {binary}: {error.strerror}; build it, or name another with --oaslam")
    made_by = os.path.join(out, "command.txt")
    if os.path.exists(made_by):
        with open(made_by) as f:
            if f.read() == which:
                return
        os.remove(made_by)
    os.makedirs(out, exist_ok=True)
    units = [yardstick(yardstick_of)] if yardstick_of else []
    call(*command, quiet=True)
    units += [yardstick(yardstick_of)] if yardstick_of else []
    if units:
        with open(os.path.join(out, "yardstick.json"), "w") as f:
            json.dump(None if None in units else sum(units) / 2, f)
    with open(made_by, "w") as f:
        f.write(which)


def slam(binary, folder, out, *args, camera=None, yardstick_of=None):
    """Runs SLAM on a sequence with ground truth, as `kept` does; returns summary.json."""
    command = ["run", *clip(folder, camera), *args, "--groundtruth", os.path.join(folder, "groundtruth.txt"), *detections(folder)]
    kept(binary, command, out, yardstick_of)
    return read_json(os.path.join(out, "summary.json"))


def in_child(function, *args):
    """Calls a function in its own process, since the peak memory of a command includes that of the process that starts it."""
    with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as pool:
        return pool.submit(function, *args).result()


def yardstick(folder, count=40):
    """Median CPU milliseconds of OpenCV's ORB (1000 features, one thread) on frames of the sequence: the unit for this machine at this
    minute. None without OpenCV."""
    return in_child(time_orb, folder, count)


def time_orb(folder, count):
    try:
        import cv2
    except ImportError:
        return None
    cv2.setNumThreads(1)
    orb = cv2.ORB_create(1000, 1.2, 8, 31, 0, 2, 0, 31, 20)
    video = os.path.join(folder, "video.mp4")
    if os.path.exists(video):
        capture = cv2.VideoCapture(video)
        images = [image for ok, image in (capture.read() for _ in range(count)) if ok]
    else:
        names = [row[1] for row in read_rows(os.path.join(folder, "rgb.txt"))]
        images = [cv2.imread(os.path.join(folder, n)) for n in names[:: max(len(names) // count, 1)]]
    times = []
    for image in images:
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        start = time.thread_time()
        orb.detectAndCompute(grey, None)
        times.append((time.thread_time() - start) * 1e3)
    return statistics.median(times[3:])


# ---------------------------------------------------------------- reading
def read_rows(path):
    """The columns of each line of a text file, without comments."""
    with open(path) as f:
        return [line.split() for line in f if line.strip() and line[0] != "#"]


def read_table(path):
    """A dictionary for each row of a CSV file."""
    with open(path) as f:
        return list(csv.DictReader(f))


def read_json(path):
    with open(path) as f:
        return json.load(f)


def yardstick_in(out):
    """The yardstick that `kept` measured; None where it did not."""
    return read_json(os.path.join(out, "yardstick.json"))


def calibration(path):
    """A ROS camera_info file before, in and after the nine numbers of its camera matrix."""
    with open(path) as f:
        head, numbers, tail = re.fullmatch(r"(.*camera_matrix:.*?data:\s*\[)([^\]]*)(\].*)", f.read(), re.S).groups()
    return head, [float(v) for v in numbers.split(",")], tail


def focal_length_off(summary, camera):
    """The larger relative error of fx and fy of a run, against the calibration in the file `camera`."""
    _, k, _ = calibration(camera)
    return max(abs(summary["camera"][name] / k[i] - 1) for name, i in (("fx", 0), ("fy", 4)))


def ate(binary, trajectory, groundtruth):
    """The absolute trajectory error (m) after Sim(3), by `oaslam evaluate trajectory`; None of fewer than three poses."""
    if len(read_rows(trajectory)) < 3:
        return None
    return float(re.search(r"ATE position\s+(\S+)", call(binary, "evaluate", "trajectory", trajectory, groundtruth).printed).group(1))


Relocalization = collections.namedtuple("Relocalization", "answered false median_cm recall precision")


def relocalization_figures(printed):
    """What `oaslam evaluate relocalization` printed, for each name. Shares are of 1; recall and precision are by the distance in cm."""
    found = {}
    pattern = r"^(\S.*): \d+ frames, (\S+) % answered, (\S+) % false, median (\S+) cm.*\n *within(.*)\n *recall(.*)\n *precision(.*)"
    for name, answered, false, median, distances, *shares in re.findall(pattern, printed, re.M):
        distances = [int(v) for v in distances.replace("cm", "").split()]
        recall, precision = (dict(zip(distances, (float(v) / 100 for v in row.replace("%", "").split()))) for row in shares)
        found[name] = Relocalization(float(answered) / 100, float(false) / 100, float(median), recall, precision)
    return found


# ---------------------------------------------------------------- writing
def write_gravity(truth, path, sigma_deg=1.5):
    """The direction of gravity in the camera's frame at true poses whose z axis is up, with normal noise. The noise stays the same for a second, since
    `localize` averages what a sensor says within a tenth."""
    noise, held_since = random.Random(0), -math.inf
    with open(path, "w") as out:
        for t, *_, x, y, z, w in ([float(v) for v in row[:8]] for row in read_rows(truth)):
            if t - held_since >= 1:
                error, held_since = [noise.gauss(0, math.radians(sigma_deg)) for _ in range(3)], t
            down = 2 * (w * y - x * z), -2 * (y * z + w * x), 2 * (x * x + y * y) - 1  # R^T (0, 0, -1)
            out.write(f"{t:.6f} " + " ".join(f"{d + e:.6f}" for d, e in zip(down, error)) + "\n")
    return path


# ---------------------------------------------------------------- showing
def shown(value, digits):
    return "-" if value is None else f"{value:.{digits}f}".replace("0.", ".", 1) if value < 1 else f"{value:.{digits}f}"


def median_and_worst(values, high_is_good, digits):
    known = [v for v in values if v is not None]
    worst = None if len(known) < len(values) else min(known) if high_is_good else max(known)
    return f"{shown(statistics.median(known) if known else None, digits)}, {shown(worst, digits)}"
