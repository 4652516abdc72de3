"""oaslam objects: listing and editing the objects of a map."""
import os
import shutil

import harness
from harness import must_run, oaslam


class TestObjects(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.out, cls.map = os.path.join(cls.folder, "out"), os.path.join(cls.folder, "desk.map")
        must_run("map-objects", "--trajectory", harness.groundtruth("map_front"), *harness.clip("map_front")[2:], "--out", cls.out, "--map-out", cls.map)
        cls.objects = harness.read_json(os.path.join(cls.out, "objects.json"))

    def listed(self, path):
        outcome = must_run("objects", path)
        return {int(line.split()[0]): line for line in outcome.out.splitlines()[1:-1]}

    def test_lists_what_the_run_wrote(self):
        listed = self.listed(self.map)
        assert set(listed) == {o["id"] for o in self.objects}
        for o in self.objects:
            assert o["category"] in listed[o["id"]]

    def test_rename_delete_and_merge(self):
        edited = os.path.join(self.folder, "edited.map")
        cups = [o["id"] for o in self.objects if o["category"] == "cup"]
        bear = next(o["id"] for o in self.objects if o["category"] == "teddy bear")
        must_run("objects", self.map, "--rename", f"{cups[0]}=my cup", "--merge", f"{cups[0]},{cups[1]}", "--delete", bear, "--out", edited)
        listed = self.listed(edited)
        assert set(listed) == {o["id"] for o in self.objects} - {cups[1], bear}
        assert "my cup" in listed[cups[0]]
        assert len(self.listed(self.map)) == len(self.objects)
        # The edited map is a map: the camera is found in it, and results carry the name.
        must_run("localize", "--map", edited, *harness.clip("query_around"), "--to", "20", "--relocalization", "objects", "--every-frame", "--out", self.out)
        assert len(harness.read_tum(os.path.join(self.out, "poses.txt"))) > 10

    def test_in_place(self):
        copy = os.path.join(self.folder, "copy.map")
        shutil.copy(self.map, copy)
        one = self.objects[0]["id"]
        assert oaslam("objects", copy, "--delete", one).code == 0
        assert one not in self.listed(copy)

    def test_bad_input_changes_nothing(self):
        before = harness.read_bytes(self.map)
        cup = next(o["id"] for o in self.objects if o["category"] == "cup")
        book = next(o["id"] for o in self.objects if o["category"] == "book")
        for options, words in ((("--delete", "99"), "no object 99"), (("--delete", "x"), "not the id"), (("--rename", "1"), "ID=NAME"), (("--merge", f"{cup},{book}"), "two classes"),
                               (("--merge", f"{cup},{cup}"), "both ids are of one object"), (("--merge", "3"), "ID,ID"), (("--rename", f"{cup}=a", "--delete", "99"), "no object 99")):
            outcome = oaslam("objects", self.map, *options)
            assert outcome.code == 1, outcome
            assert words in outcome.err
            assert harness.read_bytes(self.map) == before
        assert oaslam("objects", os.path.join(self.folder, "none.map")).code != 0
