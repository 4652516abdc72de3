"""oaslam objects: listing and editing the objects of a map."""
import os
import shutil
import unittest

import harness
from harness import oaslam


class Objects(harness.InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.out, cls.map = os.path.join(cls.folder, "out"), os.path.join(cls.folder, "desk.map")
        done = oaslam("map-objects", "--trajectory", harness.groundtruth("map_front"), *harness.clip("map_front")[2:], "--out", cls.out, "--map-out", cls.map)
        assert done.code == 0, done
        cls.objects = harness.read_json(os.path.join(cls.out, "objects.json"))

    def listed(self, path):
        outcome = oaslam("objects", path)
        self.assertEqual(outcome.code, 0, outcome)
        return {int(line.split()[0]): line for line in outcome.out.splitlines()[1:-1]}

    def test_lists_what_the_run_wrote(self):
        listed = self.listed(self.map)
        self.assertEqual(set(listed), {o["id"] for o in self.objects})
        for o in self.objects:
            self.assertIn(o["category"], listed[o["id"]])

    def test_rename_delete_and_merge(self):
        edited = os.path.join(self.folder, "edited.map")
        cups = [o["id"] for o in self.objects if o["category"] == "cup"]
        bear = next(o["id"] for o in self.objects if o["category"] == "teddy bear")
        outcome = oaslam("objects", self.map, "--rename", f"{cups[0]}=my cup", "--merge", f"{cups[0]},{cups[1]}", "--delete", bear, "--out", edited)
        self.assertEqual(outcome.code, 0, outcome)
        listed = self.listed(edited)
        self.assertEqual(set(listed), {o["id"] for o in self.objects} - {cups[1], bear})
        self.assertIn("my cup", listed[cups[0]])
        self.assertEqual(len(self.listed(self.map)), len(self.objects))
        # The edited map is a map: the camera is found in it, and results carry the name.
        found = oaslam("localize", "--map", edited, *harness.clip("query_around"), "--to", "20", "--relocalization", "objects", "--every-frame", "--out", self.out)
        self.assertEqual(found.code, 0, found)
        self.assertGreater(len(harness.read_tum(os.path.join(self.out, "poses.txt"))), 10)

    def test_in_place(self):
        copy = os.path.join(self.folder, "copy.map")
        shutil.copy(self.map, copy)
        one = self.objects[0]["id"]
        self.assertEqual(oaslam("objects", copy, "--delete", one).code, 0)
        self.assertNotIn(one, self.listed(copy))

    def test_bad_input_changes_nothing(self):
        before = harness.read_bytes(self.map)
        cup = next(o["id"] for o in self.objects if o["category"] == "cup")
        book = next(o["id"] for o in self.objects if o["category"] == "book")
        for options, words in ((("--delete", "99"), "no object 99"), (("--delete", "x"), "not the id"), (("--rename", "1"), "ID=NAME"), (("--merge", f"{cup},{book}"), "two classes"),
                               (("--merge", f"{cup},{cup}"), "both ids are of one object"), (("--merge", "3"), "ID,ID"), (("--rename", f"{cup}=a", "--delete", "99"), "no object 99")):
            outcome = oaslam("objects", self.map, *options)
            self.assertEqual(outcome.code, 1, outcome)
            self.assertIn(words, outcome.err)
            self.assertEqual(harness.read_bytes(self.map), before)
        self.assertNotEqual(oaslam("objects", os.path.join(self.folder, "none.map")).code, 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
