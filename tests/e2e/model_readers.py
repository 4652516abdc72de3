"""Independent readers of exported models: assimp, Khronos' glTF validator, and PLY by hand."""
import json
import math
import os
import re
import struct
import subprocess

import harness

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


def multiply(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def transform(m, p):
    return [sum(m[i][j] * p[j] for j in range(3)) + m[i][3] for i in range(3)]


def inverse_rotate(m, p):
    """R^T (p - t) of a rigid transform."""
    d = [p[i] - m[i][3] for i in range(3)]
    return [sum(m[i][j] * d[i] for i in range(3)) for j in range(3)]


def rms(values):
    values = list(values)
    return math.sqrt(sum(v * v for v in values) / len(values))


class Scene:
    """A model as assimp reads it."""

    def __init__(self, path, folder):
        out = os.path.join(folder, "scene.assjson")
        done = run("assimp", "export", path, out, "-fassjson")
        assert done.returncode == 0 and os.path.exists(out), done.stdout + done.stderr
        scene = harness.read_json(out)
        self.meshes = scene["meshes"]
        self.nodes = {}  # name -> (world matrix, meshes)
        self._walk(scene["rootnode"], [[float(i == j) for j in range(4)] for i in range(4)])

    def _walk(self, node, parent):
        m = node["transformation"]
        world = multiply(parent, [m[4 * i:4 * i + 4] for i in range(4)])
        self.nodes[node["name"]] = (world, node.get("meshes", []))
        for child in node.get("children", []):
            self._walk(child, world)

    def vertices(self, name):
        world, meshes = self.nodes[name]
        points = []
        for index in meshes:
            v = self.meshes[index]["vertices"]
            points += [transform(world, v[i:i + 3]) for i in range(0, len(v), 3)]
        return points


def validate_gltf(path):
    """The validator's counts of issues, and its messages."""
    done = run("node", "-e", VALIDATOR, path, env={**os.environ, "NODE_PATH": NODE_MODULES})
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["issues"]
