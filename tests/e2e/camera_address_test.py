"""Cameras by their address, against servers on this machine: MJPEG, MPEG-TS and HLS over HTTP."""
import contextlib
import http.server
import os
import shutil
import signal
import socket
import struct
import subprocess
import threading
import time

import harness
import pytest
from harness import must_run, oaslam

FRAMES = 90
FFMPEG = shutil.which("ffmpeg")
pytestmark = pytest.mark.skipif(FFMPEG is None, reason="needs ffmpeg")


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


class RtspServer:
    """A network camera: RTSP with RTP over the same connection (RFC 2326, 10.12), its film as MPEG-TS (RFC 2250)."""

    def __init__(self, video, password=None):
        self.video, self.password, self.transports = video, password, []
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.url = f"127.0.0.1:{self.socket.getsockname()[1]}/live"
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=self.talk, args=(self.socket.accept()[0],), daemon=True).start()

    def talk(self, connection):
        stream = connection.makefile("rwb")
        sdp = b"v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=camera\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\nm=video 0 RTP/AVP 33\r\na=control:track\r\n"
        with contextlib.suppress(OSError, ValueError):
            while request := stream.readline():
                headers = {}
                while (line := stream.readline().strip()):
                    name, _, value = line.decode().partition(":")
                    headers[name.lower()] = value.strip()
                method, body, extra = request.split()[0], b"", ""
                if method == b"DESCRIBE":
                    body, extra = sdp, "Content-Type: application/sdp\r\n"
                elif method == b"SETUP":
                    self.transports.append(headers["transport"])
                    extra = f"Transport: {headers['transport'].split(',')[0]}\r\nSession: 1\r\n"
                elif method == b"OPTIONS":
                    extra = "Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN\r\n"
                stream.write(f"RTSP/1.0 200 OK\r\nCSeq: {headers['cseq']}\r\n{extra}Content-Length: {len(body)}\r\n\r\n".encode() + body)
                stream.flush()
                if method == b"PLAY":
                    self.play(stream)
                    return connection.close()

    def play(self, stream):
        sender = subprocess.Popen([FFMPEG, "-loglevel", "quiet", "-re", "-i", self.video, "-t", "4", "-c:v", "mpeg2video", "-q:v", "3", "-f", "mpegts", "-"], stdout=subprocess.PIPE)
        try:
            for number, packets in enumerate(iter(lambda: sender.stdout.read(7 * 188), b"")):
                rtp = struct.pack(">BBHII", 0x80, 33, number % 65536, int(time.monotonic() * 90000) % 2**32, 1) + packets
                stream.write(b"$\0" + struct.pack(">H", len(rtp)) + rtp)
                stream.flush()
        finally:
            sender.kill()
            sender.wait()

    def close(self):
        self.socket.close()


