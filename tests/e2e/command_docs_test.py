"""The manual page and the completions that tools/command_docs writes, tried in real shells."""
import gzip
import os
import pty
import re
import select
import shutil
import subprocess
import time

import harness
import pytest

TOOL = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "tools", "command_docs")


class Shell:
    """An interactive shell in a terminal."""

    def __init__(self, folder, *command):
        self.process, self.terminal = pty.fork()
        if self.process == 0:
            os.chdir(folder)
            os.execvpe(command[0], command, {"PATH": os.environ["PATH"], "HOME": folder, "TERM": "dumb", "PS1": "$ "})

    def close(self):
        os.close(self.terminal)
        os.waitpid(self.process, 0)

    def send(self, text):
        os.write(self.terminal, text.encode())

    def read_until(self, pattern, seconds=20):
        text, end = "", time.time() + seconds
        while not (found := re.search(pattern, text, re.S)):
            if not select.select([self.terminal], [], [], max(0, end - time.time()))[0]:
                raise AssertionError(f"not said within {seconds} s: {pattern}\n{text}")
            text += os.read(self.terminal, 4096).decode(errors="replace")
        return found

    def run(self, line):
        """A command line; returns when the shell has done it."""
        self.send(line + "; echo do''ne\r")
        self.read_until("done\r?\n")

    def completed(self, line):
        """The words of the line after the tabulator key."""
        self.send(line + "\t")
        # What is there is made the arguments of a command that shows them.
        self.send("\x01printf '<%s>' s''how \x05; echo e''nd\r")
        return re.findall("<(.*?)>", self.read_until(r"<show>(.*?)end\r?\n")[1])


VIEWER = os.path.join(os.path.dirname(harness.BINARY), "oaslam-viewer")  # has the options of all commands


class TestCommandDocs(harness.InFolder):
    @classmethod
    def prepare(cls):
        done = subprocess.run([TOOL, VIEWER, cls.folder], capture_output=True, text=True)
        assert done.returncode == 0, done
        cls.work = cls.path("work")
        os.makedirs(os.path.join(cls.work, "walks"))
        for name in ("walk one.mp4", "walks/kitchen.mp4"):
            open(os.path.join(cls.work, name), "w").close()

    def check_shell(self, shell):
        self.cleanup.callback(shell.close)
        for line, words in (("oaslam ser", "serve"), ("oaslam evaluate traj", "evaluate trajectory"), ("oaslam evaluate trajectory --pl", "evaluate trajectory --plot"),
                            ("oaslam run --detector-ba", "run --detector-backend"), ("oaslam run --detector-backend on", "run --detector-backend onnxruntime"),
                            ("oaslam run --quiet --resu", "run --quiet --resu"), ("oaslam detect --resu", "detect --resume"),
                            ("oaslam run --camera walks/k", "run --camera walks/kitchen.mp4"), ("oaslam run walks/k", "run walks/kitchen.mp4"),
                            ("oaslam merge --relocalization obj", "merge --relocalization objects"),
                            ("oaslam evaluate relocalization --poses a --pos", "evaluate relocalization --poses a --poses"),
                            ("oaslam objects --rename walks/k", "objects --rename walks/k"), ("oaslam run --seed walks/k", "run --seed walks/k"), ("oaslam run --viewer walks/k", "run --viewer walks/kitchen.mp4")):
            assert shell.completed(line) == ["oaslam", *words.split()], line
        assert shell.completed("oaslam view walk\\ ") == ["oaslam", "view", "walk one.mp4"]

    @pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
    def test_bash_completes_commands_options_values_and_files(self):
        shell = Shell(self.work, "bash", "--norc", "--noprofile", "-i")
        shell.run("bind 'set bell-style none'")
        shell.run(f". {self.path('bash/oaslam')}")
        self.check_shell(shell)

    @pytest.mark.skipif(not shutil.which("zsh"), reason="there is no zsh")
    def test_zsh_completes_commands_options_values_and_files(self):
        shell = Shell(self.work, "zsh", "-f", "-i")
        shell.run(f"unsetopt zle_bracketed_paste beep list_beep; bindkey -e; fpath=({self.path('zsh')} $fpath); autoload -Uz compinit; compinit -u -D")
        self.check_shell(shell)

    def commands(self, path=()):
        option = "--help-all" if path in (("run",), ("localize",)) else "--help"
        text = subprocess.run([VIEWER, *path, option], capture_output=True, text=True, check=True).stdout
        yield path, text
        if "\nSubcommands:\n" in text:
            for name in re.findall(r"^  ([\w-]+)", text.split("\nSubcommands:\n")[1], re.M):
                yield from self.commands((*path, name))

    def test_the_manual_page_has_every_command_and_option(self):
        page = gzip.decompress(harness.read_bytes(self.path("man/oaslam.1.gz"))).decode()
        plain = re.sub(r"\\f[BIR]", "", page).replace("\\-", "-")
        sections = {title: text for title, text in re.findall(r'^\.SS "oaslam (.*?)"\n(.*?)(?=^\.S[SH])', plain, re.M | re.S)}
        for path, text in self.commands():
            if path:
                assert " ".join(path) in sections
            if path and "SUBCOMMAND" not in text:
                options = set(re.findall(r"^  (--[\w-]+)", text, re.M))
                assert set(re.findall(r"^\.TP\n(--[\w-]+)", sections[" ".join(path)], re.M)) == options, path
        assert "--align TEXT\nHow the estimate is fitted to the ground truth first (one of sim3, se3, none; sim3 unless given)" in plain
        assert "--viewer\n" in plain and "--port INT\n" in plain

    @pytest.mark.skipif(not shutil.which("man"), reason="there is no man")
    def test_the_manual_page_is_formatted_without_warnings(self):
        done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", self.path("man/oaslam.1.gz")], capture_output=True, text=True,
                              env={**os.environ, "MANROFFSEQ": "", "LC_ALL": "C.UTF-8"})
        assert (done.returncode, done.stderr) == (0, "")
