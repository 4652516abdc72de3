"""One map, several programs: each edit is in the file in the end, or its program has said that it is not; a run overwrites nobody's map; a program that is killed leaves a sound map."""
import contextlib
import fcntl
import glob
import os
import random
import re
import shutil
import sqlite3
import subprocess
import time

import harness
import pytest
from harness import must_run, oaslam

OBJECT = harness.read_json(os.path.join(harness.DESK, "objects.json"))[0]["id"] if os.path.exists(harness.DESK) else 0


def start(*command):
    return subprocess.Popen([harness.BINARY, *map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def place(map_file, name):
    return ["anchors", map_file, "--place", f"{name}=flag@keyframe:0:320,240", "--quiet"]


def anchors(map_file):
    return {line.split()[0] for line in must_run("anchors", map_file).out.splitlines()[1:-1]}


def recordings(map_file):
    with contextlib.closing(sqlite3.connect(f"file:{map_file}?mode=ro", uri=True)) as file:
        return file.execute("SELECT count(*) FROM recordings").fetchone()[0]


def wait_for(path):
    end = time.monotonic() + 60
    while not os.path.exists(path):
        assert time.monotonic() < end
        time.sleep(0.01)


class TestTwoWriters(harness.InFolder):
    @pytest.fixture(autouse=True)
    def each_with_a_map(self, tmp_path):
        self.at = str(tmp_path)
        self.map = shutil.copy(harness.DESK_MAP, os.path.join(self.at, "a.map"))

    def files(self):
        return sorted(name for name in os.listdir(self.at) if os.path.isfile(os.path.join(self.at, name)))

    def run(self, name, map_out, *options, frames=(0, 60)):
        """Starts a run, and waits until it has begun."""
        out = os.path.join(self.at, name)
        process = start("run", *harness.clip("map_front"), "--from", frames[0], "--to", frames[1], "--out", out, "--map-out", map_out, "--quiet", *options)
        wait_for(out)
        return process

    def test_no_edit_is_lost(self):
        edits = [start(*place(self.map, f"p{i}")) for i in range(6)]
        edits += [start("objects", self.map, "--rename", f"{OBJECT}=mine", "--quiet")]
        for edit in edits:
            _, err = edit.communicate(timeout=60)
            assert edit.returncode == 0, err
        assert anchors(self.map) == {f"p{i}" for i in range(6)}
        assert " mine " in must_run("objects", self.map).out
        assert self.files() == ["a.map"]

    def test_a_run_takes_over_what_was_edited_meanwhile(self):
        must_run(*place(self.map, "old"))
        run = self.run("out", self.map, "--map-in", self.map, frames=(0, 100))
        must_run(*place(self.map, "new"))
        must_run("anchors", self.map, "--delete", "old", "--quiet")
        must_run("objects", self.map, "--rename", f"{OBJECT}=mine", "--quiet")
        assert run.poll() is None
        _, err = run.communicate(timeout=120)
        assert run.returncode == 0, err
        assert anchors(self.map) == {"new"}
        assert " mine " in must_run("objects", self.map).out
        assert any(o["name"] == "mine" for o in harness.read_json(os.path.join(self.at, "out", "objects.json")))
        assert recordings(self.map) == 2
        assert self.files() == ["a.map"]

    @pytest.mark.parametrize("continues", [True, False])
    def test_two_runs_both_have_their_map(self, continues):
        """That of the one which ends last is beside the other's, also where the file is new for both."""
        target = self.map if continues else os.path.join(self.at, "new.map")
        options = ["--map-in", self.map] if continues else []
        runs = [self.run(f"out{i}", target, *options, frames=frames) for i, frames in enumerate([(0, 60), (60, 160)])]
        errors = [run.communicate(timeout=120)[1] for run in runs]
        assert sorted(run.returncode for run in runs) == [0, 1], errors
        beside = target.replace(".map", "-2.map")
        assert f"{target}: it stays as it is, and the new map is in {beside}: another program has written it meanwhile" in "".join(errors)
        for map_file in (target, beside):
            must_run("info", map_file)
        assert self.files() == sorted({"a.map", os.path.basename(target), os.path.basename(beside)})

    def test_a_map_that_another_program_has_put_there_stays(self):
        other = os.path.join(self.at, "other.map")
        must_run("run", *harness.clip("map_front"), "--to", 40, "--out", os.path.join(self.at, "other"), "--map-out", other, "--quiet")
        run = self.run("out", self.map, "--map-in", self.map)
        os.replace(other, self.map)  # by a program that knows no lock
        content = harness.read_bytes(self.map)
        assert run.poll() is None
        _, err = run.communicate(timeout=120)
        assert run.returncode == 1 and "it stays as it is" in err, err
        assert harness.read_bytes(self.map) == content
        must_run("info", os.path.join(self.at, "a-2.map"))

    def test_merge_takes_over_what_was_edited_meanwhile(self):
        other = os.path.join(self.at, "b.map")
        must_run("run", *harness.clip("map_front"), "--to", 200, "--out", os.path.join(self.at, "b"), "--map-out", other, "--quiet")
        merging = start("merge", self.map, other, "--out", self.map, "--quiet")
        placing = start(*place(self.map, "meanwhile"))
        assert placing.wait(60) == 0 and merging.wait(120) == 0, merging.stderr.read()
        assert anchors(self.map) == {"meanwhile"}

    def test_killed_at_any_time(self):
        """The map is the old or the new one, and the next edit is not held up."""
        rng = random.Random(5)
        took = time.monotonic()
        must_run(*place(self.map, "first"))
        took = time.monotonic() - took
        begun = 0
        for i in range(8):
            edit = start(*place(self.map, f"k{i}"))
            time.sleep(rng.uniform(0, took))
            begun += edit.poll() is None
            edit.kill()
            edit.communicate()
            assert {"first"} <= anchors(self.map) <= {"first", *(f"k{j}" for j in range(i + 1))}
        assert begun > 0
        must_run(*place(self.map, "last"), timeout=20)
        assert {"first", "last"} <= anchors(self.map)
        assert self.files() == ["a.map"]

    def test_who_waits_says_for_whom(self):
        folder = os.open(self.at, os.O_RDONLY)
        fcntl.flock(folder, fcntl.LOCK_EX)
        edit = start(*place(self.map, "late"))
        said = edit.stderr.readline()
        assert re.search(rf"a\.map: waits for .+ \(process {os.getpid()}\), which writes maps in this folder", said), said
        assert edit.poll() is None
        os.close(folder)
        assert edit.wait(60) == 0, edit.stderr.read()
        assert anchors(self.map) == {"late"}

    def test_a_file_system_without_locks(self):
        edit = subprocess.run([harness.BINARY, *place(self.map, "flag")], env={**os.environ, "LD_PRELOAD": os.environ["OASLAM_FAILING_LOCKS"]}, capture_output=True, text=True, timeout=60)
        assert edit.returncode == 0, edit.stderr
        assert anchors(self.map) == {"flag"}

    def test_a_map_in_a_folder_that_only_lets_itself_be_read(self):
        must_run("anchors", self.map)
        os.chmod(self.at, 0o500)
        try:
            listed = oaslam("anchors", self.map)
            edited = oaslam(*place(self.map, "no"))
        finally:
            os.chmod(self.at, 0o700)
        assert listed.code == 0, listed
        if os.geteuid() != 0:
            assert edited.code == 1 and len(edited.err.strip().splitlines()) == 1, edited
        assert not glob.glob(os.path.join(self.at, "*.tmp"))