class TestCameraAddress(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.video, cls.camera = harness.clip("map_front")[1], harness.clip("map_front")[3]
        os.mkdir(cls.path("jpegs"))
        subprocess.run([FFMPEG, "-loglevel", "error", "-i", cls.video, "-frames:v", str(FRAMES), "-q:v", "3", cls.path("jpegs/%04d.jpg")], check=True)
        cls.jpegs = [harness.read_bytes(cls.path(f"jpegs/{name}")) for name in sorted(os.listdir(cls.path("jpegs")))]

    @pytest.fixture(autouse=True)
    def each_in_a_folder(self, tmp_path):
        self.at = str(tmp_path)

    @contextlib.contextmanager
    def mjpeg(self, per_connection=FRAMES, fps=30, port=0, connections=None, silent=False):
        """A camera that sends its images as multipart, and breaks off after some."""
        jpegs, state = self.jpegs, {"next": 0, "connections": 0}

        class Handler(http.server.BaseHTTPRequestHandler):
            def log_message(self, *_):
                pass

            def do_GET(self):
                state["connections"] += 1
                if connections is not None and state["connections"] > connections:
                    return self.send_error(503)
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=image")
                self.end_headers()
                with contextlib.suppress(OSError):
                    for _ in range(per_connection):
                        if state["next"] >= len(jpegs):
                            break
                        jpeg = jpegs[state["next"]]
                        state["next"] += 1
                        self.wfile.write(b"--image\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(jpeg) + jpeg + b"\r\n")
                        time.sleep(1 / fps)
                    if silent:
                        time.sleep(60)

        server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/video", state
        finally:
            server.shutdown()
            server.server_close()

    def start(self, *command):
        return subprocess.Popen([harness.BINARY, *map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.at)

    def rows(self, out="o"):
        return harness.read_csv(os.path.join(self.at, out, "frames.csv"))

    def test_mjpeg(self):
        with self.mjpeg(fps=20) as (url, _):
            done = must_run("run", "--images", url, "--camera", self.camera, "--to", 60, "--out", os.path.join(self.at, "o"))
        times = [float(r["timestamp"]) for r in self.rows()]
        assert len(times) == 60 and times[0] == 0
        assert 59 / 20 - 0.3 < times[-1] < 59 / 20 + 1.5, times[-1]  # as they arrived
        age = harness.read_json(os.path.join(self.at, "o", "summary.json"))["image_age_s"]
        assert 0 <= age["median"] < 2, done

    def test_a_camera_that_breaks_off_is_connected_again(self):
        with self.mjpeg(per_connection=25) as (url, state):
            done = must_run("run", "--images", url, "--camera", self.camera, "--to", 70, "--out", os.path.join(self.at, "o"))
            assert state["connections"] >= 3
        assert "broke off after" in done.err and "connecting again" in done.err
        times = [float(r["timestamp"]) for r in self.rows()]
        assert times == sorted(set(times)) and len(times) == 70

    @pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM])
    @pytest.mark.parametrize("mode", ["lockstep", "live"])
    def test_a_silent_camera_does_not_hold_it(self, which, mode):
        with self.mjpeg(per_connection=60, silent=True) as (url, _):
            process = self.start("run", "--images", url, "--camera", self.camera, "--mode", mode, "--out", "o", "--map-out", "o.map")
            time.sleep(6)
            begin = time.monotonic()
            process.send_signal(which)
            _, err = process.communicate(timeout=60)
            assert process.returncode == 130, err
            assert time.monotonic() - begin < 6, err  # with what is computed at the end
        assert len(self.rows()) > 10
        assert must_run("info", os.path.join(self.at, "o.map"))

    def test_nothing_there(self):
        url = f"http://user:secret@127.0.0.1:{free_port()}/video"
        done = oaslam("run", "--images", url, "--camera", self.camera, "--out", os.path.join(self.at, "o"))
        assert done.code == 1, done
        assert "cannot be opened: Connection refused" in done.err and "secret" not in done.err
        assert os.listdir(self.at) == []
        with self.mjpeg(connections=0) as (url, _):
            done = oaslam("run", "--images", url, "--camera", self.camera, "--out", os.path.join(self.at, "o"))
            assert done.code == 1 and "cannot be opened" in done.err, done
        for device in ("webcam:973", "/dev/video973", "usb:973"):
            done = oaslam("run", device, "--out", os.path.join(self.at, "o"))
            assert done.code == 1 and device in done.err, done

    def test_a_page_is_no_camera(self):
        with open(os.path.join(self.at, "index.html"), "w") as f:
            f.write("<html>Camera</html>")
        with self.files() as url:
            done = oaslam("run", "--images", f"{url}/index.html", "--camera", self.camera, "--out", os.path.join(self.at, "o"))
        assert done.code == 1 and "index.html: cannot be opened: Invalid data" in done.err, done

    @contextlib.contextmanager
    def files(self):
        folder = self.at

        class Handler(http.server.SimpleHTTPRequestHandler):
            def __init__(self, *args):
                super().__init__(*args, directory=folder)

            def log_message(self, *_):
                pass

        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            server.server_close()

    def test_a_film_at_an_address_ends(self):
        shutil.copy(self.video, os.path.join(self.at, "walk.mp4"))
        with self.files() as url:
            must_run("run", "--images", f"{url}/walk.mp4", "--camera", self.camera, "--out", os.path.join(self.at, "o"))
        must_run("run", "--images", self.video, "--camera", self.camera, "--out", os.path.join(self.at, "file"))
        assert [r["timestamp"] for r in self.rows()] == [r["timestamp"] for r in self.rows("file")]

    def test_the_plain_form_is_live(self):
        port = free_port()
        sender = subprocess.Popen([FFMPEG, "-loglevel", "error", "-re", "-stream_loop", "-1", "-i", self.video, "-c:v", "mpeg2video", "-q:v", "3", "-f", "mpegts", "-listen", "1", f"http://127.0.0.1:{port}"])
        try:
            time.sleep(1)
            process = self.start("run", f"http://127.0.0.1:{port}", "--detector", "none", "--camera", self.camera)
            time.sleep(5)
            process.send_signal(signal.SIGTERM)
            _, err = process.communicate(timeout=60)
            assert process.returncode == 130 and "live: images that come too late are dropped" in err, err
        finally:
            sender.kill()
            sender.wait()
        out = f"http_127.0.0.1_{port}.oaslam"
        assert os.path.exists(os.path.join(self.at, out)), os.listdir(self.at)
        times = [float(r["timestamp"]) for r in self.rows(out)]
        # The stream's own times: multiples of the film's interval.
        assert len(times) > 20
        steps = [b - a for a, b in zip(times, times[1:])]
        assert all(abs(step * 30 - round(step * 30)) < 0.02 for step in steps), steps

    def test_hls(self):
        subprocess.run([FFMPEG, "-loglevel", "error", "-i", self.video, "-t", "3", "-c:v", "mpeg2video", "-q:v", "3", "-f", "hls", "-hls_time", "1", "-hls_list_size", "0",
                        os.path.join(self.at, "live.m3u8")], check=True)
        with self.files() as url:
            must_run("run", "--images", f"{url}/live.m3u8", "--camera", self.camera, "--out", os.path.join(self.at, "o"))
        rows = self.rows()
        assert len(rows) > 80
        assert abs(float(rows[-1]["timestamp"]) * 30 - (len(rows) - 1)) < 0.5

    def test_rtsp(self):
        server = RtspServer(self.video)
        with contextlib.closing(server):
            done = must_run("run", "--images", f"rtsp://user:secret@{server.url}", "--camera", self.camera, "--to", 150, "--out", os.path.join(self.at, "o"))
        assert "TCP" in server.transports[0] and len(server.transports) >= 2  # it broke off after 4 s, and was there again
        assert "secret" not in done.err + done.out
        times = [float(r["timestamp"]) for r in self.rows()]
        assert len(times) == 150
        steps = [b - a for a, b in zip(times, times[1:])]
        assert sum(abs(step - 1 / 30) < 0.002 for step in steps) > 140, steps
