"""A detector with its own classes: from the class file to named objects and to a pose."""
import json
import os

import harness
from harness import must_run, oaslam


def relabelled(path, ids, out):
    """The same boxes as a detector with these ids would give them; classes it does not know are missing."""
    images = harness.read_json(path)
    for image in images:
        image["detections"] = [dict(d, category_id=ids[d["category_id"]]) for d in image["detections"] if d["category_id"] in ids]
    with open(out, "w") as f:
        json.dump(images, f)
    return out


class TestCustomClasses:
    def test_objects_of_own_classes_are_named_saved_and_found_again(self, tmp_path):
        truth = harness.read_json(os.path.join(harness.SAMPLE, "map_front", "objects_gt.json"))["objects"]
        coco = sorted({o["category_id"] for o in truth})
        ids = {category: index for index, category in enumerate(coco)}
        names = {ids[o["category_id"]]: "museum " + o["category"] for o in truth}
        classes = os.path.join(tmp_path, "museum.yaml")
        with open(classes, "w") as f:
            f.write("names:\n" + "".join(f"  {index}: {name}\n" for index, name in sorted(names.items())))
        clips = {clip: relabelled(os.path.join(harness.SAMPLE, clip, "detections.json"), ids, os.path.join(tmp_path, clip + ".json"))
                 for clip in ("map_front", "query_around")}
        mapped, out = os.path.join(tmp_path, "museum.map"), os.path.join(tmp_path, "out")
        must_run("run", *harness.clip("map_front")[:4], "--detections", clips["map_front"], "--classes", classes, "--out", out, "--map-out", mapped)
        objects = harness.read_json(os.path.join(out, "objects.json"))
        assert len(objects) > 15
        for o in objects:
            assert o["category"] == names[o["category_id"]]
        # The map knows the names from now on.
        assert "museum teddy bear" in oaslam("objects", mapped).out
        found = os.path.join(tmp_path, "found")
        must_run("localize", "--map", mapped, *harness.clip("query_around")[2:4], "--detections", clips["query_around"],
                 "--relocalization", "objects", "--out", found)
        assert sum(f["status"] == "objects" for f in harness.read_csv(os.path.join(found, "frames.csv"))) > 0.8 * 300

    def test_boxes_of_other_classes_are_no_evidence(self, tmp_path):
        """Boxes with ids of COCO in a map with other ids: no pose is found, and none is reported."""
        shifted = {category: category + 1000 for category in range(80)}
        boxes = relabelled(os.path.join(harness.SAMPLE, "map_front", "detections.json"), shifted, os.path.join(tmp_path, "boxes.json"))
        mapped = os.path.join(tmp_path, "own.map")
        must_run("map-objects", "--trajectory", harness.groundtruth("map_front"), *harness.clip("map_front")[2:4], "--detections", boxes, "--out",
                 os.path.join(tmp_path, "out"), "--map-out", mapped)
        found = os.path.join(tmp_path, "found")
        must_run("localize", "--map", mapped, *harness.clip("query_around")[2:], "--relocalization", "objects", "--out", found, "--to", "60")
        assert {f["status"] for f in harness.read_csv(os.path.join(found, "frames.csv"))} == {"failed"}
