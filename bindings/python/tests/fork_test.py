"""A forked child has its parent's objects, but neither their threads nor their files: it gets an error, and ends."""
import subprocess
import sys
import textwrap

import pytest

from conftest import CLIP, MODELS, needs_detector

BEGIN = f"""
import atexit, multiprocessing, os, signal, sys, threading, time, oaslam
images = list(oaslam.open_images("{CLIP}/video.mp4", to=40))
camera = oaslam.load_camera("{CLIP}/camera.yaml", (640, 480))
def mapped(config):
    slam = oaslam.Slam(config, camera)
    for image in images:
        slam.process(image.image, image.timestamp)
    return slam
def status_of(child):
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
def refused(call):
    try:
        call()
    except oaslam.ForkError as error:
        return "has to make its own" in str(error)
fork = multiprocessing.get_context("fork")
live, offline = oaslam.SlamConfig.live(), oaslam.SlamConfig.offline()
"""


def said(program, seconds=300):
    """What a program prints; the program and its children are killed where they hang."""
    ended = subprocess.run(["timeout", "--signal=KILL", str(seconds), sys.executable, "-W", "ignore", "-c", BEGIN + textwrap.dedent(program)],
                           capture_output=True, text=True)
    assert ended.returncode == 0, f"status {ended.returncode}\n{ended.stdout}\n{ended.stderr}"
    assert ended.stderr == ""
    return ended.stdout.split()


@pytest.mark.parametrize("config", ["live", "offline"])
def test_a_child_ends_with_a_slam_of_its_parent(config):
    assert said(f"""
        slam = mapped({config})
        for end, deletes in (sys.exit, False), (sys.exit, True), (os._exit, True):
            child = os.fork()
            if child == 0:
                if deletes:
                    del slam
                end(7)
            print(status_of(child))
        slam.finish()
        print(len(slam.trajectory()) == len(images))
        """) == ["7", "7", "7", "True"]


def test_a_child_that_uses_what_its_parent_made_gets_an_error():
    assert said(f"""
        slam = mapped(live)
        states = slam.states()
        detector = oaslam.BackgroundDetector(lambda image: [])
        latest = oaslam.open_camera("{CLIP}/video.mp4")
        latest.next()
        viewer = oaslam.MapViewer(slam, port=0)
        calls = [lambda: slam.process(images[0].image, 100), slam.trajectory, slam.finish, slam.reset, lambda: slam.save("/dev/null"),
                 states.newest, lambda: states.wait_for_next(None, 60), lambda: states.has_ended, lambda: states.events_after(0),
                 detector.wait, lambda: detector.offer(0, images[0].image), latest.next, lambda: viewer.show_map(slam), lambda: viewer.url]
        child = os.fork()
        if child == 0:
            latest.stop()  # which has nothing to stop here
            sys.exit(sum(not refused(call) for call in calls))
        print(status_of(child), *(refused(call) for call in (slam.finish, states.newest, detector.wait, latest.next, lambda: viewer.url)))
        """) == ["0"] + 5 * ["None"]


def test_a_call_is_under_way_on_another_thread():
    """The mapping thread holds its locks, and the object counts as in use."""
    assert said("""
        slam = oaslam.Slam(live, camera)
        def work():
            for image in images:
                slam.process(image.image, image.timestamp)
        thread = threading.Thread(target=work)
        oaslam.set_log_sink(lambda level, message: None)
        thread.start()
        for _ in range(4):
            child = os.fork()
            if child == 0:
                sys.exit(0 if refused(slam.trajectory) else 1)
            print(status_of(child))
        thread.join()
        """) == 4 * ["0"]


def test_children_make_their_own():
    """In a pool, in the child of a child, and beside an object of the parent that lives on."""
    assert said("""
        kept = mapped(live)
        localizer = oaslam.MapLocalizer(kept.whole_map())
        def find():
            return localizer.relocalize(images[20].image, camera=camera).inlier_points
        found = find()
        def work(number):
            slam = mapped(offline)
            slam.finish()
            return len(slam.trajectory()) == len(images) and find() == found > 30
        def generation():
            own = mapped(live)
            own.whole_map()  # waits until it is mapped: its thread may hold a lock of OpenCV, which the child needs, too
            child = os.fork()
            if child == 0:
                sys.exit(0 if refused(own.finish) and refused(kept.finish) and work(0) else 1)
            return status_of(child)
        with fork.Pool(2) as pool:
            print(*pool.map(work, range(2)), refused(kept.trajectory))
        child = os.fork()
        if child == 0:
            sys.exit(generation())
        print(status_of(child))
        """) == ["True", "True", "None", "0"]


