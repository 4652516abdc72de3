"""A service of several servers, for tests: PostgreSQL, HAProxy with server/deploy/haproxy.cfg, `oaslam serve`, and clients that localize
images all the time."""
import glob
import http.client
import json
import math
import os
import pwd
import re
import shutil
import signal
import socket
import ssl
import subprocess
import threading
import time
import urllib.parse

import client_path  # noqa: F401
import harness
from oaslam_client.websocket import WebSocket

READ, WRITE = "token-of-a-reader", "token-of-a-writer"
SOURCE = os.environ["OASLAM_SOURCE_DIR"]
HAPROXY = shutil.which("haproxy") or shutil.which("haproxy", path="/usr/sbin")
POSTGRES = max(glob.glob("/usr/lib/postgresql/*/bin"), key=lambda p: int(p.split("/")[-2]), default=None)


def missing():
    """What a cluster needs and this machine lacks."""
    names = [name for name, found in (("PostgreSQL", POSTGRES), ("HAProxy", HAPROXY), ("openssl", shutil.which("openssl"))) if not found]
    if not re.search(r"^ +serve ", harness.oaslam("--help").out, re.M):
        names.append("oaslam serve")
    return names


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class MapFolder(harness.InFolder):
    """A folder "maps" with a map of the sample's desk."""
    @classmethod
    def prepare(cls):
        os.mkdir(cls.path("maps"))
        cls.map = shutil.copy(harness.DESK_MAP, cls.path("maps"))


def wait_until(condition, seconds, what):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"after {seconds} s still not: {what}")
        time.sleep(0.05)


class Postgres:
    """A server with a database cluster in `folder`, reached by TCP on loopback."""
    def __init__(self, folder):
        self.data, self.log, self.port = os.path.join(folder, "postgres", "data"), os.path.join(folder, "postgres", "log"), free_port()
        os.mkdir(os.path.dirname(self.data))
        self.as_user = []
        if os.geteuid() == 0:  # it refuses to run as root
            user = pwd.getpwnam("postgres")
            os.chown(os.path.dirname(self.data), user.pw_uid, user.pw_gid)
            os.chmod(folder, 0o755)
            self.as_user = ["runuser", "-u", user.pw_name, "--"]
        self.call("initdb", "--auth=trust", "--username=oaslam", "--encoding=UTF8", "--no-sync", "-D", self.data)
        self.start()
        self.uri = f"postgresql://oaslam@127.0.0.1:{self.port}/postgres"

    def call(self, program, *arguments):
        subprocess.run([*self.as_user, os.path.join(POSTGRES, program), *arguments], check=True, cwd="/", stdin=subprocess.DEVNULL,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def start(self):
        self.call("pg_ctl", "-w", "-D", self.data, "-l", self.log, "-o",
                  f"-c fsync=off -p {self.port} -c listen_addresses=127.0.0.1 -k {os.path.dirname(self.data)}", "start")

    def stop(self):
        """Stops at once: connections break."""
        self.call("pg_ctl", "-w", "-m", "immediate", "-D", self.data, "stop")


class Server:
    """One `oaslam serve` on loopback."""
    def __init__(self, folder, location, options=()):
        self.port, self.location, self.options = free_port(), location, options
        self.tokens, self.log = os.path.join(folder, "tokens"), os.path.join(folder, f"server-{self.port}.log")
        with open(self.tokens, "w") as f:
            f.write(f"read {READ}\nwrite {WRITE}\n")
        os.chmod(self.tokens, 0o600)
        self.start()

    def start(self):
        """Returns when it answers."""
        with open(self.log, "a") as log:
            self.process = subprocess.Popen([harness.BINARY, "serve", "--maps", self.location, "--port", str(self.port), "--token-file", self.tokens,
                                             *self.options], stdout=log, stderr=log)
        try:
            wait_until(self.is_healthy, 20, f"server {self.port} answers: {self.log}")
        except BaseException:
            self.process.kill()
            raise

    def is_healthy(self):
        if self.process.poll() is not None:
            raise AssertionError("the server has ended: " + harness.read_bytes(self.log).decode()[-2000:])
        try:
            return self.request("GET", "/healthz").status == 200
        except OSError:
            return False

    def request(self, method, path, body=None, headers=None):
        return once(Client(self.port), method, path, body, headers)

    def end(self, how):
        self.process.send_signal(how)
        return self.process.wait(timeout=60)


class Haproxy:
    """HAProxy as server/deploy/haproxy.cfg has it, but with these ports, and a certificate of its own."""
    def __init__(self, folder, servers):
        self.port = free_port()
        self.certificate, key, both = (os.path.join(folder, name) for name in ("certificate.pem", "key.pem", "oaslam.pem"))
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
                        "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout", key, "-out", self.certificate], check=True, capture_output=True)
        with open(both, "wb") as f:
            f.write(harness.read_bytes(key) + harness.read_bytes(self.certificate))
        text = harness.read_bytes(os.path.join(SOURCE, "server", "deploy", "haproxy.cfg")).decode()
        for old, new in ((":443 ", f"127.0.0.1:{self.port} "), ("/etc/haproxy/oaslam.pem", both), ("127.0.0.1:8801", f"127.0.0.1:{servers[0].port}"),
                         ("127.0.0.1:8802", f"127.0.0.1:{servers[1].port}"), ("/dev/log", "stderr format raw")):
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        self.config, self.log = os.path.join(folder, "haproxy.cfg"), os.path.join(folder, "haproxy.log")
        with open(self.config, "w") as f:
            f.write(text)
        with open(self.log, "w") as log:
            self.process = subprocess.Popen([HAPROXY, "-db", "-f", self.config], stdout=log, stderr=log)
        wait_until(self.is_ready, 10, f"HAProxy answers: {self.log}")

    def client(self):
        return Client(self.port, self.certificate)

    def is_ready(self):
        try:
            return once(self.client(), "GET", "/healthz").status == 200
        except OSError:
            return False

    def end(self):
        self.process.terminate()
        self.process.wait(timeout=20)


