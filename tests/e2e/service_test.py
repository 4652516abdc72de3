"""`oaslam serve`: localization, maps, anchors and streams over HTTP and WebSocket, and input that is not meant well."""
import base64
import copy
import gzip
import http.client
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import threading
import urllib.parse

import cluster
import harness
import pytest
from websocket import WebSocket


class Stream(WebSocket):
    """A camera's connection."""
    def __init__(self, port, path, token):
        super().__init__(port, timeout=60, path=path, fields={"Sec-WebSocket-Protocol": f"oaslam, oaslam.token.{token}"})

    def image(self, bytes_, **header):
        text = json.dumps({"type": "image", **header}).encode()
        text += b" " * (-len(text) % 4)
        self.send_frame(2, struct.pack("<I", len(text)) + text + bytes_)

    def next(self, *types):
        """The next message of one of these types."""
        while True:
            message = self.receive_json()
            if message["type"] in types:
                return message


class TestService(cluster.MapFolder):
    @classmethod
    def prepare(cls):
        super().prepare()
        cls.images = cluster.images_of("query_around", cls.folder, 0, 300, 15)
        with open(os.path.join(harness.SAMPLE, "query_around", "detections.json")) as f:
            cls.boxes = [image["detections"] for image in json.load(f)][::15]
        cls.camera = cluster.camera_of("query_around")
        cls.server = cluster.Server(cls.folder, cls.path("maps"), ["--detector", "none"])
        cls.cleanup.callback(lambda: cls.server.process.kill())

    def ask(self, method, path, body=None, token=cluster.WRITE, **fields):
        headers = {name.replace("_", "-"): value for name, value in fields.items()}
        if not isinstance(body, (bytes, type(None))):
            body, headers["Content-Type"] = json.dumps(body).encode(), "application/json"
        return self.server.request(method, path, body, {**headers, "Authorization": "Bearer " + token})

    def json(self, status, *request, **options):
        answer = self.ask(*request, **options)
        assert answer.status == status, (request[:2], answer.body[:500])
        return answer.json()

    def localize(self, images, mode="points+objects"):
        return self.json(200, "POST", "/v1/maps/desk/localize", {"images": images, "mode": mode})["results"]

    def test_poses_are_those_of_localize(self):
        harness.must_run("localize", "--map", self.map, *harness.clip("query_around"), "--every-frame", "--out", self.path("localized"))
        poses = harness.read_tum(self.path("localized/poses.txt"))
        frames = harness.read_csv(self.path("localized/frames.csv"))[::15]
        evidence = set()
        for number, (image, boxes, frame) in enumerate(zip(self.images, self.boxes, frames)):
            result, = self.localize([{"image": base64.b64encode(image).decode(), "camera": self.camera, "detections": boxes}])
            assert result.get("evidence", "failed") == frame["status"], number
            if not result["found"]:
                continue
            evidence.add(result["evidence"])
            pose = min(poses, key=lambda p: abs(p[0] - float(frame["timestamp"])))
            for a, b in zip(result["pose"]["position"], pose[1]):
                assert a == pytest.approx(b, abs=2e-6)
        assert {"points+objects", "objects"} <= evidence

    def test_ways_to_ask(self):
        query = urllib.parse.urlencode({"camera": json.dumps(self.camera), "mode": "points", "gravity": "0,9.8,0"})
        given = self.json(200, "POST", f"/v1/maps/desk/localize?{query}", self.images[0], Content_Type="image/png")["results"][0]
        unknown = self.json(200, "POST", "/v1/maps/desk/localize", self.images[0], Content_Type="image/png")["results"][0]
        assert unknown["camera"]["fx"] == pytest.approx(self.camera["fx"], abs=0.03 * self.camera["fx"])
        by_objects, near = self.localize([{"camera": self.camera, "detections": self.boxes[10]},
                                          {"image": base64.b64encode(self.images[0]).decode(), "camera": self.camera, "prior": given["pose"]}])
        assert by_objects["evidence"] == "objects"
        for result in (unknown, near):
            assert max(abs(a - b) for a, b in zip(result["pose"]["position"], given["pose"]["position"])) < 0.05
        assert len(given["objects"]) > 3

    def test_anchors_are_edited_and_told(self):
        stream = Stream(self.server.port, "/v1/maps/desk/track", cluster.READ)
        hello = stream.next("hello")
        assert not hello["may_write"]
        assert len(hello["objects"]) > 5
        path = "/v1/maps/desk/anchors"
        placed = self.json(201, "POST", path, {"name": "door", "model": "flag", "pose": {"position": [0, 0, 1], "rotation": [0, 0, 0, 1]}})
        assert [a["name"] for a in stream.next("anchors")["anchors"]] == ["door"]
        assert self.json(409, "POST", path, {"name": "door", "model": "flag", "origin": [0, 0, 0], "direction": [0, 0, 1]})["error"] == 'there is an anchor "door" already'
        turned = self.json(200, "PATCH", f"{path}/door", {"turn": 1, "size": 2, "model": "lamp"})
        assert (turned["size"], turned["model"]) == (2, "lamp")
        assert turned["pose"]["rotation"] != placed["pose"]["rotation"]
        self.json(200, "PATCH", f"{path}/door", {"name": "a gate"})
        news = self.json(200, "GET", f"{path}?since={placed['version']}")
        assert ([a["name"] for a in news["anchors"]], news["removed"]) == (["a gate"], ["door"])
        stream.send({"type": "place", "model": "flag", "origin": [0, 0, 0], "direction": [0, 0, 1]})
        assert "reading" in stream.next("error")["message"]
        writer = Stream(self.server.port, "/v1/maps/desk/track", cluster.WRITE)
        writer.next("hello")
        writer.send({"type": "place", "model": "flag", "origin": [0, 0, 0], "direction": [0, 0, 1]})
        name = writer.next("anchors")["anchors"][0]["name"]
        for removed in (name, "a gate"):
            self.json(200, "DELETE", f"{path}/{urllib.parse.quote(removed)}")
        self.json(404, "DELETE", f"{path}/door")
        assert self.json(200, "GET", path)["anchors"] == []
        stream.close(), writer.close()

    def test_maps_are_stored_replaced_and_removed(self):
        content = harness.read_bytes(self.map)
        stored = self.json(201, "PUT", "/v1/maps/copy", content)
        assert self.json(200, "PUT", "/v1/maps/copy", content)["digest"] == stored["digest"]
        assert [m["name"] for m in self.json(200, "GET", "/v1/maps")["maps"]] == ["copy", "desk"]
        self.json(400, "PUT", "/v1/maps/copy", content[:-5000])
        self.json(400, "PUT", "/v1/maps/.hidden", content)
        assert self.json(200, "GET", "/v1/maps/copy")["keyframes"] > 10
        self.json(200, "DELETE", "/v1/maps/copy")
        self.json(404, "GET", "/v1/maps/copy")
        self.json(404, "DELETE", "/v1/maps/copy")

    def test_a_camera_is_followed_and_makes_a_map(self):
        frames = cluster.images_of("map_front", self.folder, 0, 240, 2)
        camera = cluster.camera_of("map_front")
        stream = Stream(self.server.port, "/v1/maps/desk/track", cluster.READ)
        stream.next("hello")
        states = []
        for number, frame in enumerate(frames[:20]):
            stream.image(frame, id=number, time=number / 15, camera="auto")
            answer = stream.next("pose", "error")
            assert (answer["type"], answer.get("id")) == ("pose", number), answer
            states.append(answer["state"])
        assert states[-1] == "tracking"
        for number in range(20, 40):  # faster than answers come: the newest one is answered, others may be dropped
            stream.image(frames[number], id=number, time=number / 15, camera=camera)
        while (answer := stream.next("pose"))["id"] != 39:
            pass
        stream.image(b"no image", id=40, time=5, camera=camera)
        assert "neither a JPEG nor a PNG" in stream.next("error")["message"]
        stream.send_frame(2, b"\xff\xff\xff\xff")
        assert "header" in stream.next("error")["message"]
        stream.send_frame(1, b"[1")
        assert "no JSON" in stream.next("error")["message"]
        stream.close()
        nowhere = Stream(self.server.port, "/v1/maps/nowhere/track", cluster.READ)
        assert "no map" in nowhere.next("error")["message"]
        with pytest.raises(ConnectionError, match="403"):
            Stream(self.server.port, "/v1/maps/new/record", cluster.READ)
        recorder = Stream(self.server.port, "/v1/maps/new/record", cluster.WRITE)
        recorder.next("hello")
        for number, frame in enumerate(frames):
            recorder.image(frame, id=number, time=number / 15, camera=camera)
            assert recorder.next("pose", "error")["type"] == "pose"
        assert recorder.next("progress")["keyframes"] > 5
        recorder.send({"type": "finish"})
        digest = recorder.next("saved")["digest"]
        assert self.json(200, "GET", "/v1/maps/new")["digest"] == digest
        self.json(200, "DELETE", "/v1/maps/new")

    def test_what_there_is_not(self):
        assert self.ask("GET", "/nothing").status == 404
        assert self.ask("DELETE", "/v1/maps").status == 405
        assert self.ask("POST", "/v1/maps/desk/localize", b"x", Content_Type="text/plain").status == 400
        text = self.ask("GET", "/metrics").body.decode()
        assert re.search(r'oaslam_requests_total\{route="other",status="404"\} \d', text)

    def test_bodies_as_a_page_or_a_proxy_sends_them(self):
        path = "/v1/maps/desk/localize"
        url = b"data:image/png;base64," + base64.b64encode(self.images[0])
        for body, kind in ((url, "text/plain;charset=UTF-8"), (url, "image/jpeg"), (json.dumps({"images": [{"image": url.decode()}]}).encode(), "application/json")):
            answer = self.ask("POST", path, body, Content_Type=kind)
            assert answer.status == 200 and json.loads(answer.body)["results"][0]["found"], (kind, answer.body)
        for method, at, kind in (("POST", path, "image/jpeg"), ("POST", path, "application/json"), ("POST", "/v1/maps/desk/anchors", "application/json"),
                                 ("PATCH", "/v1/maps/desk/anchors/door", "application/json"), ("PUT", "/v1/maps/other", "application/octet-stream")):
            answer = self.ask(method, at, b"", Content_Type=kind)
            assert answer.status == 400 and json.loads(answer.body)["error"] == "body: is empty", (method, at, answer.body)
        answer = self.ask("POST", path, b'{"images": [{"image": "data:,"}]}', Content_Type="application/json")
        assert answer.status == 400 and "canvas of no size" in answer.body.decode()
        answer = self.ask("POST", path, gzip.compress(self.images[0]), Content_Type="image/png", Content_Encoding="gzip")
        assert answer.status == 415 and "gzip is not accepted" in answer.body.decode()
        assert self.json(200, "GET", f"http://127.0.0.1:{self.server.port}/v1/maps")["maps"]
        assert self.ask("GET", "http://evil.example/v1/maps").status == 403

    def test_one_map_file_alone(self):
        shutil.copy(self.path("maps/desk.map"), self.path("maps/hall.map"))
        server = cluster.Server(self.folder, self.path("maps/hall.map"), ["--detector", "none"])
        write = {"Authorization": f"Bearer {cluster.WRITE}"}
        try:
            assert [m["name"] for m in json.loads(server.request("GET", "/v1/maps", None, write).body)["maps"]] == ["hall"]
            assert server.request("GET", "/v1/maps/desk", None, write).status == 404
            answer = server.request("PUT", "/v1/maps/desk", harness.read_bytes(self.path("maps/desk.map")), write)
            assert answer.status == 400 and "hall" in answer.body.decode(), answer
            recorder = Stream(server.port, "/v1/maps/new/record", cluster.WRITE)
            assert "alone is served" in recorder.next("error")["message"]
            recorder.close()
        finally:
            server.end(signal.SIGTERM)
            os.remove(self.path("maps/hall.map"))

    def test_values_of_every_shape(self):
        """Each value of a valid request in turn is something else: the answer is 200 or 400."""
        image = {"camera": self.camera, "detections": self.boxes[10][:4], "gravity": [0, 9.8, 0], "prior": {"position": [0, 0, 0], "rotation": [0, 0, 0, 1]}}
        requests = [("POST", "/v1/maps/desk/localize", {"images": [image], "mode": "objects"}),
                    ("POST", "/v1/maps/desk/anchors", {"model": "flag", "origin": [0, 0, 0], "direction": [0, 0, 0], "size": 1})]

        def places(value, at=()):
            yield at
            for key in (value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()):
                yield from places(value[key], (*at, key))
        count = 0
        for method, path, body in requests:
            for place in places(body):
                for wrong in (None, True, -1, 1e308, "", "x", [], {}, [[[]]], {"a": {}}):
                    changed = copy.deepcopy({"": body})
                    target = changed
                    for key in ("", *place)[:-1]:
                        target = target[key]
                    target[("", *place)[-1]] = wrong
                    answer = self.ask(method, path, changed[""])
                    assert answer.status in (200, 201, 400), (changed, answer.body)
                    count += 1
        assert count > 300
        for anchor in self.json(200, "GET", "/v1/maps/desk/anchors")["anchors"]:
            self.json(200, "DELETE", f"/v1/maps/desk/anchors/{urllib.parse.quote(anchor['name'])}")
        for text in (b"", b"{", b"[" * 50000, b"\xff\xfe", b'{"images": 1e999}', b'{"images": [{"image": "####"}]}'):
            assert self.ask("POST", "/v1/maps/desk/localize", text, Content_Type="application/json").status == 400, text[:20]
        bomb = self.images[0][:16] + struct.pack(">II", 60000, 60000) + self.images[0][24:]
        for broken in (bomb, self.images[0][:2000], self.images[0][:40], b"\x89PNG\r\n\x1a\n"):
            assert self.ask("POST", "/v1/maps/desk/localize", broken, Content_Type="image/png").status == 400

    def test_it_ends_when_it_has_answered(self):
        server = cluster.Server(self.folder, self.path("maps"), ["--detector", "none", "--workers", "1"])
        body = json.dumps({"images": 16 * [{"image": base64.b64encode(self.images[0]).decode(), "camera": self.camera}]})
        answers = []
        threads = [threading.Thread(target=lambda: answers.append(server.request("POST", "/v1/maps/desk/localize", body, {"Content-Type": "application/json"})))
                   for _ in range(3)]
        for thread in threads:
            thread.start()
        # The worker has one of the three then.
        cluster.wait_until(lambda: b"oaslam_waiting_requests 2\n" in server.request("GET", "/metrics").body, 60, "two requests wait")
        assert server.end(signal.SIGTERM) == 0
        for thread in threads:
            thread.join()
        assert [answer.status for answer in answers] == [200, 200, 200]

    def test_command_lines_that_cannot_be(self):
        maps, tokens = self.path("maps"), self.path("wrong tokens")
        with open(tokens, "w") as f:
            f.write("admin token-of-an-admin\n")
        os.chmod(tokens, 0o600)
        for options, message in ((["--maps", self.path("none")], "none: is neither a folder nor a map file"),
                                 (["--maps", harness.clip("map_front")[1]], "is no map file"), (["--maps", maps, "--bind", "0.0.0.0"], "--tls-self-signed"),
                                 (["--maps", maps, "--bind", "0.0.0.0", "--tls-self-signed"], "--token-file"),
                                 (["--maps", maps, "--tls-cert", "x"], "--tls-key"), (["--maps", maps, "--bind", "nowhere"], "expected an address"),
                                 (["--maps", maps, "--token-file", tokens], "expected: read TOKEN or write TOKEN"),
                                 (["--maps", maps, "--port", str(self.server.port)], "cannot listen"), (["--maps", "postgresql://127.0.0.1:1/x"], "database: connection")):
            outcome = harness.oaslam("serve", *([] if "--port" in options else ["--port", "0"]), *options, timeout=60)
            assert outcome.code == 1, outcome
            assert message in outcome.err
            assert outcome.err.strip().count("\n") == 0, outcome

    def test_tls(self):
        process = subprocess.Popen([harness.BINARY, "serve", "--maps", self.path("maps"), "--port", "0", "--tls-self-signed", "--token-file", self.server.tokens],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            url = process.stdout.readline().strip()
            assert url.startswith("https://"), url
            port = urllib.parse.urlsplit(url).port
            certificate = cluster.ssl.get_server_certificate(("127.0.0.1", port))
            path = self.path("certificate.pem")
            with open(path, "w") as f:
                f.write(certificate)
            assert cluster.once(cluster.Client(port, path), "GET", "/v1/maps").status == 200
            with pytest.raises((OSError, http.client.HTTPException)):
                cluster.once(cluster.Client(port), "GET", "/v1/maps")
        finally:
            process.terminate()
            assert process.wait(60) == 0
            process.communicate()
