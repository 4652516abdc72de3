"""Bare systems of Debian for the tests of packages and of other processors. Needs root, debootstrap and Debian's registry, with the settings of apt on
this machine."""
import atexit
import glob
import os
import shlex
import shutil
import subprocess
import sys
import time

SOURCE = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
MIRROR = "http://deb.debian.org/debian"


class Chroot:
    """A copy of the bare system of a suite, removed at the end."""

    def __init__(self, root, suite, name):
        os.makedirs(root, exist_ok=True)
        bare = os.path.join(root, suite)
        if not os.path.exists(os.path.join(bare, "complete")):
            shutil.rmtree(bare, ignore_errors=True)
            subprocess.run(["debootstrap", "--variant=minbase", suite, bare, MIRROR], check=True, stdout=subprocess.DEVNULL)
            for file in ["/etc/resolv.conf", *glob.glob("/etc/apt/apt.conf.d/99*")]:
                shutil.copy(file, bare + file)
            open(os.path.join(bare, "complete"), "w").close()
        self.path = os.path.join(root, f"{suite}-{name}")
        shutil.rmtree(self.path, ignore_errors=True)
        subprocess.run(["cp", "-a", bare, self.path], check=True)
        subprocess.run(["mount", "-t", "proc", "proc", self.path + "/proc"], check=True)
        atexit.register(self.remove)

    def remove(self):
        subprocess.run(["umount", self.path + "/proc"], check=True)
        shutil.rmtree(self.path)

    def command(self, command, user):
        home = "/root" if user == "root" else f"/home/{user}"
        return ["chroot", f"--userspec={user}", self.path, "env", "-i", f"HOME={home}", "LANG=C.UTF-8", "DEBIAN_FRONTEND=noninteractive",
                "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "sh", "-ec", command]

    def run(self, command, quiet=False, user="root", folder="/"):
        """Runs it as a transcript; with `quiet` its output is only shown where it fails."""
        print(f"$ {command}", flush=True)
        start = time.monotonic()
        done = subprocess.run(self.command(f"cd {shlex.quote(folder)}\n{command}", user), stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode or not quiet:
            print(done.stdout, end="")
        print(f"[{time.monotonic() - start:.0f} s]", flush=True)
        if done.returncode:
            refuse(f"exit status {done.returncode}: {command}")

    def write(self, path, text):
        with open(self.path + path, "w") as f:
            f.write(text)


def refuse(message):
    sys.exit(f"{os.path.basename(sys.argv[0])}: {message}")


def need_root_and_debootstrap():
    if not shutil.which("debootstrap"):
        refuse("debootstrap is not installed (apt-get install debootstrap)")
    if os.geteuid() != 0:
        refuse("only root can make a chroot")


def copy_source(to):
    """What git knows of the working tree, as it is now."""
    for file in subprocess.run(["git", "-C", SOURCE, "ls-files", "-z"], check=True, capture_output=True, text=True).stdout.split("\0"):
        if file and os.path.exists(os.path.join(SOURCE, file)):
            os.makedirs(os.path.dirname(os.path.join(to, file)), exist_ok=True)
            shutil.copy(os.path.join(SOURCE, file), os.path.join(to, file))
