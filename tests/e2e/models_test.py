"""`oaslam models` against servers on this machine: what is listed, fetched, added and refused, and what a run does without a model."""
import contextlib
import hashlib
import http.server
import json
import os
import pty
import resource
import shutil
import signal
import socket
import ssl
import subprocess
import threading
import time
from unittest import mock

import harness
import pytest
from harness import must_run, oaslam

CONTENT = b"".join(hashlib.sha256(str(i).encode()).digest() for i in range(20000))  # 640,000 bytes
SIZE, HALF = len(CONTENT), len(CONTENT) // 2
# The smallest file that passes for ONNX: a model (field 7: its graph) with an input (field 11) that has a name.
ONNX = b"\x3a\x0a\x5a\x08\x0a\x06images"


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_GET(self):
        server = self.server
        server.requests.append(self.path)
        self.close_connection = True
        if server.location:
            return self.answer(302, b"moved", Location=server.location.format(path=self.path))
        if server.status != 200:
            return self.answer(server.status, b"a page that is no model")
        self.answer(200, server.content)

    def answer(self, status, body, **headers):
        server = self.server
        self.send_response(status)
        if not (server.hides_size and status == 200):
            self.send_header("Content-Length", str(len(body)))
        self.send_header("Connection", "close")
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        if server.breaks > 0 and status < 300:
            server.breaks -= 1
            body = body[:server.most]
        with contextlib.suppress(ConnectionError):
            self.wfile.write(body)
            self.wfile.flush()
            if server.most and len(body) == server.most:
                server.stall.wait(60)

    def log_message(self, *args):
        pass


class Server(http.server.ThreadingHTTPServer):
    """Sends `content`. The next `breaks` answers end after `most` bytes; while `stall` is not set, they stay open there."""
    daemon_threads = True

    def __init__(self, content=CONTENT, certificate=None):
        super().__init__(("127.0.0.1", 0), Handler)
        if certificate:
            tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            tls.load_cert_chain(certificate)
            self.socket = tls.wrap_socket(self.socket, server_side=True, do_handshake_on_connect=False)
        self.content, self.requests, self.hides_size, self.status, self.location = content, [], False, 200, None
        self.breaks, self.most, self.stall = 0, 0, threading.Event()
        self.stall.set()
        self.url = f"http{'s' if certificate else ''}://127.0.0.1:{self.server_address[1]}"
        self.thread = threading.Thread(target=self.serve_forever)
        self.thread.start()

    def handle_error(self, request, client_address):
        pass  # a client that goes away, or that refuses the certificate

    def close(self):
        self.stall.set()
        self.shutdown()
        self.thread.join()
        self.server_close()


class WithServer:
    @pytest.fixture(autouse=True)
    def with_server(self, tmp_path):
        self.home = str(tmp_path)
        self.models = os.path.join(self.home, "data", "oaslam", "models")
        self.file = os.path.join(self.models, "tiny.onnx")
        with contextlib.ExitStack() as self.cleanup:
            self.server = Server()
            self.cleanup.callback(self.server.close)
            entries = [{"name": name, "finds": "nothing", "bytes": SIZE, "sha256": hashlib.sha256(CONTENT).hexdigest(), "licence": "CC0-1.0", "author": "us",
                        "url": f"{self.server.url}/files/{name}.onnx"} for name in ("yolox_nano", "tiny")]
            catalogue = os.path.join(self.home, "catalogue.json")
            with open(catalogue, "w") as f:
                json.dump({"models": entries}, f)
            self.cleanup.enter_context(mock.patch.dict(
                os.environ, OASLAM_MODELS="", OASLAM_MODELS_CATALOGUE=catalogue, no_proxy="127.0.0.1",
                XDG_DATA_HOME=os.path.join(self.home, "data"), XDG_STATE_HOME=os.path.join(self.home, "state")))
            yield

    def assert_fetched(self, done):
        assert done.code == 0, done
        assert done.out == f"tiny is in {self.file}\n"
        assert harness.read_bytes(self.file) == CONTENT
        assert os.listdir(self.models) == ["tiny.onnx"]

    def assert_refused(self, done, *words):
        assert done.code == 1, done
        for word in words:
            assert word in done.err
        assert len(done.err.strip().splitlines()) == done.err.count(" %, ") + 1, done  # one message, and progress
        assert not os.path.isdir(self.models) or os.listdir(self.models) == []  # nothing is kept


