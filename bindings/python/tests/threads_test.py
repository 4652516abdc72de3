"""Python goes on while we work, and our threads call Python without harm."""
import concurrent.futures
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy
import pytest

import oaslam
from conftest import CLIP


def slam_in_sequence(camera):
    config = oaslam.SlamConfig.offline()
    config.runner.mode = oaslam.RunnerMode.SEQUENTIAL
    return oaslam.Slam(config, camera)


@pytest.fixture
def messages():
    """What the library says, all of it."""
    said = []
    oaslam.set_log_sink(lambda level, message: said.append((threading.get_ident(), level, message)))
    yield said
    oaslam.set_log_sink(None)


def test_other_threads_run_while_an_image_is_processed(desk):
    """Python gives no thread a turn by itself here: only who lets go of the lock does."""
    count, stop = [0], threading.Event()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        def work():
            while not stop.is_set():
                count[0] += 1
                time.sleep(0)
        slam = slam_in_sequence(desk.camera)
        other = threading.Thread(target=work)
        other.start()
        before = count[0]
        for image in desk.images[:20]:
            slam.process(image.image, image.timestamp)
        during = count[0] - before
    finally:
        stop.set()
        other.join()
        sys.setswitchinterval(interval)
    assert during >= 10


def test_the_sink_is_called_from_threads_of_the_library(desk, messages):
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    detections = oaslam.load_detections(CLIP / "detections.json")
    for image in desk.images:
        slam.process(image.image, image.timestamp, detections.find(image.name))
    slam.finish()
    assert any("map begun" in message for _, _, message in messages)
    assert {level for _, level, _ in messages} <= set(oaslam.LogLevel.__members__.values())
    assert any(thread != threading.get_ident() for thread, _, _ in messages)


def test_a_sink_may_be_replaced_while_others_speak(desk):
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    said = []
    for i, image in enumerate(desk.images[:60]):
        oaslam.set_log_sink(lambda level, message, i=i: said.append(i))
        slam.process(image.image, image.timestamp)
    slam.finish()  # no thread has anything to say any more
    oaslam.set_log_sink(None)
    count = len(said)
    assert count > 0
    slam.reset()
    assert len(said) == count


def test_a_sink_that_fails_or_replaces_itself(desk, capsys, monkeypatch):
    unraisable = []
    monkeypatch.setattr(sys, "unraisablehook", lambda error: unraisable.append(error.exc_value))

    def sink(level, message):
        oaslam.set_log_sink(None)
        raise RuntimeError("a sink that fails")
    oaslam.set_log_sink(sink)
    slam = slam_in_sequence(desk.camera)
    results = [slam.process(image.image, image.timestamp) for image in desk.images[:30]]
    assert [str(error) for error in unraisable] == ["a sink that fails"]
    assert results[-1].has_pose


def test_one_call_at_a_time(desk):
    """A call in the midst of another would find a Slam that is neither here nor there."""
    errors = []
    slam = slam_in_sequence(desk.camera)

    def sink(level, message):
        try:
            slam.snapshot()
        except RuntimeError as error:
            errors.append(str(error))
    oaslam.set_log_sink(sink)
    for image in desk.images[:30]:
        slam.process(image.image, image.timestamp)
    oaslam.set_log_sink(None)
    assert errors and all("one at a time" in error for error in errors)
    assert slam.snapshot().keyframe_count > 1


def test_a_localizer_serves_many_threads(desk, desk_map):
    localizer = oaslam.MapLocalizer(desk_map)

    def find(image):
        return localizer.relocalize(image.image, camera=desk.camera).world_from_cam
    chosen = desk.images[20::8]
    alone = [find(image) for image in chosen]
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        together = list(pool.map(find, chosen))
    assert all(pose is not None for pose in alone)
    assert numpy.array_equal(alone, together)
    unknown = localizer.relocalize(chosen[0].image, mode=oaslam.RelocalizationMode.POINTS)
    assert unknown.camera.fx == desk.camera.fx and localizer.map.keyframe_count > 5


