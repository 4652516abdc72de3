"""The Python client, server/clients/python, and its command, against servers with the map of the sample."""
import contextlib
import hashlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading

import client_path
import cluster
import harness
import oaslam_client
import pytest
from oaslam_client import Client, ServiceError, Unreachable

NO_DETECTOR = ["--detector", "none"]
POSE = {"position": [0, 0, 1], "rotation": [0, 0, 0, 1]}


class Asking(cluster.MapFolder):
    @classmethod
    def prepare(cls):
        super().prepare()
        cls.images = cluster.images_of("query_around", cls.folder, 0, 60, 15)
        cls.photo = cls.path("photo.png")
        with open(cls.photo, "wb") as f:
            f.write(cls.images[0])
        cls.boxes = harness.read_json(os.path.join(harness.SAMPLE, "query_around", "detections.json"))[150]["detections"]
        cls.camera = cluster.camera_of("query_around")
        cls.server = cluster.Server(cls.folder, cls.path("maps"), NO_DETECTOR)
        cls.cleanup.callback(lambda: cls.server.end(signal.SIGKILL))
        cls.url = f"http://localhost:{cls.server.port}"

    def client(self, token=cluster.WRITE, **options):
        client = Client(self.url, token, **options)
        self.cleanup.callback(client.close)
        return client

    def receive_until(self, stream, condition):
        while not condition():
            assert stream.receive(timeout=20) is not None, "nothing more came"

    @contextlib.contextmanager
    def refused(self, status, text):
        with pytest.raises(ServiceError) as caught:
            yield
        assert caught.value.status == status
        assert text in caught.value.message
        assert "\n" not in str(caught.value)


