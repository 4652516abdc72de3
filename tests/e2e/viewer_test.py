"""The viewer's server: ports, Ctrl-C, edits, commands; and a run with the same results with and without viewers, also ill-behaved ones."""
import os
import re
import shutil
import signal
import socket
import subprocess
import threading
import time

import harness
import pytest
from harness import BINARY, must_run, oaslam
from websocket import WebSocket


class Program:
    """The command in the background, with the port of its page."""

    def __init__(self, *args):
        self.process = subprocess.Popen([BINARY, *map(str, args)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.text = ""
        while not (match := re.search(r"http://127\.0\.0\.1:(\d+)/", self.text)):
            line = self.process.stdout.readline()
            if not line:
                raise AssertionError(f"no page: {self.text}")
            self.text += line
        self.port = int(match[1])
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stdout:
            self.text += line

    def wait(self, timeout=120):
        code = self.process.wait(timeout)
        self.reader.join(10)
        self.process.stdout.close()
        return code

    def end(self):
        self.process.send_signal(signal.SIGINT)
        return self.wait(20)

    def get(self, target="/", host=None, timeout=10):
        with socket.create_connection(("127.0.0.1", self.port), timeout) as s:
            s.sendall(f"GET {target} HTTP/1.1\r\nHost: {host or f'127.0.0.1:{self.port}'}\r\nConnection: close\r\n\r\n".encode())
            answer = b""
            while part := s.recv(65536):
                answer += part
            return answer


class TestViewer(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.out, cls.map = os.path.join(cls.folder, "plain"), os.path.join(cls.folder, "desk.map")
        must_run("run", *harness.clip("map_front"), "--to", "200", "--out", cls.out, "--map-out", cls.map)

    def setup_method(self):
        self.program = None

    def teardown_method(self):
        if self.program and self.program.process.poll() is None:
            self.program.process.kill()
            self.program.wait()

    def view(self, *args):
        self.program = Program("view", self.map, "--port", "0", *args)
        return self.program

    def watch(self, program, **options):
        viewer = WebSocket(program.port, **options)
        self.cleanup.callback(viewer.close)
        return viewer

    def test_a_saved_map_and_ctrl_c(self):
        program = self.view()
        page = program.get()
        assert b"200 OK" in page
        assert b"The MIT License" in page
        assert not re.search(r"<(script|link|img)[^>]+(src|href)=\"(?!data:)", page.decode("ascii"))
        viewers = [self.watch(program) for _ in range(3)]
        for viewer in viewers:
            assert viewer.receive()[0]["commands"] == False
            header, _ = viewer.receive()
            landmarks = next(count for name, _, count in header["arrays"] if name == "landmark_ids")
            info = oaslam("info", self.map).out
            assert landmarks == int(re.search(r"landmarks\s+(\d+)", info)[1])
            assert sum(o["mapped"] for o in header["objects"]) == len(harness.read_json(os.path.join(self.out, "objects.json")))
        assert b"403 Forbidden" in program.get(host="evil.example")
        assert program.end() == 0
        with pytest.raises(ConnectionError):
            while True:
                viewers[0].receive()

    def test_one_line_where_the_port_is_in_use(self):
        program = self.view()
        for command in (["view", self.map, "--port", program.port], ["run", *harness.clip("map_front"), "--out", os.path.join(self.folder, "x"), "--viewer", "--port", program.port]):
            outcome = oaslam(*command)
            assert outcome.code == 1, outcome
            assert len(outcome.err.strip().splitlines()) == 1, outcome
            assert f"port {program.port}" in outcome.err

    def test_edits_of_a_saved_map_are_written(self):
        """One edit after another; what another program edits in the file is shown and kept, and another map is not overwritten."""
        path = os.path.join(self.folder, "edited.map")
        shutil.copy(self.map, path)
        first = next(o for o in harness.read_json(os.path.join(self.out, "objects.json")))["id"]
        assert oaslam("anchors", path, "--place", f"sign=flag@object:{first}").code == 0
        self.program = program = Program("view", path, "--port", "0")
        viewer = self.watch(program)

        def answer():
            """What the next message on anchors says: their names, or why an edit is refused."""
            while True:
                header = viewer.receive()[0]
                if "anchors" in header and header["type"] == "update":
                    return [anchor["name"] for anchor in header["anchors"]]
                for event in header.get("events", []):
                    if event["kind"] == "anchor":
                        return event["text"]

        assert answer() == ["sign"]
        for old, new in (("sign", "gate"), ("gate", "door")):
            viewer.send({"type": "anchor", "name": old, "rename": new})
            assert answer() == [new]
            assert f"\n{new} " in oaslam("anchors", path).out
        assert oaslam("anchors", path, "--rename", "door=window", "--place", f"note=flag@object:{first}").code == 0
        assert answer() == ["note", "window"]
        viewer.send({"type": "anchor", "name": "door", "rename": "roof"})
        assert 'no anchor "door"' in answer()
        viewer.send({"type": "anchor", "name": "window", "rename": "roof"})
        while answer() != ["note", "roof"]:
            pass
        assert {"note", "roof"} == {line.split()[0] for line in oaslam("anchors", path).out.splitlines()[1:-1]}
        other = harness.DESK_MAP
        shutil.copy(other, path + ".new")
        os.replace(path + ".new", path)
        assert "has changed since it was opened" in answer()
        viewer.send({"type": "anchor", "name": "roof", "rename": "gate"})
        assert "has changed since it was opened" in answer()
        assert harness.read_bytes(path) == harness.read_bytes(other)
        assert oaslam("info", path).code == 0
        assert program.end() == 0, program.text

    def test_two_viewers_and_a_command_edit_one_map(self):
        path = os.path.join(self.folder, "shared.map")
        shutil.copy(self.map, path)
        names = [f"{who}{i}" for who in "abc" for i in range(4)]
        must_run("anchors", path, "--quiet", *(word for name in names for word in ("--place", f"{name}=flag@keyframe:0:320,240")))
        programs = [Program("view", path, "--port", "0") for _ in range(2)]
        for program in programs:
            self.cleanup.callback(program.process.kill)
        viewers = [self.watch(program) for program in programs]
        for i in range(4):
            for viewer, who in zip(viewers, "ab"):
                viewer.send({"type": "anchor", "name": f"{who}{i}", "rename": f"{who}{i}-new"})
            must_run("anchors", path, "--rename", f"c{i}=c{i}-new", "--quiet")
        expected, end = {f"{name}-new" for name in names}, time.monotonic() + 30
        while (found := {line.split()[0] for line in must_run("anchors", path).out.splitlines()[1:-1]}) != expected:
            assert time.monotonic() < end, found
        for program in programs:
            assert program.end() == 0, program.text

    def test_bad_input(self):
        for options, words in ((["/nowhere"], "no such file"), ([self.folder + "/nothing.map"], "no such file"), ([harness.SAMPLE], "neither a map file"),
                               ([os.path.join(harness.SAMPLE, "README.md")], "README.md"), ([self.map, "--bind", "desk"], "--bind desk"), ([self.map, "--port", "70000"], "70000"),
                               ([self.map, "--images", "/nowhere"], "/nowhere"), ([self.map, "--groundtruth", self.map], "desk.map"), ([self.out, "--map", "/nowhere"], "/nowhere")):
            outcome = oaslam("view", *options, timeout=20)
            assert outcome.code != 0, outcome
            assert words in outcome.err, outcome
        for port in ("x", "70000", "-1", "0.5"):
            for option in ("--viewer", "--port"):
                outcome = oaslam("run", *harness.clip("map_front"), "--out", os.path.join(self.folder, "x"), "--viewer", f"{option}={port}")
                assert outcome.code > 0, outcome
                assert re.search(f"{option}.*{port}", outcome.err), outcome

    def test_a_run_is_the_same_watched_or_not(self):
        """Viewers may stop reading, send many requests, or vanish."""
        out = os.path.join(self.folder, "watched")
        self.program = program = Program("run", *harness.clip("map_front"), "--to", "200", "--out", out, "--viewer", "--port", "0", "--viewer-paused")
        stalled = self.watch(program, receive_buffer=4096)
        gone = self.watch(program)
        viewer = self.watch(program)
        assert viewer.receive()[0]["commands"]
        viewer.send({"type": "command", "name": "pause", "on": False})
        frames, deltas, last = [], 0, None
        try:
            while True:
                header, _ = viewer.receive()
                if "frame" in header:
                    frames.append(header["frame"]["frame"])
                deltas += "map" in header
                viewer.send({"type": "object", "id": 0})
                last = header.get("map", last)
                if len(frames) == 3:
                    gone.close()
        except ConnectionError:
            pass
        assert program.wait() == 0, program.text
        assert len(frames) > 5
        assert frames == sorted(frames)
        assert deltas > 1
        assert last["landmarks"] == harness.read_json(os.path.join(out, "summary.json"))["landmarks"]
        for name in ("trajectory.txt", "trajectory_live.txt", "keyframes.txt", "objects.json"):
            assert harness.read_bytes(os.path.join(out, name)) == harness.read_bytes(os.path.join(self.out, name)), name
        stalled.close()

    def test_ctrl_c_while_held_writes_the_results(self):
        out = os.path.join(self.folder, "held")
        self.program = program = Program("run", *harness.clip("map_front"), "--out", out, "--viewer", "--port", "0")
        viewer = self.watch(program)
        viewer.receive()
        viewer.send({"type": "command", "name": "pause", "on": True})
        while not viewer.receive()[0].get("status", {}).get("paused"):
            pass
        assert program.end() == 130, program.text
        assert os.path.exists(os.path.join(out, "summary.json"))

    def test_reset_and_stay(self):
        out = os.path.join(self.folder, "reset")
        self.program = program = Program("run", *harness.clip("map_front"), "--to", "120", "--out", out, "--viewer", "--port", "0", "--viewer-paused", "--viewer-stay")
        viewer = self.watch(program)
        viewer.receive()
        for name in ("reset", "relocalize", "step", "step"):
            viewer.send({"type": "command", "name": name})
        viewer.send({"type": "command", "name": "mapping", "on": True})
        viewer.send({"type": "command", "name": "pause", "on": False})
        status = {}
        while status.get("live") is not False:
            status = viewer.receive()[0].get("status", status)
        late = self.watch(program)
        late.receive()
        assert late.receive()[0]["map"]["landmarks"] > 300
        assert program.end() == 0, program.text