def test_a_daemon():
    """Forks twice; the parent ends at once, with its threads."""
    assert said("""
        slam = mapped(live)
        slam.whole_map()
        read, write = os.pipe()
        if os.fork() == 0:
            os.setsid()
            if os.fork() == 0:
                signal.alarm(40)  # of its own session, it would not be killed with the others
                time.sleep(0.2)
                os.write(write, b"refused " if refused(slam.finish) else b"taken ")
                slam = mapped(offline)
                slam.finish()
                os.write(write, b"%d " % (len(slam.trajectory()) == len(images)))
                sys.exit(0)
            sys.exit(0)
        os.close(write)
        print(os.fdopen(read).read())
        """) == ["refused", "1"]


def test_a_source_half_read_stays_the_parents():
    """Parent and child would share the position in the file."""
    assert said(f"""
        source = oaslam.open_images("{CLIP}/video.mp4", to=60)
        first = [source.next().index for _ in range(5)]
        child = os.fork()
        if child == 0:
            latest = oaslam.LatestImageSource(source)  # reads it on a thread of the child
            assert refused(latest.next) and refused(source.next)
            del latest
            sys.exit(sum(1 for _ in oaslam.open_images("{CLIP}/video.mp4", to=60)))
        print(status_of(child), [image.index for image in source] == list(range(5, 60)))
        """) == ["60", "True"]


def test_workers_that_carry_an_object():
    """As PyTorch's loaders do: a data set with its objects is copied into each worker."""
    assert said("""
        class Data:
            def __init__(self):
                self.slam, self.detections = mapped(offline), oaslam.DetectionTable()
                self.poses = self.slam.trajectory()
            def __len__(self):
                return len(images)
            def __getitem__(self, i):
                return images[i], self.poses[i], self.detections.find(images[i].name)
        data = Data()
        def worker(data, numbers, queue):
            for i in iter(numbers.get, None):
                queue.put((i, data[i]))
        numbers, queue = fork.Queue(), fork.Queue()
        workers = [fork.Process(target=worker, args=(data, numbers, queue), daemon=i == 0) for i in range(2)]
        for process in workers:
            process.start()
        for i in [*range(20), None, None]:
            numbers.put(i)
        items = dict(queue.get(timeout=30) for _ in range(20))
        for process in workers:
            process.join(30)
        print([process.exitcode for process in workers] == [0, 0], all(items[i] == data[i] for i in items))
        """) == ["True", "True"]


def test_handlers_at_exit_do_not_keep_a_child():
    assert said("""
        slam = mapped(live)
        atexit.register(lambda: print(refused(slam.finish), flush=True))
        child = os.fork()
        if child == 0:
            sys.exit(3)
        print(status_of(child), flush=True)
        """) == ["True", "3", "None"]


@needs_detector
def test_workers_use_a_network_that_was_loaded_before():
    """As servers do that load it once, and fork (gunicorn --preload)."""
    assert said(f"""
        detector = oaslam.Detector.load("{MODELS}/yolox_nano.onnx")
        def detect(number):
            return detector.detect(images[number].image)
        found = detect(5)
        with fork.Pool(2) as pool:
            print(len(found) > 0, all(again == found for again in pool.map(detect, [5] * 4)))
        child = os.fork()
        if child == 0:
            del detector
            sys.exit(7)
        print(status_of(child))
        """) == ["True", "True", "7"]


def test_a_sink_in_python():
    """The parent's sink is called in the child, too; a thread of the parent may be in it."""
    assert said("""
        said = []
        def sink(level, message):
            time.sleep(0.02)
            said.append(os.getpid())
        oaslam.set_log_sink(sink)
        slam = oaslam.Slam(live, camera)
        def work():
            for image in images:
                slam.process(image.image, image.timestamp)
        thread = threading.Thread(target=work)
        thread.start()
        for _ in range(4):
            child = os.fork()
            if child == 0:
                mine = oaslam.Slam(live, camera)
                mine.load(oaslam.MapSnapshot())  # says that it is empty
                sys.exit(0 if os.getpid() in said else 1)
            print(status_of(child))
        thread.join()
        """) == 4 * ["0"]
