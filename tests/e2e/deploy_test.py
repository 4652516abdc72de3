"""The files of server/deploy/: the systemd unit is right and its command works as it stands, HAProxy takes its configuration."""
import os
import shlex
import shutil
import signal
import subprocess

import cluster
import harness
import pytest

DEPLOY = os.path.join(harness.SAMPLE, "..", "..", "server", "deploy")


def unit():
    """[(key, value)] of the lines of the unit."""
    with open(os.path.join(DEPLOY, "oaslam.service")) as f:
        return [tuple(line.strip().split("=", 1)) for line in f if "=" in line and not line.startswith("#")]


def as_systemd(line, environment):
    """The words of an ExecStart line: ${NAME} is put in as it is, $NAME becomes words of its own (systemd.service(5))."""
    words = []
    for word in shlex.split(line):
        if word.startswith("$") and not word.startswith("${"):
            words += environment[word[1:]].split()
        else:
            for name, value in environment.items():
                word = word.replace("${" + name + "}", value)
            words.append(word)
    return words


class TestDeploy(harness.InFolder):
    @pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="there is no systemd-analyze")
    def test_the_unit_is_valid(self):
        path = self.path("oaslam.service")
        with open(path, "w") as f:
            f.write(harness.read_bytes(os.path.join(DEPLOY, "oaslam.service")).decode().replace("/usr/bin/oaslam-server", harness.BINARY + "-server"))
        done = subprocess.run(["systemd-analyze", "verify", path], capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, "")

    @pytest.mark.skipif("oaslam serve" in cluster.missing(), reason="there is no oaslam serve")
    def test_the_command_of_the_unit_serves_and_ends_by_its_signal(self, request):
        port = cluster.free_port()
        environment = dict(value.split("=", 1) for key, value in unit() if key == "Environment")
        environment |= {"OASLAM_MAPS": self.path("maps"), "OASLAM_PORT": str(port), "OASLAM_OPTIONS": "--memory 500", "CREDENTIALS_DIRECTORY": self.folder}
        os.mkdir(self.path("maps"))
        with open(self.path("tokens"), "w") as f:
            f.write(f"read {cluster.READ}\nwrite {cluster.WRITE}\n")
        os.chmod(self.path("tokens"), 0o600)
        settings = dict(unit())
        command = as_systemd(settings["ExecStart"], environment)
        assert command[0] == "/usr/bin/oaslam-server"
        process = subprocess.Popen([harness.BINARY + "-server", *command[1:]])
        request.addfinalizer(process.kill)

        def is_healthy():
            assert process.poll() is None
            try:
                return cluster.once(cluster.Client(port), "GET", "/healthz").status == 200
            except OSError:
                return False
        cluster.wait_until(is_healthy, 20, "the server answers")
        assert cluster.once(cluster.Client(port), "GET", "/v1/maps").json() == {"maps": []}
        process.send_signal(getattr(signal, settings["KillSignal"]))
        assert process.wait(timeout=int(settings["TimeoutStopSec"])) == 0

    @pytest.mark.skipif(not (cluster.HAPROXY and shutil.which("openssl")), reason="there is no HAProxy or no openssl")
    def test_haproxy_takes_its_configuration(self):
        pem, config = self.path("oaslam.pem"), self.path("haproxy.cfg")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-keyout", pem + "1", "-out", pem + "2"],
                       check=True, capture_output=True)
        with open(pem, "wb") as f:
            f.write(harness.read_bytes(pem + "1") + harness.read_bytes(pem + "2"))
        with open(config, "w") as f:
            f.write(harness.read_bytes(os.path.join(DEPLOY, "haproxy.cfg")).decode().replace("/etc/haproxy/oaslam.pem", pem))
        done = subprocess.run([cluster.HAPROXY, "-c", "-f", config], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done
        assert "WARNING" not in done.stderr