def test_the_background_detector_calls_python(desk):
    seen = []

    def detect(image):
        seen.append((threading.get_ident(), image.copy()))
        return [oaslam.Detection(7, 0.9, oaslam.Box(1, 2, 3, 4))]
    detector = oaslam.BackgroundDetector(detect)
    image = desk.images[5].image.copy()
    detector.offer(3, image)
    image[:] = 0  # the offered image is not this one any more
    detector.wait()
    result, = detector.take()
    assert (result.frame, result.detections[0].category_id) == (3, 7) and detector.images == 1 and detector.take() == []
    assert seen[0][0] != threading.get_ident() and (seen[0][1] == desk.images[5].image).all()


def test_what_the_detector_raises_comes_out_of_take():
    def detect(image):
        raise KeyError("no such thing")
    detector = oaslam.BackgroundDetector(detect)
    detector.offer(0, numpy.zeros((4, 4), numpy.uint8))
    detector.wait()
    with pytest.raises(KeyError, match="no such thing"):
        detector.take()
    for returned in ("boxes", [1], None):
        wrong = oaslam.BackgroundDetector(lambda image: returned)
        wrong.offer(0, numpy.zeros((4, 4), numpy.uint8))
        wrong.wait()
        with pytest.raises(TypeError, match="sequence of Detection"):
            wrong.take()


def program(text):
    return subprocess.Popen([sys.executable, "-c", textwrap.dedent(text)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_the_interpreter_may_end_at_any_time():
    """While a detector calls Python, a Slam is alive and a sink is set."""
    ended = program(f"""
        import sys, time, numpy, oaslam
        oaslam.set_log_sink(lambda level, message: None)
        def detect(image):
            time.sleep(0.3)
            return []
        detector = oaslam.BackgroundDetector(detect)
        detector.offer(0, numpy.zeros((4, 4), numpy.uint8))
        images = list(oaslam.open_images("{CLIP}/video.mp4", to=30))
        slam = oaslam.Slam(oaslam.SlamConfig.offline(), oaslam.load_camera("{CLIP}/camera.yaml"))
        for image in images:
            slam.process(image.image, image.timestamp)
        sys.kept = slam, detector  # beyond the end of this module
        detector.offer(1, numpy.zeros((4, 4), numpy.uint8))
        """)
    out, err = ended.communicate(timeout=60)
    assert (ended.returncode, out, err) == (0, "", "")


@pytest.mark.parametrize("loop", [
    "slam.process(*next(images))",
    "states.wait_for_next(states.newest(), 0.01)",
    "slam.snapshot().objects()",
    "detector.offer(0, numpy.zeros((4, 4), numpy.uint8))",
])
def test_daemon_threads_may_be_at_work_when_the_program_ends(loop):
    ended = program(f"""
        import itertools, threading, time, numpy, oaslam
        slam = oaslam.Slam(oaslam.SlamConfig.offline(), oaslam.load_camera("{CLIP}/camera.yaml"))
        states = slam.states()
        detector = oaslam.BackgroundDetector(lambda image: [])
        images = ((numpy.zeros((480, 640), numpy.uint8), time) for time in itertools.count())
        def work():
            while True:
                {loop}
        for _ in range(3):
            thread = threading.Thread(target=work, daemon=True)
            thread.start()
            if "slam" in "{loop}":
                break  # which takes one call at a time
        time.sleep(0.3)
        """)
    out, err = ended.communicate(timeout=60)
    assert (ended.returncode, out, err) == (0, "", "")


@pytest.mark.parametrize("wait", [
    'oaslam.open_images("{folder}", follow_quiet_s=0).next()',
    'states.wait_for_next(states.newest(), 30)',
])
def test_ctrl_c_ends_a_wait(tmp_path, wait):
    waiting = program(f"""
        import signal, oaslam
        signal.signal(signal.SIGINT, signal.default_int_handler)  # where the tests run in the background, it is ignored
        slam = oaslam.Slam(oaslam.SlamConfig.offline(), oaslam.load_camera("{CLIP}/camera.yaml"))
        states = slam.states()
        print("ready", flush=True)
        {wait.format(folder=tmp_path)}
        """)
    assert waiting.stdout.readline() == "ready\n"
    time.sleep(0.5)
    waiting.send_signal(signal.SIGINT)
    _, err = waiting.communicate(timeout=20)
    assert waiting.returncode != 0 and err.rstrip().endswith("KeyboardInterrupt")
