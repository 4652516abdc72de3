"""Docstrings, stub, examples, and the page."""
import inspect
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

import oaslam
from conftest import CLIP, SOURCE, needs_detector

EXAMPLES = SOURCE / "examples" / "python"


def explained(thing):
    """Whether the docstring says more than the signature."""
    first, _, rest = (thing.__doc__ or "").partition("\n")
    return bool((rest if "->" in first else first + rest).strip())


def test_all_has_a_docstring():
    functions = 0
    for name, value in vars(oaslam).items():
        if name.startswith("_"):
            continue
        assert explained(value), name
        for member, function in vars(value).items() if inspect.isclass(value) else ():
            if not member.startswith("_") and (inspect.isroutine(function) or inspect.isclass(function)):
                assert explained(function), f"{name}.{member}"
                functions += 1
    assert functions > 50
    assert "Time stamps must ascend" in oaslam.Slam.process.__doc__ and "add_detections" in oaslam.Slam.process.__doc__


def test_the_stub_is_that_of_the_module():
    stub = SOURCE / "bindings" / "python" / "oaslam" / "__init__.pyi"
    done = subprocess.run([sys.executable, SOURCE / "bindings" / "python" / "tools" / "stubs.py", "--check", stub], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not shutil.which("mypy"), reason="there is no mypy")
def test_types(tmp_path):
    package = tmp_path / "oaslam"
    package.mkdir()
    for name in ("__init__.pyi", "py.typed"):
        shutil.copy(SOURCE / "bindings" / "python" / "oaslam" / name, package)
    command = ["mypy", "--strict", "--cache-dir", tmp_path / "cache", "--ignore-missing-imports"]

    def check(*files):
        return subprocess.run([*command, *files], capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "MYPYPATH": str(tmp_path)})
    done = check(package / "__init__.pyi", *(path for path in EXAMPLES.glob("*.py") if path.name != "map_and_plot.py"))
    assert done.returncode == 0, done.stdout
    (tmp_path / "wrong.py").write_text('import oaslam\noaslam.load_camera(5)\noaslam.SlamConfig.offline().runner.mode = "live"\n')
    assert check("wrong.py").stdout.count("error:") == 2


def example(name, *arguments, env={}):
    done = subprocess.run([sys.executable, EXAMPLES / f"{name}.py", *map(str, arguments)], capture_output=True, text=True, env={**os.environ, **env})
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_minimal():
    pytest.importorskip("cv2")
    out = example("minimal", CLIP / "video.mp4", 525, 120)
    assert re.search(r"\n119 tracking .*\n(\d\d|[2-9]) keyframes, \d{3,} landmarks", out), out


def test_ar_anchors(tmp_path):
    pytest.importorskip("cv2")
    out = example("ar_anchors", CLIP / "video.mp4", CLIP / "camera.yaml", tmp_path / "ar.png", 100)
    assert re.search(r"\n99 \d+ \d+\n", out) and (tmp_path / "ar.png").stat().st_size > 10000


def test_live_camera(tmp_path):
    pytest.importorskip("cv2")
    out = example("live_camera", CLIP / "video.mp4", CLIP / "camera.yaml", tmp_path / "live.png", 4)
    assert re.search(r"[1-9]\d* keyframes in the end\n", out) and "tracking" in out and (tmp_path / "live.png").stat().st_size > 10000


def test_localize_many(desk_map):
    out = example("localize_many", desk_map, CLIP / "video.mp4", CLIP / "camera.yaml")
    assert re.search(r"^000050 (-?\d+\.\d{3} ?){3}\n000051 ", out, re.M), out
    done = subprocess.run([sys.executable, EXAMPLES / "localize_many.py", "no.map", CLIP / "video.mp4"], capture_output=True, text=True)
    assert done.returncode == 1 and "no.map" in done.stderr and "Traceback" not in done.stderr


@needs_detector
def test_map_and_plot(tmp_path):
    pytest.importorskip("matplotlib")
    out = example("map_and_plot", CLIP / "video.mp4", CLIP / "camera.yaml", tmp_path, "--no-viewer", env={"MPLBACKEND": "Agg", "MPLCONFIGDIR": str(tmp_path)})
    assert re.search(r"\d+ keyframes, \d+ landmarks, objects: \w+", out)
    assert (tmp_path / "map.png").stat().st_size > 10000
    info = subprocess.run([os.environ["OASLAM_BINARY"], "info", tmp_path / "map.oaslam"], capture_output=True, text=True)
    assert info.returncode == 0, info.stderr


@needs_detector
def test_the_page(tmp_path):
    """The twenty lines of docs/python.md run as they are printed."""
    page = (SOURCE / "docs" / "python.md").read_text()
    program = re.search(r"^```python\n(.*?)^```$", page, re.M | re.S)[1]
    assert program.count("\n") <= 20
    for name, file in {"walk.mp4": "video.mp4", "camera.yaml": "camera.yaml"}.items():
        os.symlink(CLIP / file, tmp_path / name)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "walk.map").exists() and (tmp_path / "walk.txt").exists()
    assert "\n119 tracking" in done.stdout and "\nbottle [" in done.stdout, done.stdout
