"""The install components, each of which is a Debian package (docs/packages.md): what is in which, and that nothing is in none."""
import glob
import os
import re
import shutil
import subprocess
import sys

import harness
import pytest

SOURCE = os.environ["OASLAM_SOURCE_DIR"]
BUILD = os.path.dirname(harness.BINARY)
CHANGELOG = os.path.join(SOURCE, "cmake", "debian", "changelog.py")


def cache():
    with open(os.path.join(BUILD, "CMakeCache.txt")) as f:
        return dict(re.findall(r"^([\w-]+):\w+=(.*)$", f.read(), re.M))


class TestComponents(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.cache = cache()
        names = ["library", "development", "viewer", "viewer_development", "command", "viewer_command", "server"] + (["ros2"] if os.path.exists(os.path.join(BUILD, "oaslam-ros2")) else []) + (["python"] if cls.cache["OASLAM_BUILD_PYTHON"] == "ON" else [])
        cls.files = {name: cls.installed(name, "--component", name) for name in names}

    @classmethod
    def installed(cls, folder, *options):
        """The files of an installation, with * for the version and the tag of Python's module."""
        prefix = cls.path(folder)
        subprocess.run(["cmake", "--install", BUILD, "--prefix", prefix, *options], check=True, stdout=subprocess.DEVNULL)
        files = [os.path.relpath(os.path.join(at, name), prefix) for at, _, names in os.walk(prefix) for name in names]
        return sorted(re.sub(r"(?<=\.so\.0\.)[\d.]+$|(?<=_oaslam\.)\S+(?=\.so$)", "*", file) for file in files)

    def lib(self, *names):
        return [f"{self.cache['CMAKE_INSTALL_LIBDIR']}/{name}" for name in names]

    def test_the_libraries_are_alone(self):
        assert self.files["library"] == sorted(self.lib("liboaslam.so.0", "liboaslam.so.0.*"))
        assert self.files["viewer"] == sorted(self.lib("liboaslam-viewer.so.0", "liboaslam-viewer.so.0.*"))

    def test_a_program_is_built_with_the_development_files(self):
        headers = {os.path.relpath(path, f"{SOURCE}/core") for path in glob.glob(f"{SOURCE}/core/include/oaslam/*.h")}
        of_viewer = {"include/oaslam/map_viewer.h"}
        build_type = self.cache["CMAKE_BUILD_TYPE"].lower()
        cmake = [f"cmake/oaslam/oaslam{file}.cmake" for file in ("Config", "ConfigVersion", "Targets", f"Targets-{build_type}")] + ["cmake/oaslam/FindOpenCV.cmake"]
        assert self.files["development"] == sorted([*headers, *self.lib("liboaslam.so", "pkgconfig/oaslam.pc", *cmake)])
        cmake = [f"cmake/oaslam/oaslamViewerTargets{of}.cmake" for of in ("", f"-{build_type}")]
        assert self.files["viewer_development"] == sorted([*of_viewer, *self.lib("liboaslam-viewer.so", "pkgconfig/oaslam-viewer.pc", *cmake)])

    def test_the_programs_have_their_manuals(self):
        zsh = "vendor-completions" if self.cache["CMAKE_INSTALL_PREFIX"] == "/usr" else "site-functions"
        assert self.files["command"] == sorted([
            "bin/oaslam", "share/bash-completion/completions/oaslam", f"share/zsh/{zsh}/_oaslam", "share/man/man1/oaslam.1.gz"])
        assert self.files["viewer_command"] == ["bin/oaslam-viewer"]
        assert self.files["server"] == ["bin/oaslam-server", "share/man/man1/oaslam-server.1.gz"]
        assert self.files.get("ros2", ["bin/oaslam-ros2"]) == ["bin/oaslam-ros2"]

    def test_the_python_module_has_its_types(self):
        if "python" not in self.files:
            pytest.skip("built without the Python module")
        folder = self.cache["OASLAM_PYTHON_DIR"] + "/oaslam/"
        assert self.files["python"] == sorted(folder + name for name in ("__init__.py", "__init__.pyi", "py.typed", "_oaslam.*.so"))

    def test_everything_is_in_one_package(self):
        assert self.installed("all") == sorted(sum(self.files.values(), []))


class TestChangelog:
    def changelog(self, version):
        return subprocess.run([sys.executable, CHANGELOG, os.path.join(SOURCE, "CHANGELOG.md"), version, "1", "Name <name@example.org>",
                               "Mon, 23 Nov 2026 00:00:00 +0000"], capture_output=True, text=True)

    def test_it_is_what_changed_in_the_version(self):
        version = cache()["CMAKE_PROJECT_VERSION"]
        text = self.changelog(version).stdout
        assert text.startswith(f"oaslam ({version}-1) unstable; urgency=medium\n\n  * "), text[:200]
        assert text.count("\n  * ") > 3
        assert max(map(len, text.splitlines())) < 81
        assert "`" not in text

    def test_debian_reads_it(self):
        if not shutil.which("dpkg-parsechangelog"):
            pytest.skip("no dpkg-parsechangelog")
        read = subprocess.run(["dpkg-parsechangelog", "--all", "-l", "-"], input=self.changelog("0.1.0").stdout, capture_output=True, text=True)
        assert read.stderr == ""
        assert "Version: 0.1.0-1\n" in read.stdout
        assert "Maintainer: Name <name@example.org>\n" in read.stdout

    def test_a_version_that_changed_nothing_is_refused(self):
        done = self.changelog("9.9")
        assert done.returncode != 0
        assert "no section 9.9" in done.stderr
