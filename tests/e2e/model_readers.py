"""Independent readers of exported models: assimp, Khronos' glTF validator, and PLY by hand."""
import json
import os
import re
import struct
import subprocess

import harness
import numpy as np

NODE_MODULES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "node_modules")
VALIDATOR = """
const fs = require('fs');
require('gltf-validator').validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
  .then(report => console.log(JSON.stringify(report)), error => { console.error(error); process.exit(1); });
"""


def run(*command, **options):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=120, **options)


def read_ply(path):
    """(vertices as (x, y, z, r, g, b), number of faces) of a binary PLY."""
    with open(path, "rb") as f:
        head, body = f.read().split(b"end_header\n", 1)
    counts = {kind: int(n) for kind, n in re.findall(r"element (\w+) (\d+)", head.decode())}
    assert b"binary_little_endian" in head
    vertices = list(struct.iter_unpack("<fffBBB", body[:counts["vertex"] * 15]))
    assert len(body) == 15 * counts["vertex"] + 13 * counts.get("face", 0)
    return vertices, counts.get("face", 0)


def transform(m, points):
    """Points, or one, moved by a matrix of 3 x 4 or 4 x 4."""
    m = np.array(m)
    return points @ m[:3, :3].T + m[:3, 3]


def inverse_rotate(m, p):
    """R^T (p - t) of a rigid transform."""
    m = np.array(m)
    return m[:3, :3].T @ (p - m[:3, 3])


class Scene:
    """A model as assimp reads it."""

    def __init__(self, path, folder):
        out = os.path.join(folder, "scene.assjson")
        done = run("assimp", "export", path, out, "-fassjson")
        assert done.returncode == 0 and os.path.exists(out), done.stdout + done.stderr
        scene = harness.read_json(out)
        self.meshes = scene["meshes"]
        self.nodes = {}  # name -> (world matrix, meshes)
        self._walk(scene["rootnode"], np.eye(4))

    def _walk(self, node, parent):
        world = parent @ np.reshape(node["transformation"], (4, 4))
        self.nodes[node["name"]] = (world, node.get("meshes", []))
        for child in node.get("children", []):
            self._walk(child, world)

    def vertices(self, name):
        world, meshes = self.nodes[name]
        return np.concatenate([transform(world, np.reshape(self.meshes[index]["vertices"], (-1, 3))) for index in meshes])


def validate_gltf(path):
    """The validator's counts of issues, and its messages."""
    done = run("node", "-e", VALIDATOR, path, env={**os.environ, "NODE_PATH": NODE_MODULES})
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["issues"]