class Answer:
    def __init__(self, status, body, headers):
        self.status, self.body, self.headers, self.type = status, body, headers, headers["Content-Type"]

    def json(self):
        return json.loads(self.body)


class Client:
    """A connection that is kept from request to request."""
    def __init__(self, port, certificate=None, timeout=60):
        if certificate:
            self.connection = http.client.HTTPSConnection("127.0.0.1", port, timeout=timeout, context=ssl.create_default_context(cafile=certificate))
        else:
            self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=timeout)

    def request(self, method, path, body=None, headers=None):
        """Raises OSError or HTTPException where there is no answer."""
        try:
            self.connection.request(method, path, body, {"Authorization": "Bearer " + WRITE, **(headers or {})})
            response = self.connection.getresponse()
            return Answer(response.status, response.read(), response.headers)
        except (OSError, http.client.HTTPException):
            self.connection.close()
            raise

    def localize(self, name, image, camera):
        query = urllib.parse.urlencode({"camera": json.dumps(camera)})
        return self.request("POST", f"/v1/maps/{name}/localize?{query}", image, {"Content-Type": "image/png"})


def once(client, *request):
    """The answer to one request, on a connection for it alone."""
    try:
        return client.request(*request)
    finally:
        client.connection.close()


def track(haproxy, name):
    """Opens a WebSocket that tracks in a map, as a browser would. Returns it and the server's first message."""
    context = ssl.create_default_context(cafile=haproxy.certificate)
    connection = context.wrap_socket(socket.create_connection(("127.0.0.1", haproxy.port), timeout=20), server_hostname="localhost")
    host = f"localhost:{haproxy.port}"
    stream = WebSocket(connection, host, f"/v1/maps/{name}/track",
                       {"Origin": f"https://{host}", "Sec-WebSocket-Protocol": f"oaslam, oaslam.token.{READ}"})
    return stream, json.loads(stream.receive())


def camera_of(clip):
    """The intrinsics of a clip of the sample, as the service wants them."""
    text = harness.read_bytes(os.path.join(harness.SAMPLE, clip, "camera.yaml")).decode()
    fx, _, cx, _, fy, cy, *_ = json.loads(re.search(r"data: (\[.*?\])", text)[1])
    size = {name: int(re.search(rf"image_{name}: (\d+)", text)[1]) for name in ("width", "height")}
    return {"model": "pinhole", **size, "fx": fx, "fy": fy, "cx": cx, "cy": cy}


def images_of(clip, folder, begin, end, step):
    """PNG files of frames of a clip of the sample."""
    out = os.path.join(folder, clip)
    subprocess.run([harness.EXTRACT, harness.clip(clip)[1], out, str(begin), str(end)], check=True)
    return [harness.read_bytes(path) for path in sorted(glob.glob(os.path.join(out, "rgb", "*.png")))[::step]]


def truth_of(client, name, images, camera):
    """The answers to these images of the map that is stored now: its digest, and positions, None where an image is not found."""
    answers = [client.localize(name, image, camera).json() for image in images]
    client.connection.close()
    digests = {answer["digest"] for answer in answers}
    assert len(digests) == 1, digests
    return digests.pop(), [a["results"][0]["pose"]["position"] if a["results"][0]["found"] else None for a in answers]


