"""Bare systems of Debian for the tests of packages and of other processors. Needs root, debootstrap and Debian's registry, with the settings of apt on
this machine."""
import atexit
import fcntl
import glob
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time

SOURCE = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
MIRROR = "http://deb.debian.org/debian"


class Chroot:
    """A copy of the bare system of a suite, removed at the end."""

    def __init__(self, root, suite, name):
        bare = os.path.join(root, suite)
        if not os.path.exists(os.path.join(bare, "complete")):
            remove_tree(bare)
            subprocess.run(["debootstrap", "--variant=minbase", suite, bare, MIRROR], check=True, stdout=subprocess.DEVNULL)
            for file in ["/etc/resolv.conf", *glob.glob("/etc/apt/apt.conf.d/99*")]:
                shutil.copy(file, bare + file)
            open(os.path.join(bare, "complete"), "w").close()
        self.path = os.path.realpath(os.path.join(root, f"{suite}-{name}"))
        self.remove()  # left by a run that was killed
        atexit.register(self.remove)
        subprocess.run(["cp", "-a", bare, self.path], check=True)
        subprocess.run(["mount", "-t", "proc", "proc", self.path + "/proc"], check=True)

    def processes(self):
        """The ids of the processes that run in it."""
        for process in glob.glob("/proc/[0-9]*"):
            try:
                if os.readlink(process + "/root") == self.path:
                    yield int(os.path.basename(process))
            except OSError:
                pass  # it has ended, or belongs to another user

    def remove(self):
        while running := list(self.processes()):
            subprocess.run(["kill", "-9", *map(str, running)], stderr=subprocess.DEVNULL)
            time.sleep(0.1)
        remove_tree(self.path)

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


def remove_tree(system):
    """Removes a system, and never what is mounted in it, also where debootstrap or a run was killed."""
    for folder in ("proc", "sys"):
        if os.path.ismount(os.path.join(system, folder)):
            subprocess.run(["umount", os.path.join(system, folder)], check=True)
    if os.path.exists(system):
        shutil.rmtree(system)


def refuse(message):
    sys.exit(f"{os.path.basename(sys.argv[0])}: {message}")


def claim(root):
    """Makes this run the only one that works below `root`, until it ends, and lets SIGTERM end it as Ctrl-C does, with its chroots removed."""
    if not shutil.which("debootstrap"):
        refuse("debootstrap is not installed (apt-get install debootstrap)")
    if os.geteuid() != 0:
        refuse("only root can make a chroot")
    os.makedirs(root, exist_ok=True)
    claim.lock = open(os.path.join(root, "lock"), "w")  # kept open, and with it the lock
    try:
        fcntl.flock(claim.lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        refuse(f"--root {root}: another run works there")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))


def copy_source(to):
    """What git knows of the working tree, as it is now."""
    for file in subprocess.run(["git", "-C", SOURCE, "ls-files", "-z"], check=True, capture_output=True, text=True).stdout.split("\0"):
        if file and os.path.exists(os.path.join(SOURCE, file)):
            os.makedirs(os.path.dirname(os.path.join(to, file)), exist_ok=True)
            shutil.copy(os.path.join(SOURCE, file), os.path.join(to, file))
