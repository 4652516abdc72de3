"""The module in a virtual environment, by pip and without internet, from the build under test."""
import os
import subprocess
import sys
import tarfile

import pytest

from conftest import CLIP, SOURCE

sys.path.insert(0, str(SOURCE / "bindings" / "python" / "packaging"))
import oaslam_backend

PROGRAM = f"""
import os, sys, oaslam
assert oaslam.__file__.startswith(sys.prefix), oaslam.__file__
loaded = {{line.split()[-1] for line in open("/proc/self/maps") if "liboaslam" in line}}
assert all(path.startswith(sys.prefix) for path in loaded), loaded
slam = None
for image in oaslam.open_images({str(CLIP / "video.mp4")!r}, to=40):
    slam = slam or oaslam.Slam(oaslam.SlamConfig.offline(), oaslam.load_camera({str(CLIP / "camera.yaml")!r}))
    result = slam.process(image.image, image.timestamp)
print(oaslam.__version__, result.state)
"""


def run(*command):
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, env=env, cwd="/")
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_pip(tmp_path):
    pytest.importorskip("ensurepip")
    run(sys.executable, "-m", "venv", "--system-site-packages", tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", SOURCE, "--no-build-isolation", "--no-index", "--config-settings", f"build-dir={os.environ['OASLAM_BUILD_DIR']}")
    assert run(python, "-c", PROGRAM) == f"{oaslam_backend.version()} tracking\n"
    listed = run(python, "-m", "pip", "show", "--files", "oaslam")
    assert "oaslam/py.typed" in listed and "oaslam/__init__.pyi" in listed
    run(python, "-m", "pip", "uninstall", "--yes", "oaslam")


@pytest.mark.skipif(not (SOURCE / ".git").exists(), reason="not a repository")
def test_source_archive(tmp_path):
    name = oaslam_backend.build_sdist(tmp_path)
    with tarfile.open(tmp_path / name) as archive:
        names = archive.getnames()
    assert {f"oaslam-{oaslam_backend.version()}/{file}" for file in ("PKG-INFO", "pyproject.toml", "CMakeLists.txt", "core/CMakeLists.txt")} <= set(names)