class Load:
    """Clients that localize images one after another until they are stopped. Each answer is checked against what the map of its digest
    gives for the image: `truths` is {digest: positions}."""
    def __init__(self, client, name, images, camera, clients):
        self.new_client, self.name, self.images, self.camera, self.truths = client, name, images, camera, {}
        self.lock, self.is_done, self.answers = threading.Lock(), threading.Event(), []
        self.threads = [threading.Thread(target=self.run, args=(i,)) for i in range(clients)]

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self.is_done.set()
        for thread in self.threads:
            thread.join()

    def run(self, first):
        client, number = self.new_client(), first
        while not self.is_done.is_set():
            image, start = number % len(self.images), time.monotonic()
            number += 1
            try:
                answer = client.localize(self.name, self.images[image], self.camera)
                problem = None if answer.status == 200 else f"{answer.status} {answer.body[:200]}"
            except (OSError, http.client.HTTPException) as error:
                answer, problem, client = None, repr(error), self.new_client()
            with self.lock:
                self.answers.append((start, time.monotonic() - start, image, None if problem else answer.json(), problem))
        client.connection.close()

    def wait_for(self, more, seconds=600):
        """Until this many further answers have come."""
        wanted = len(self.answers) + more
        wait_until(lambda: len(self.answers) >= wanted, seconds, f"{wanted} answers, {len(self.answers)} have come")

    def failures(self):
        return [problem for *_, problem in self.answers if problem]

    def digests(self):
        return {answer["digest"] for *_, answer, problem in self.answers if not problem}

    def mixtures(self, tolerance=1e-3):
        """Answers that are not what the map of their digest gives."""
        wrong = []
        for _, _, image, answer, problem in self.answers:
            if problem:
                continue
            truth, result = self.truths[answer["digest"]][image], answer["results"][0]
            if result["found"] != (truth is not None) or (truth and math.dist(truth, result["pose"]["position"]) > tolerance):
                wrong.append((answer["digest"][:8], image, truth, result))
        return wrong


class Cluster:
    """Two servers with the maps of one database behind HAProxy."""
    def __init__(self, folder):
        self.haproxy, self.servers, self.postgres = None, [], Postgres(folder)
        try:
            for _ in range(2):
                self.servers.append(Server(folder, self.postgres.uri))
            self.haproxy = Haproxy(folder, self.servers)
        except BaseException:
            self.end()
            raise

    def end(self):
        if self.haproxy:
            self.haproxy.end()
        for server in self.servers:
            if server.process.poll() is None:
                server.end(signal.SIGKILL)
        self.postgres.stop()

    def put(self, name, path):
        answer = once(self.haproxy.client(), "PUT", f"/v1/maps/{name}", harness.read_bytes(path), {"Content-Type": "application/octet-stream"})
        assert answer.status in (200, 201), (answer.status, answer.body[:500])
        return answer.json()["digest"]


def make_maps(folder):
    """Two maps of the same place with different frames, so that a pose of one is wrong in the other."""
    maps = []
    for begin in (0, 60):
        maps.append(os.path.join(folder, f"from_{begin}.map"))
        outcome = harness.oaslam("run", *harness.clip("map_front"), "--from", begin, "--to", begin + 150, "--out", maps[-1] + "_run", "--map-out", maps[-1])
        assert outcome.code == 0, outcome
    return maps


def kill_a_server(cluster, load, answers):
    """Kills a server with -9 under load and starts it again; a number of answers before, between and after. Returns the number of requests
    that it had not answered."""
    load.wait_for(answers)
    victim = cluster.servers[0]
    before = len(load.answers)
    victim.end(signal.SIGKILL)
    in_flight = len(load.threads)  # at most: each client has one request under way
    load.wait_for(answers)
    victim.start()
    load.wait_for(answers)
    return in_flight, [problem for *_, problem in load.answers[before:] if problem]


def replace_the_map(cluster, load, maps, times, answers):
    """Replaces the map under load, again and again, until the answers are of the new one each time."""
    for number in range(1, times + 1):
        digest = cluster.put(load.name, maps[number % 2])
        load.wait_for(answers)
        wait_until(lambda: {a["digest"] for *_, a, problem in load.answers[-8:] if not problem} == {digest}, 60, "answers are of the new map alone")


def place(server, name, anchor):
    """Places an anchor on one server. Returns the status."""
    pose = {"position": [0, 0, 1], "rotation": [0, 0, 0, 1]}
    body = json.dumps({"name": anchor, "model": "cube", "pose": pose, "size": 0.1})
    return server.request("POST", f"/v1/maps/{name}/anchors", body, {"Content-Type": "application/json"}).status


def anchors_of(server, name):
    return {anchor["name"] for anchor in server.request("GET", f"/v1/maps/{name}/anchors").json()["anchors"]}


def break_the_database(cluster, load, seconds):
    """Stops the database for a while under load. Returns the longest time that an edit took to be refused meanwhile."""
    a, b = cluster.servers
    assert place(a, load.name, "before") == 201
    wait_until(lambda: "before" in anchors_of(b, load.name), 30, "an anchor placed on one server is on the other")
    cluster.postgres.stop()
    end, slowest = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        start = time.monotonic()
        assert place(a, load.name, "meanwhile") == 503
        slowest = max(slowest, time.monotonic() - start)
        time.sleep(0.2)
    cluster.postgres.start()
    wait_until(lambda: place(a, load.name, "after") == 201, 30, "anchors can be placed again")
    wait_until(lambda: "after" in anchors_of(b, load.name), 30, "an anchor placed on one server is on the other again")
    return slowest