class TestGet(WithServer):
    def test_whole(self):
        assert "not here: oaslam models get tiny" in oaslam("models").out
        done = oaslam("models", "get", "tiny")
        self.assert_fetched(done)
        assert "100 %, 0.6 of 0.6 MB" in done.err
        assert self.server.requests == ["/files/tiny.onnx"]
        again = oaslam("models", "get", "tiny", "--quiet")
        self.assert_fetched(again)
        assert (again.err, len(self.server.requests)) == ("", 1)
        assert f"\ntiny: nothing, 0.6 MB, CC0-1.0 (us)\n  published at {self.server.url}/files/tiny.onnx\n  here: {self.file}\n" in oaslam("models").out

    def test_wrong_digest(self):
        for hides_size in (False, True):
            self.server.content, self.server.hides_size = CONTENT[::-1], hides_size
            self.assert_refused(oaslam("models", "get", "tiny"), hashlib.sha256(CONTENT).hexdigest(), hashlib.sha256(CONTENT[::-1]).hexdigest())

    def test_the_file_of_the_server_has_another_size(self):
        for content in (CONTENT + b"more", CONTENT[:-1]):
            self.server.content = content
            self.assert_refused(oaslam("models", "get", "tiny"), f"{len(content)} bytes, the published one has {SIZE}")
        self.server.content, self.server.hides_size = CONTENT + b"more", True
        self.assert_refused(oaslam("models", "get", "tiny"), f"more than the {SIZE} bytes")

    def test_statuses(self):
        for status in (404, 403, 503, 416):
            self.server.status = status
            self.assert_refused(oaslam("models", "get", "tiny"), f"{self.server.url}/files/tiny.onnx: the server answers with status {status}")

    def test_redirects(self):
        other = Server()
        self.cleanup.callback(other.close)
        self.server.location = other.url + "/elsewhere{path}"
        self.assert_fetched(oaslam("models", "get", "tiny"))
        assert other.requests == ["/elsewhere/files/tiny.onnx"]
        os.remove(self.file)
        secret = os.path.join(self.home, "secret")
        with open(secret, "wb") as f:
            f.write(CONTENT)
        for location in (f"file://{secret}", self.server.url + "{path}"):
            self.server.location = location
            self.assert_refused(oaslam("models", "get", "tiny"), self.server.url)

    @pytest.mark.skipif(not shutil.which("openssl"), reason="needs openssl")
    def test_https(self):
        certificate = os.path.join(self.home, "certificate.pem")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", "/CN=mirror",
                        "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", certificate, "-out", certificate + ".own"], check=True, capture_output=True)
        with open(certificate, "ab") as f:
            f.write(harness.read_bytes(certificate + ".own"))
        server = Server(certificate=certificate)
        self.cleanup.callback(server.close)
        with mock.patch.dict(os.environ, OASLAM_MODELS_URL=server.url):
            self.assert_refused(oaslam("models", "get", "tiny"), server.url, "certificate")
            os.environ["SSL_CERT_FILE"] = certificate
            server.location = self.server.url + "{path}"
            self.assert_refused(oaslam("models", "get", "tiny"), server.url, "http")
            assert self.server.requests == []
            server.location = None
            self.assert_fetched(oaslam("models", "get", "tiny"))

    def test_a_mirror(self):
        with mock.patch.dict(os.environ, OASLAM_MODELS_URL="http://user:password@" + self.server.url[len("http://"):] + "/mirror/"):
            self.server.status = 404
            done = oaslam("models", "get", "tiny")
            self.assert_refused(done, self.server.url + "/mirror/tiny.onnx")
            assert "password" not in done.err + oaslam("models").out
            self.server.status = 200
            self.assert_fetched(oaslam("models", "get", "tiny"))
        with mock.patch.dict(os.environ, OASLAM_MODELS_URL="file:///mirror"):
            assert "OASLAM_MODELS_URL: file:///mirror: expected https://" in oaslam("models").err

    def test_no_network(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        for base in (f"http://127.0.0.1:{port}", "http://nowhere.invalid"):
            with mock.patch.dict(os.environ, OASLAM_MODELS_URL=base):
                self.assert_refused(oaslam("models", "get", "tiny", "--timeout", 5, timeout=60), base, "`oaslam models add FILE`")

    def test_a_server_that_stalls(self):
        self.server.breaks, self.server.most = 99, HALF
        self.server.stall.clear()
        begin = time.time()
        self.assert_refused(oaslam("models", "get", "tiny", "--timeout", 1), "tiny.onnx: ", "`oaslam models add FILE`")
        assert time.time() - begin < 60

    def test_a_server_that_breaks_off(self):
        self.server.breaks, self.server.most = 1, HALF
        self.assert_refused(oaslam("models", "get", "tiny"), "tiny.onnx: ", "`oaslam models add FILE`")
        self.assert_fetched(oaslam("models", "get", "tiny"))

    def start(self, *args):
        process = subprocess.Popen([harness.BINARY, "models", "get", "tiny", *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.cleanup.callback(process.communicate)
        self.cleanup.callback(process.kill)
        return process

    def wait_until(self, is_so):
        deadline = time.time() + 60
        while not is_so():
            assert time.time() < deadline
            time.sleep(0.02)

    def test_interrupted(self):
        self.server.breaks, self.server.most = 1, HALF
        self.server.stall.clear()
        process = self.start()
        self.wait_until(lambda: self.server.requests)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
        assert process.returncode == 130, err
        assert "interrupted: nothing is kept" in err
        assert os.listdir(self.models) == []
        self.assert_fetched(oaslam("models", "get", "tiny"))

    def test_a_full_disk(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (HALF, HALF))
        done = subprocess.run([harness.BINARY, "models", "get", "tiny"], capture_output=True, text=True, preexec_fn=limit, restore_signals=False)
        self.assert_refused(harness.Outcome(done.returncode, done.stdout, done.stderr), "tiny.onnx: cannot be written: File too large")

        disk = os.path.join(self.home, "data")
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "none", disk], capture_output=True).returncode != 0:
            pytest.skip("a small disk cannot be mounted here")
        self.cleanup.callback(subprocess.run, ["umount", disk], check=True)
        self.assert_refused(oaslam("models", "get", "tiny"), "tiny.onnx: cannot be written: No space left on device")

    def test_folders_that_cannot_be_written(self):
        with open(os.path.join(self.home, "data"), "w"):
            pass
        self.assert_refused(oaslam("models", "get", "tiny"), f"{self.models}: cannot be created: Not a directory")
        env = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_DATA_HOME")}
        with mock.patch.dict(os.environ, env, clear=True):
            self.assert_refused(oaslam("models", "get", "tiny"), "neither XDG_DATA_HOME nor HOME")

    def test_another_file_of_that_name(self):
        os.makedirs(self.models)
        with open(self.file, "wb") as f:
            f.write(ONNX)
        assert f"here: {self.file}, which is not the published file" in oaslam("models").out
        done = oaslam("models", "get", "tiny")
        assert done.code == 1, done
        assert "--force replaces it" in done.err
        assert harness.read_bytes(self.file) == ONNX
        self.assert_fetched(oaslam("models", "get", "tiny", "--force"))

    def test_a_model_of_another_folder(self):
        first = os.path.join(self.home, "first")
        os.makedirs(first)
        with mock.patch.dict(os.environ, OASLAM_MODELS=first):
            with open(os.path.join(first, "tiny.onnx"), "wb") as f:
                f.write(ONNX)
            done = oaslam("models", "get", "tiny")
            self.assert_fetched(done)
            assert f"warning: {first}/tiny.onnx is found first, and used instead" in done.err
            os.replace(self.file, os.path.join(first, "tiny.onnx"))
            done = oaslam("models", "get", "tiny")
            assert (done.code, done.out) == (0, f"tiny is in {first}/tiny.onnx\n"), done
            assert (len(self.server.requests), os.listdir(self.models)) == (1, [])

    def test_what_is_not_in_the_catalogue(self):
        done = oaslam("models", "get", "yolo")
        self.assert_refused(done, "models get yolo: not in the catalogue, which has yolox_nano, tiny")
        catalogue = os.environ["OASLAM_MODELS_CATALOGUE"]
        with open(catalogue, "w") as f:
            f.write('{"models": [{"name": "a"}]}')
        self.assert_refused(oaslam("models"), f"{catalogue}: models[0].finds: expected a text")


class TestAdd(WithServer):
    def own(self, name, content=ONNX):
        path = os.path.join(self.home, name)
        with open(path, "wb") as f:
            f.write(content)
        return path

    def test_a_file_of_ones_own(self):
        path = self.own("museum.onnx")
        done = oaslam("models", "add", path)
        assert (done.code, done.out) == (0, f"museum is in {self.models}/museum.onnx\nto use it: --detector museum\n"), done
        assert oaslam("models", "add", path).code == 0  # it is there
        assert f"museum\n  here: {self.models}/museum.onnx\n" in oaslam("models").out
        done = oaslam("models", "add", self.own("museum.onnx", ONNX + b"\x32\x01x"))
        assert done.code == 1, done
        assert "museum.onnx: another file is there" in done.err
        assert oaslam("models", "add", path, "--force").code == 0
        assert harness.read_bytes(f"{self.models}/museum.onnx") == ONNX + b"\x32\x01x"

    def test_a_published_file_is_known_by_its_digest(self):
        catalogue = os.environ["OASLAM_MODELS_CATALOGUE"]
        entries = harness.read_json(catalogue)["models"]
        entries[1].update(sha256=hashlib.sha256(ONNX).hexdigest(), bytes=len(ONNX))
        with open(catalogue, "w") as f:
            json.dump({"models": entries}, f)
        assert oaslam("models", "add", self.own("download(1).onnx")).out == f"tiny is in {self.file}\nto use it: --detector tiny\n"
        assert f"here: {self.file}\n" in oaslam("models").out

    def test_what_is_refused(self):
        for path, words in ((self.own("noise.onnx", b"noise"), "noise.onnx: not an ONNX file"), (self.own("my net.onnx"), "--name"), (self.own("none.onnx"), "--name"),
                            (self.own("tiny.onnx"), "not the published tiny"), (os.path.join(self.home, "no.onnx"), "there is no such file"), (self.home, "is a folder")):
            done = oaslam("models", "add", path)
            assert done.code == 1, done
            assert words in done.err
        assert not os.path.exists(self.models)
        for name in ("../x", "default", ".x", "-x"):
            assert oaslam("models", "add", self.own("a.onnx"), "--name=" + name).code != 0, name
        assert oaslam("models", "add", self.own("tiny.onnx"), "--name", "my-net").code == 0

    def test_names_are_looked_for_in_order(self):
        def used(name):
            done = oaslam("detect", "--detector", name, os.path.join(harness.SAMPLE, "map_front", "video.mp4"), "--out", os.path.join(self.home, "x.json"))
            assert done.code == 1, done
            return done.err
        first, second = (os.path.join(self.home, name) for name in ("first", "second"))
        assert f"no detector museum: museum.onnx is in none of {self.models}, " in used("museum")
        assert "`oaslam models get yolox_nano` fetches it" in used("default")
        oaslam("models", "add", self.own("museum.onnx"))
        assert f"error: {self.models}/museum.onnx: " in used("museum")
        with mock.patch.dict(os.environ, OASLAM_MODELS=f"{first}:{second}"):
            os.makedirs(second)
            shutil.copy(f"{self.models}/museum.onnx", second)
            assert f"error: {second}/museum.onnx: " in used("museum")
        assert "museum.onnx: " in used(os.path.join(self.home, "museum.onnx"))

    @harness.needs_detector
    def test_a_detector_by_its_name(self):
        assert oaslam("models", "add", harness.MODEL, "--name", "nano").code == 0
        out = os.path.join(self.home, "x.json")
        done = must_run("detect", "--detector", "nano", os.path.join(harness.SAMPLE, "map_front", "video.mp4"), "--to", 2, "--out", out)
        assert "nano: layout yolox" in done.err
        assert len(harness.read_json(out)) == 2


class TestWithoutModel(WithServer):
    @pytest.fixture(autouse=True)
    def with_images(self, with_server):
        self.images = os.path.join(self.home, "images")
        subprocess.run([harness.EXTRACT, os.path.join(harness.SAMPLE, "map_front", "video.mp4"), self.images, "0", "3"], check=True)
        self.command = ["run", self.images, "--camera", "fov:60", "--force"]

    def at_terminal(self, keys):
        """Runs the command at a terminal where `keys` are typed: its exit status and what the terminal shows."""
        process, terminal = pty.fork()
        if process == 0:
            os.execv(harness.BINARY, [harness.BINARY, *self.command])
        with os.fdopen(terminal, "r+b", buffering=0) as screen:
            shown, typed = b"", False
            with contextlib.suppress(OSError):  # the end of the process ends the terminal
                while part := screen.read(4096):
                    shown += part
                    if b"[y/N]" in shown and not typed:
                        typed = True
                        screen.write(keys)
        return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), shown.decode()

    def test_points_alone_and_a_hint(self):
        done = must_run(*self.command)
        assert done.err.count("oaslam models get yolox_nano") == 1
        assert "[y/N]" not in done.err
        assert "oaslam models get" not in oaslam(*self.command, "--detector", "none").err
        assert self.server.requests == []
        assert not os.path.exists(os.path.join(self.home, "state"))

    def test_the_hint_names_one_that_is_here(self):
        os.makedirs(self.models)
        with open(os.path.join(self.models, "museum.onnx"), "wb") as f:
            f.write(ONNX)
        done = must_run(*self.command)
        assert "points alone" in done.err
        assert "--detector museum uses" in done.err

    def test_asked_once(self):
        code, shown = self.at_terminal(b"n\n")
        assert code == 0, shown
        assert "Fetch yolox_nano (0.6 MB, CC0-1.0, from " + self.server.url in shown
        assert "points alone" in shown
        code, shown = self.at_terminal(b"y\n")
        assert code == 0, shown
        assert "[y/N]" not in shown
        assert self.server.requests == []

    def test_fetched_where_it_is_wanted(self):
        code, shown = self.at_terminal(b"y\n")
        assert harness.read_bytes(os.path.join(self.models, "yolox_nano.onnx")) == CONTENT
        assert code == 1, shown  # the run uses what it fetched, which is noise and no network
        assert "yolox_nano.onnx: not an ONNX file" in shown

    def test_points_alone_where_it_cannot_be_fetched(self):
        self.server.status = 404
        code, shown = self.at_terminal(b"y\n")
        assert code == 0, shown
        assert "status 404" in shown
        assert "points alone" in shown

    def test_never_asked_where_the_answer_cannot_be_kept(self):
        with open(os.path.join(self.home, "state"), "w"):
            pass
        code, shown = self.at_terminal(b"y\n")
        assert code == 0, shown
        assert "[y/N]" not in shown


class TestBuiltIn:
    def test_the_catalogue(self):
        listed = must_run("models")
        for name, size in (("yolox_nano (default)", "3.7"), ("yolox_tiny", "20.2"), ("yolox_s", "35.9")):
            assert (f"{name}: the 80 classes of COCO, {size} MB, Apache-2.0 (Megvii)\n  published at "
                          f"https://github.com/Megvii-BaseDetection/YOLOX/releases/download/0.1.1rc0/{name.split()[0]}.onnx\n") in listed.out
