"""The commands and programs of docs/service.md and server/clients/python/README.md work as they are printed, but for the port."""
import json
import os
import re
import shutil
import signal
import subprocess
import sys

import client_path
import cluster
import harness
import pytest

PORT = "8340"  # of the pages


def blocks(page, language):
    """The texts of the code blocks of a page in a language."""
    with open(os.path.join(cluster.SOURCE, page)) as f:
        return re.findall(rf"^```{language}\n(.*?)^```$", f.read(), re.M | re.S)


def commands(page):
    """The commands of all blocks. One may take several lines; none goes on in the next block."""
    found = []
    for block in blocks(page, "sh"):
        command = ""
        for line in block.splitlines():
            command += line
            if line.endswith("|") or command.count("'") % 2:
                command += "\n"
            else:
                found.append(command)
                command = ""
        assert not command, command
    return found


def poses(answer):
    return [result["pose"] for result in json.loads(answer)["results"]]


# In the order of the page: a part of a command, and whether its answer shows that it did what it is for.
ANSWERS = [
    ("photo.jpg 'localhost", lambda a: poses(a)),
    ("maps/desk  ", lambda a: len(json.loads(a)["objects"]) > 5),
    ('"origin"', lambda a: json.loads(a)["name"] == "door"),
    ("/v1/maps", lambda a: [m["name"] for m in json.loads(a)["maps"]] == ["desk"]),
    ("-T maps/desk.map", lambda a: json.loads(a)["name"] == "copy"),
    ("-X DELETE", lambda a: json.loads(a) == {"removed": True}),
    ("since", lambda a: [anchor["name"] for anchor in json.loads(a)["anchors"]] == ["door"]),
    ("-X PATCH", lambda a: json.loads(a)["size"] == 0.3),
    ("-X DELETE", lambda a: json.loads(a) == {"name": "door"}),
    ("/metrics", lambda a: "oaslam_localize_seconds" in a),
    ('"gravity"', lambda a: poses(a)),
]


class TestPages(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.port = str(cluster.free_port())
        for name in ("maps", "bin", "walk.oaslam"):
            os.mkdir(cls.path(name))
        front, around = (os.path.join(harness.SAMPLE, name) for name in ("map_front", "query_around"))
        os.symlink(os.path.join(front, "video.mp4"), cls.path("desk.mp4"))
        subprocess.run(["ffmpeg", "-v", "error", "-i", os.path.join(around, "video.mp4"), "-frames:v", "1", "-q:v", "2", cls.path("photo.jpg")], check=True)
        # To estimate the camera and detect objects takes its time, and has tests of its own.
        with open(cls.path("bin/oaslam"), "w") as f:
            f.write(f'#!/bin/sh\ncase $1 in\nrun) exec "{harness.BINARY}" "$@" --camera "{front}/camera.yaml" --detections "{front}/detections.json" ;;\n'
                    f'serve) exec "{harness.BINARY}" "$@" --port {cls.port} --detector none ;;\nesac\n')
        os.chmod(cls.path("bin/oaslam"), 0o755)
        cls.environment = {**os.environ, "PATH": cls.path("bin") + os.pathsep + os.environ["PATH"], "PYTHONPATH": client_path.FOLDER}
        run, serve = (command for command in commands("docs/service.md") if command.startswith("oaslam"))
        done = cls.run_line(run)
        assert done.returncode == 0, done
        shutil.copy(cls.path("maps/desk.map"), cls.path("walk.oaslam/map.oaslam"))
        with open(cls.path("log"), "w") as log:
            cls.server = subprocess.Popen(["bash", "-c", "exec " + serve], cwd=cls.folder, env=cls.environment, stdout=log, stderr=log)
        cls.cleanup.callback(cls.end)
        cluster.wait_until(cls.is_healthy, 20, "the server answers")

    @classmethod
    def end(cls):
        cls.server.send_signal(signal.SIGTERM)
        assert cls.server.wait(60) == 0, harness.read_bytes(cls.path("log"))

    @classmethod
    def is_healthy(cls):
        assert cls.server.poll() is None, harness.read_bytes(cls.path("log"))
        try:
            return cluster.once(cluster.Client(int(cls.port)), "GET", "/healthz").status == 200
        except OSError:
            return False

    @classmethod
    def run_line(cls, command):
        return subprocess.run(["bash", "-c", "set -o pipefail; " + command.replace(PORT, cls.port)], cwd=cls.folder, env=cls.environment, capture_output=True,
                              text=True, timeout=120)

    def run_python(self, program):
        return subprocess.run([sys.executable, "-c", program], cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=120)

    @pytest.mark.skipif(not shutil.which("curl"), reason="there is no curl")
    def test_curl(self):
        lines = [command for command in commands("docs/service.md") if not command.startswith("oaslam")]
        assert len(lines) == len(ANSWERS)
        for line, (part, is_right) in zip(lines, ANSWERS):
            assert "curl" in line
            assert part in line
            done = self.run_line(line)
            assert done.returncode == 0, done.stderr
            assert is_right(done.stdout), done.stdout[:500]

    def test_python(self):
        program, = blocks("docs/service.md", "python")
        done = self.run_python(program.replace(PORT, self.port))
        assert (done.returncode, done.stderr) == (0, "")
        assert re.search(r"^\{'position': \[", done.stdout)

    def test_the_page_of_the_client(self):
        program, = blocks("server/clients/python/README.md", "python")
        program = program.replace("https://slam.example", f"http://localhost:{self.port}")
        done = self.run_python('images = 5 * ["photo.jpg"]\n' + program)
        assert (done.returncode, done.stderr) == (0, "")
        first, *states = done.stdout.splitlines()
        assert re.search(r"^\{'position': \[", first)
        assert re.search(r"^(tracking|relocalized) \{'flag.*': \{'name': 'flag", states[-1])
        lines = [command for command in commands("server/clients/python/README.md") if command.startswith("python3 ")]
        assert len(lines) == 3
        for line, answer in zip(lines, (r"^photo.jpg: ", r"^desk \d+ bytes", "^usage: ")):
            done = self.run_line(line)
            assert (done.returncode, done.stderr) == (0, ""), line
            assert re.search(answer, done.stdout)
