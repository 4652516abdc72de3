"""Builds wheels and source archives of the Python module (PEP 517), by CMake, with Python's standard library alone.

A wheel has the module and the libraries beside it (found by $ORIGIN). Settings (pip's --config-settings KEY=VALUE):
  build-dir   a build folder with OASLAM_BUILD_PYTHON, which is used as it is; by default build/python is made
  cmake-args  more arguments for CMake, as in a shell
"""
import base64
import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import tomllib
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[3]


def version():
    return re.search(r"project\(oaslam VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def metadata():
    with open(ROOT / "pyproject.toml", "rb") as f:
        project = tomllib.load(f)["project"]
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {version()}", f"Summary: {project['description']}",
             f"License: {project['license']['text']}", f"Requires-Python: {project['requires-python']}"]
    lines += [f"Requires-Dist: {name}" for name in project["dependencies"]]
    return "\n".join(lines) + "\n"


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def write_dist_info(folder):
    info = pathlib.Path(folder) / f"oaslam-{version()}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(metadata())
    (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: oaslam\nRoot-Is-Purelib: false\nTag: {tag()}\n")
    shutil.copy(ROOT / "LICENSE", info)
    return info


def run(*command):
    print("+", shlex.join(map(str, command)), flush=True)
    subprocess.run(list(map(str, command)), check=True)


def built(settings):
    """The build folder, up to date."""
    folder = pathlib.Path(settings.get("build-dir") or ROOT / "build" / "python").resolve()
    if "build-dir" not in settings:
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        run("cmake", "-S", ROOT, "-B", folder, *generator, "-DCMAKE_BUILD_TYPE=Release", "-DOASLAM_BUILD_PYTHON=ON", "-DOASLAM_BUILD_APPS=OFF",
            f"-DPython_EXECUTABLE={sys.executable}", *shlex.split(settings.get("cmake-args", "")))
    run("cmake", "--build", folder, "--target", "oaslam_python", "--parallel", os.cpu_count() or 1)
    return folder


def collect(folder, build):
    """Copies what a wheel contains."""
    with tempfile.TemporaryDirectory() as stage:
        for component in ("python", "library", "viewer"):
            run("cmake", "--install", build, "--strip", "--component", component, "--prefix", stage)
        module, = pathlib.Path(stage).rglob("_oaslam.*.so")
        shutil.copytree(module.parent, folder / "oaslam")
        for library in pathlib.Path(stage).rglob("liboaslam*.so.?"):  # none where the module contains it
            shutil.copy(library, folder / "oaslam")
    if not (folder / "oaslam" / f"_oaslam{sysconfig.get_config_var('EXT_SUFFIX')}").exists():
        sys.exit(f"{build} was built for another Python than {sys.executable}: {module.name}")


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build = built(config_settings or {})
    name = f"oaslam-{version()}-{tag()}.whl"
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        collect(folder, build)
        info = write_dist_info(folder)
        record = ""
        with zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
            for file in sorted(path for path in folder.rglob("*") if path.is_file()):
                inside = file.relative_to(folder).as_posix()
                digest = base64.urlsafe_b64encode(hashlib.sha256(file.read_bytes()).digest()).decode().rstrip("=")
                record += f"{inside},sha256={digest},{file.stat().st_size}\n"
                wheel.write(file, inside)
            own = f"{info.name}/RECORD"
            wheel.writestr(own, record + f"{own},,\n")
    return name


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    return write_dist_info(metadata_directory).name


def build_sdist(sdist_directory, config_settings=None):
    """All files that git knows."""
    base = f"oaslam-{version()}"
    files = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True, check=True).stdout.split("\0")
    with tarfile.open(os.path.join(sdist_directory, base + ".tar.gz"), "w:gz") as archive, tempfile.TemporaryDirectory() as folder:
        for file in filter(None, files):
            archive.add(ROOT / file, f"{base}/{file}", recursive=False)
        info = pathlib.Path(folder) / "PKG-INFO"
        info.write_text(metadata())
        archive.add(info, f"{base}/PKG-INFO")
    return base + ".tar.gz"