class TestClient(Asking):
    def test_images_in_each_form(self):
        with self.client(cluster.READ) as client:
            answer = client.localize("desk", [self.photo, self.images[0], {"image": self.images[1], "camera": "auto", "gravity": [0, 9.8, 0], "time": 1},
                                              {"detections": self.boxes}], camera=self.camera)
            by_path, by_bytes, other, by_objects = answer["results"]
            assert [r.get("evidence", r.get("why_not")) for r in answer["results"]][3] == "objects"
            assert by_path["pose"] == by_bytes["pose"]
            assert other["camera"]["fx"] == pytest.approx(self.camera["fx"], abs=0.03 * self.camera["fx"])
            near = client.localize("desk", [{"image": self.photo, "prior": by_path["pose"]}], "points", camera="fov:62.7")["results"][0]
            for a, b in zip(near["pose"]["position"], by_path["pose"]["position"]):
                assert a == pytest.approx(b, abs=0.05)
            with self.refused(400, "allowed: points"):
                client.localize("desk", [self.photo], "smell")
            with self.refused(404, 'no map "nowhere"'):
                client.localize("nowhere", [self.photo])
            with pytest.raises(FileNotFoundError):
                client.localize("desk", ["no such file"])
            with pytest.raises(TypeError):
                client.localize("desk", self.photo)

    def test_maps(self):
        client = self.client()
        stored = client.upload_map("copy", self.map)
        assert stored["bytes"] == os.path.getsize(self.map)
        assert [m["name"] for m in client.maps()] == ["copy", "desk"]
        assert client.map("copy")["digest"] == stored["digest"]
        assert len(client.map("desk")["objects"]) > 5
        with self.refused(403, "reading only"):
            self.client(cluster.READ).upload_map("copy", self.map)
        large = self.path("large")
        with open(large, "wb") as f:
            f.truncate(60 << 20)  # more than is read of a request that is refused
        with self.refused(403, "reading only"):
            self.client(cluster.READ).upload_map("copy", large)
        with self.refused(400, "body"):
            client.upload_map("copy", self.photo)
        client.delete_map("copy")
        with self.refused(404, "no map"):
            client.map("copy")

    def test_connections_are_kept(self):
        client = self.client()
        client.maps()
        kept = client._connection.sock
        client.maps()
        assert client._connection.sock is kept
        kept.shutdown(socket.SHUT_RDWR)  # as the server does after a while
        assert len(client.maps()) == 1
        assert client._connection.sock is not kept

    def test_anchors_are_edited_and_followed(self):
        client = self.client()
        with self.client(cluster.READ).track("desk") as camera:
            assert (camera.hello["map"], camera.hello["may_write"], camera.anchors) == ("desk", False, {})
            placed = client.place_anchor("desk", "flag", name="a/b door", pose=POSE, size=0.2)
            assert camera.wait_for("anchors")["version"] == placed["version"]
            assert camera.anchors == {"a/b door": placed}
            edited = client.edit_anchor("desk", "a/b door", new_name="gate", model="lamp", size=0.3, turn=1.5)
            assert (edited["model"], edited["size"]) == ("lamp", 0.3)
            news = client.anchors("desk", placed["version"])
            assert ([a["name"] for a in news["anchors"]], news["removed"]) == (["gate"], ["a/b door"])
            self.receive_until(camera, lambda: camera.anchors == {"gate": edited})  # two messages, if it is told between two steps of the edit
            with self.refused(409, "already"):
                client.place_anchor("desk", "flag", name="gate", origin=[0, 0, 0], direction=[0, 0, 1])
            ray = client.place_anchor("desk", "flag", origin=[0, 0, 0], direction=[0, 0, 1])
            for name in (ray["name"], "gate"):
                client.delete_anchor("desk", name)
            with self.refused(404, "no anchor"):
                client.delete_anchor("desk", "gate")
            self.receive_until(camera, lambda: not camera.anchors)
            assert client.anchors("desk")["anchors"] == []

    def test_a_camera_is_tracked_and_makes_a_map(self):
        frames, client = cluster.images_of("map_front", self.folder, 0, 240, 4), self.client()
        camera = cluster.camera_of("map_front")
        with client.track("desk", camera) as track:
            assert track.receive(timeout=0) is None
            assert track.receive(timeout=0.01) is None
            states = []
            for number, frame in enumerate(frames[:8]):
                sent = track.send_image(frame, time=number / 7.5, gravity=[0, 9.8, 0], detections=[])
                pose = track.wait_for("pose")
                assert (sent, pose["id"], pose["time"]) == (number, number, number / 7.5)
                states.append(pose["state"])
            assert states[-1] == "tracking", states
            assert pose["camera"]["fx"] == pytest.approx(camera["fx"], abs=5e-8)
            track.send_image(b"no image")
            with self.refused(None, "neither a JPEG nor a PNG"):
                track.wait_for("pose")
            track.send_image(frames[8], time=2, imu=[[1.9, 0, 0, 0, 0, -9.8, 0]], cam_from_imu={"position": [0, 0, 0], "rotation": [0, 0, 0, 1]})
            assert track.wait_for("pose")["time"] == 2
            for facts, place in (({"imu": [[1.9, 0, 0, 0]]}, "header.imu[0]"), ({"imu": [[1.9, 0, 0, 0, 0, 5e3, 0]]}, "5000 m/s"), ({"cam_from_imu": 3}, "header.cam_from_imu")):
                track.send_image(frames[8], time=3, **facts)
                with self.refused(None, place):
                    track.wait_for("pose")
            track.send_image(frames[8], camera="fov:999")
            assert next(iter(track))["type"] == "error"
        with self.refused(None, "no map"):
            client.track("nowhere")
        with self.refused(403, "reading only"):
            self.client(cluster.READ).record("new")
        with client.record("new", camera) as record:
            record.send_image(frames[0], time=-1)
            assert record.wait_for("pose")["state"] in ("initializing", "preliminary")
            with self.refused(None, "no map yet"):
                record.finish()
        assert [m["name"] for m in client.maps()] == ["desk"]
        with client.record("new", camera) as record:
            for number, frame in enumerate(frames):
                record.send_image(frame, time=number / 7.5)
                record.wait_for("pose")
            assert record.finish()["digest"] == client.map("new")["digest"]
            assert list(record) == []  # the service has ended it
        client.delete_map("new")

    def test_tokens_and_addresses(self):
        for token in (None, "token-of-nobody-at-all"):
            for act in (lambda client: client.maps(), lambda client: client.track("desk")):
                with self.refused(401, "token is needed"):
                    act(self.client(token))
        assert "oaslam_requests_total" in self.client(cluster.READ).metrics()
        for url in ("localhost:8340", "ftp://x", "http://", "http://x:y", "http://x:99999", "http://x/?a=b"):
            with pytest.raises(ValueError, match=url.replace("?", r"\?")):
                Client(url)
        for options in ({"token": "two words"}, {"token": "line\nbreak"}, {"fingerprint": "12:34"}):
            with pytest.raises(ValueError, match="expected"):
                Client(self.url, **options)
        with Client(self.url + "/elsewhere", cluster.READ) as client, self.refused(404, "nothing at this path"):
            client.maps()

    def test_a_server_that_ends(self, request):
        server = cluster.Server(self.folder, self.path("maps"), NO_DETECTOR)
        request.addfinalizer(lambda: server.end(signal.SIGKILL))
        client = Client(f"http://127.0.0.1:{server.port}", cluster.WRITE, timeout=20)
        track = client.track("desk")
        client.maps()
        server.end(signal.SIGKILL)
        for act in (client.maps, client.maps, lambda: client.track("desk"), track.receive):
            with pytest.raises(Unreachable, match=rf"^http://127.0.0.1:{server.port}: \S"):
                act()
        track.close()
        patient = Client(f"http://127.0.0.1:{server.port}", cluster.WRITE, retries=20)
        starting = threading.Thread(target=server.start)
        starting.start()
        assert [m["name"] for m in patient.maps()] == ["desk"]
        starting.join()
        patient.close()

    def test_a_busy_server_is_asked_again(self, request):
        """One worker, with as many requests waiting as may wait: the next one is told to come again."""
        server = cluster.Server(self.folder, self.path("maps"), [*NO_DETECTOR, "--workers", "1"])
        request.addfinalizer(lambda: server.end(signal.SIGKILL))
        url, problems = f"http://127.0.0.1:{server.port}", []

        def ask(images, retries):
            try:
                with Client(url, cluster.READ, retries=retries) as client:
                    client.localize("desk", images * [self.photo], camera=self.camera)
            except ServiceError as error:
                problems.append(error)
        threads = [threading.Thread(target=ask, args=(16, 60)) for _ in range(14)]
        for thread in threads:
            thread.start()
        with Client(url, cluster.READ) as client:
            cluster.wait_until(lambda: "oaslam_waiting_requests 8\n" in client.metrics(), 20, "eight requests wait")

            def is_refused():
                try:
                    client.maps()  # succeeds where the worker has just taken one of the eight
                except ServiceError as error:
                    with self.refused(503, "too many requests wait"):
                        raise error
                    return True
                return False
            cluster.wait_until(is_refused, 20, "one is told to come again")
        ask(1, 60)
        for thread in threads:
            thread.join()
        assert problems == []
        assert self.count_of(url, 503) > 1

    def count_of(self, url, status):
        with Client(url, cluster.READ) as client:
            return sum(int(n) for n in re.findall(rf'^oaslam_requests_total{{.*status="{status}"}} (\d+)$', client.metrics(), re.M))

    def test_tls(self):
        process = subprocess.Popen([harness.BINARY, "serve", "--maps", self.path("maps"), "--port", "0", "--tls-self-signed", "--token-file",
                                    self.server.tokens, *NO_DETECTOR], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            url = process.stdout.readline().strip()
            assert url.startswith("https://"), url
            address = ("127.0.0.1", int(url.rstrip("/").rpartition(":")[2]))
            url = f"https://{address[0]}:{address[1]}"
            ca_file = self.path("certificate.pem")
            with open(ca_file, "w") as f:
                f.write(cluster.ssl.get_server_certificate(address))
            der = cluster.ssl.PEM_cert_to_DER_cert(harness.read_bytes(ca_file).decode())
            fingerprint = hashlib.sha256(der).hexdigest().upper()
            for options in ({"ca_file": ca_file}, {"fingerprint": ":".join(fingerprint[i:i + 2] for i in range(0, 64, 2))}, {"insecure": True}):
                with Client(url, cluster.READ, **options) as client, client.track("desk") as camera:
                    assert client.maps()[0]["name"] == camera.hello["map"]
                    assert camera.receive(timeout=0) is None
            for options, text in (({}, "certificate verify failed"), ({"fingerprint": 64 * "0"}, "fingerprint " + fingerprint.lower())):
                with Client(url, cluster.READ, **options) as client, pytest.raises(Unreachable, match=text):
                    client.maps()
            with pytest.raises(OSError, match=re.escape(self.map)):
                Client(url, ca_file=self.map)
            with pytest.raises(Unreachable):
                Client(url.replace("https", "http"), cluster.READ).maps()
        finally:
            process.terminate()
            assert process.wait(60) == 0
            process.communicate()


class TestCommand(Asking):
    def run_client(self, *arguments, token=cluster.WRITE, url=None):
        environment = {**os.environ, "PYTHONPATH": client_path.FOLDER, "OASLAM_TOKEN": token}
        done = subprocess.run([sys.executable, "-m", "oaslam_client", url or self.url, *arguments], capture_output=True, text=True, timeout=120,
                              env=environment)
        return harness.Outcome(done.returncode, done.stdout, done.stderr)

    def out(self, *arguments):
        outcome = self.run_client(*arguments)
        assert (outcome.code, outcome.err) == (0, ""), outcome
        return outcome.out

    def test_it_asks(self):
        camera = self.path("camera.json")
        with open(camera, "w") as f:
            json.dump(self.camera, f)
        black = self.path("black.png")
        subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", "color=black:s=640x480", "-frames:v", "1", black], check=True)
        found, lost = self.out("localize", "desk", self.photo, black, "--camera", camera).splitlines()
        assert re.search(re.escape(self.photo) + r":( -?\d+\.\d{6}){7} by points", found)
        assert re.search(re.escape(black) + r": not found: \w", lost)
        result = json.loads(self.out("localize", "desk", self.photo, "--json"))
        assert (result["image"], result["found"]) == (self.photo, True)
        size = os.path.getsize(self.map)
        assert self.out("upload", "other", self.map) == f"other {size} bytes\n"
        assert self.out("maps") == f"desk {size} bytes\nother {size} bytes\n"
        self.client().place_anchor("other", "flag", name="door", pose=POSE)
        assert re.search(r"^door: flag( -?\d\.\d{6}){7}\n$", self.out("anchors", "other"))
        assert self.out("delete", "other") == ""
        assert self.out("maps") == f"desk {size} bytes\n"

    def test_bad_input(self):
        text = self.path("text.json")
        with open(text, "w") as f:
            f.write("{")
        localize = ("localize", "desk", self.photo)
        for arguments, options, message in (
                (("maps",), {"token": ""}, "a token is needed (status 401)"), (("delete", "desk"), {"token": cluster.READ}, "this token is for reading only"),
                (("map", "desk"), {}, None), (("localize", "desk"), {}, None), ((), {}, None), (("localize", "desk", "x", "--mode", "smell"), {}, None),
                (("localize", "desk", "none.jpg"), {}, "none.jpg"), (("localize", "desk", text), {}, "neither a JPEG nor a PNG"),
                ((*localize, "--camera", "none.json"), {}, "none.json"), ((*localize, "--camera", text), {}, text + ": no JSON"),
                ((*localize, "--camera", "fov:1000"), {}, "fov"), (("localize", "nowhere", self.photo), {}, 'no map "nowhere"'),
                (("upload", "desk", "none.map"), {}, "none.map"), (("upload", "..", self.map), {}, "status 40"), (("anchors", "nowhere"), {}, "no map"),
                (("maps",), {"url": "desk"}, "desk: expected http://"), (("maps",), {"url": "http://localhost:1"}, "http://localhost:1: "),
                (("maps",), {"url": "http://no-such-host.invalid"}, "http://no-such-host.invalid: ")):
            outcome = self.run_client(*arguments, **options)
            if message is None:  # of argparse, with the usage
                assert (outcome.code, outcome.out) == (2, ""), outcome
                continue
            assert (outcome.code, outcome.out) == (1, ""), outcome
            assert re.search(rf"^oaslam_client: .*{re.escape(message)}.*\n$", outcome.err)

    def test_it_is_installed(self):
        python = next((p for p in (sys.executable, "/usr/bin/python3") if subprocess.run([p, "-c", "import setuptools, wheel, pip"],
                                                                                        capture_output=True).returncode == 0), None)
        if not python:
            pytest.skip("there is no Python with pip, setuptools and wheel")
        source, site = self.path("source"), self.path("site")
        subprocess.run(["cp", "-r", client_path.FOLDER, source], check=True)  # a build leaves files in its folder
        subprocess.run([python, "-m", "pip", "install", "-q", "--no-build-isolation", "--no-index", "--no-warn-script-location", "--root-user-action=ignore",
                        "--target", site, source], check=True, capture_output=True)
        assert os.path.exists(os.path.join(site, "oaslam_client", "py.typed"))
        done = subprocess.run([python, os.path.join(site, "bin", "oaslam-client"), self.url, "maps"], capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": site, "OASLAM_TOKEN": cluster.READ})
        assert (done.returncode, done.stdout.split()[0]) == (0, "desk"), done
