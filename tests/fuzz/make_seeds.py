#!/usr/bin/env python3
"""make_seeds.py FOLDER: writes the seeds of the fuzz targets, a folder for each, small and valid."""
import base64
import json
import os
import struct
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "e2e"))
from ros_writer import Cdr, write_bag, write_database, write_mcap  # noqa: E402

CAMERAS = {
    0: ["""image_width: 640
image_height: 480
camera_matrix: {rows: 3, cols: 3, data: [525.0, 0, 319.5, 0, 525.0, 239.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0, 0, 0, 0]}
""", """%YAML:1.0
Camera.type: "KannalaBrandt8"
Camera.fx: 535.4
Camera.fy: 539.2
Camera.cx: 320.1
Camera.cy: 247.6
Camera.k1: 0.0
Camera.width: 640
Camera.height: 480
""", """cam0:
  camera_model: pinhole
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  distortion_model: equidistant
  distortion_coeffs: [-0.28, 0.07, 0.0001, 1.7e-05]
  resolution: [640, 480]
""", """Camera:
  model: fisheye
  fx: 525
  fy: 525
  cx: 319.5
  cy: 239.5
  k1: -0.03
  cols: 640
  rows: 480
""", """model_type: MEI
image_width: 640
image_height: 480
mirror_parameters: {xi: 0.9}
distortion_parameters: {k1: -0.1, k2: 0.02, p1: 0, p2: 0}
projection_parameters: {gamma1: 500, gamma2: 500, u0: 319.5, v0: 239.5}
""", """cameras:
  - {image_dimension: [640, 480], distortion_type: equidistant, distortion_coefficients: [-0.03, 0, 0, 0],
     focal_length: [525, 525], principal_point: [319.5, 239.5]}
""", """cam0: {camera_model: eucm, intrinsics: [0.6, 1.1, 350, 351, 319.5, 239.5], distortion_model: none, resolution: [640, 480]}
""", """K: [600, 0, 319.5, 0, 601, 239.5, 0, 0, 1]
D: [0.3, -0.1, 5e-4, -3e-4, 0.02, 0.45, -0.05, 0.01]
""", "P0: 600 0 319.5 0 0 601 239.5 0 0 0 1 0\nTr: 1 0\n"],
    1: ['{"camera_model": "OPENCV", "fl_x": 500, "fl_y": 500, "cx": 320, "cy": 240, "w": 640, "h": 480, "k1": 0}',
        '{"w": 640, "h": 480, "K": [600,0,0,0,601,0,319.5,239.5,1]}'],
    2: ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 OPENCV 640 480 525 525 320 240 0 0 0 0\n"
        "2 SIMPLE_RADIAL_FISHEYE 320 240 300 160 120 0.1\n",
        "1 THIN_PRISM_FISHEYE 640 480 600 601 320 240 0.02 -0.01 1e-5 -1e-5 0.003 -0.001 1e-5 1e-5\n",
        "600 601 319.5 239.5 0.3 -0.1 5e-4 -3e-4 0.02 0.45 -0.05 0.01\n", "600,0,319.5\n0,601,239.5\n0,0,1\n"],
    3: ["""<?xml version="1.0"?>
<opencv_storage><image_width>640</image_width><image_height>480</image_height>
<camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt><data>600. 0. 319.5 0. 601. 239.5 0. 0. 1.</data></camera_matrix>
</opencv_storage>
"""],
}
DETECTIONS = [
    [{"file_name": "000000.jpg", "detections": [
        {"category_id": 41, "detection_score": 0.87, "bbox": [366.5, 163.9, 402.5, 201.6]},
        {"labels": [[41, 0.62], [45, 0.21]], "bbox": [1, 2, 3, 4], "ellipse": [547.2, 300.0, 113.3, 86.5, 0.0]}]}],
    [{"image_id": "7.png", "category_id": 1, "score": 0.5, "bbox": [1, 2, 3, 4]}],
    {"images": [{"id": 7, "file_name": "7.png"}], "categories": [{"id": 1, "name": "cup"}],
     "annotations": [{"image_id": 7, "category_id": 1, "bbox": [1, 2, 3, 4]}]},
    [{"image_id": 1, "file_name": "clip_1.jpg", "category_id": 90, "score": 0.5, "bbox": [1, 2, 3, 4], "attributes": {"rotation": 30}}],
    {"imagePath": "..\\7.png", "shapes": [{"label": "cup", "shape_type": "circle", "points": [[9, 9], [5, 9]]}, {"label": "a", "points": [[1, 2], [3, 4], [5, 1]]}]},
    [{"data": {"image": "/data/upload/1a2b3c4d-7.png"}, "annotations": [{"result": [{"original_width": 640, "original_height": 480, "value": {
        "x": 10, "y": 20, "width": 30, "height": 40, "rotation": 45, "rectanglelabels": ["cup"]}}]}]}],
    [{"image": "7.png", "label": [{"original_width": 640, "original_height": 480, "points": [[1, 2], [3, 4]], "polygonlabels": ["cup"]}]}],
]
SETTINGS = ["features:\n  count: 500\n  resolution: 320\nobjects:\n  min_score: 0.4\n", "features.count=200"]
IMAGE_URL = "data:image/png;name=a;base64," + base64.b64encode(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", 32, 32)).decode() + "%3D"
CLASSES = ["names: {0: person, 100: head, 101: statue}\nparts: {head: statue}\nmovable: [person]\n",
           "names: [cup, book]\n", "person\ncup\n"]


def jpeg_with_exif():
    """The beginning of a JPEG file, with EXIF (JEITA CP-3451): a focal length of 28 mm."""
    entry = struct.pack("<HHIHH", 0xA405, 3, 1, 28, 0)
    tiff = b"II*\0" + struct.pack("<IHHHIII", 8, 1, 0x8769, 4, 1, 26, 0) + struct.pack("<H", 1) + entry + bytes(4)
    exif = b"Exif\0\0" + tiff
    return b"\xff\xd8\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + b"\xff\xd9"


def field(number, content):
    """A field of a protobuf message."""
    if isinstance(content, int):
        return bytes([number << 3, content])
    return bytes([number << 3 | 2, len(content)]) + content


def onnx():
    """An ONNX model with an input of 1 x 3 x 64 x 64 and names of classes."""
    shape = b"".join(field(1, field(1, size)) for size in (1, 3, 64, 64))
    value = field(1, b"images") + field(2, field(1, field(1, 1) + field(2, shape)))
    told = {b"names": b"{0: 'person', 1: \"baby's bed\"}", b"task": b"pose", b"kpt_shape": b"[17, 3]", b"args": b"{'batch': 1, 'nms': True}"}
    return field(7, field(11, value)) + b"".join(field(14, field(1, key) + field(2, text)) for key, text in told.items())


def triangle():
    """glTF 2.0 (Khronos) of one triangle, as text and as binary."""
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    model = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}], "buffers": [{"byteLength": len(data)}]}
    text = json.dumps(model).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    model["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(model).encode(), struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def videos():
    """Two images of noise, where ffmpeg is installed."""
    made = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a.mp4", "b.mkv"):
            path = os.path.join(folder, name)
            try:
                subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "lavfi", "-i", "color=gray:s=32x32:r=10:d=0.2",
                                "-c:v", "mpeg4", "-map_metadata", "-1", "-bitexact", path],
                               check=True, stdin=subprocess.DEVNULL)
            except (OSError, subprocess.CalledProcessError):
                break
            with open(path, "rb") as f:
                made.append(f.read())
    return made


def frame(opcode, payload):
    """A masked frame of a WebSocket (RFC 6455, section 5.2)."""
    mask = b"\1\2\3\4"
    masked = bytes(c ^ mask[i % 4] for i, c in enumerate(payload))
    return bytes([0x80 | opcode, 0x80 | len(payload)]) + mask + masked


def requests():
    camera = {"model": "pinhole", "width": 640, "height": 480, "fx": 500, "fy": 500, "cx": 320, "cy": 240}
    anchor = {"name": "door", "model": "flag", "origin": [0, 0, 0], "direction": [0, 0, 1]}
    boxes = [{"category_id": 1, "detection_score": 0.5, "bbox": [1, 2, 30, 40]}]
    detections = {"images": [{"camera": camera, "detections": boxes, "gravity": [0, 1, 0], "time": 1}]}
    return [("POST", "/v1/maps/desk/localize", detections), ("POST", "/v1/maps/desk/anchors", anchor),
            ("PATCH", "/v1/maps/desk/anchors/door", {"turn": 1.5, "size": 0.3}),
            ("GET", "/v1/maps/desk/anchors?since=1", None), ("GET", "/v1/maps/desk", None)]


def datasets():
    """A file of each layout, after the number that tests/fuzz/dataset_fuzz.cc has for it."""
    matrix = "1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n"
    image = struct.pack("<QI7dI", 1, 1, 1, 0, 0, 0, 4, 5, 6, 1) + b"0.png\0" + struct.pack("<QddQ", 1, 1, 2, 3)
    texts = ["#timestamp [ns],filename\n1403636579763555584,1.pgm\n", "#timestamp [ns],x,y,z,q_w,q_x,q_y,q_z\n1403636579763555584,1,2,3,1,0,0,0\n",
             "T_BS:\n  cols: 4\n  data: [1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1]\nintrinsics: [458, 457, 367, 248]\n", "0.0\n1.036224e-01\n",
             "1 0 0 4 0 1 0 5 0 0 1 6\n", matrix, json.dumps({"w": 9, "h": 9, "fps": 60, "K": [9, 0, 0, 0, 9, 0, 4, 4, 1], "poses": [[0, 0, 0, 1, 4, 5, 6]]}),
             json.dumps({"fl_x": 500, "frames": [{"file_path": "./images/0", "transform_matrix": [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]}]}),
             "1 1 0 0 0 4 5 6 1 0.png\n1 2 3\n", image, struct.pack("<QIIQQ4d", 1, 1, 1, 640, 480, 500, 500, 320, 240),
             "timestamp, frame, x, y, z, qx, qy, qz, qw\n7.5, 000000, 1, 2, 3, 0, 0, 0, 1\n", "0 4 5 6 0 0 0 1\n",
             json.dumps({"intrinsics": [9, 0, 4, 0, 9, 4, 0, 0, 1], "cameraPoseARFrame": [1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6, 0, 0, 0, 1], "time": 1.5}),
             json.dumps({"fx": 9, "fy": 9, "cx": 4, "cy": 4, "width": 640, "height": 480} | {f"t_{r}{c}": int(r == c) for r in range(3) for c in range(4)}),
             "1 1 0 0 0 4 5 6 1 0.png\n1 2 3\n", image,
             struct.pack("<2sHIHHHII", b"II", 42, 8, 1, 262, 3, 1, 32803), b"\0\0\0\x18ftypheic\0\0\0\0mif1heic\0\0\0\x08meta"]
    return [bytes([i]) + (text if isinstance(text, bytes) else text.encode()) for i, text in enumerate(texts)]


def mcap_in_chunks(plain):
    """An MCAP file of write_mcap with its records in a chunk, and in one of zstd (RFC 8878, as it is)."""
    begin, end = 8 + 9 + 12, -(9 + 4 + 9 + 20 + 8)
    records = plain[begin:end]
    frame = struct.pack("<IBI", 0xFD2FB528, 0xA0, len(records)) + struct.pack("<I", len(records) << 3 | 1)[:3] + records
    for name, content in ((b"", records), (b"zstd", frame)):
        chunk = struct.pack("<QQQII", 0, 0, len(records), 0, len(name)) + name + struct.pack("<Q", len(content)) + content
        yield plain[:begin] + b"\6" + struct.pack("<Q", len(chunk)) + chunk + plain[end:]


def recordings():
    """Recordings of each kind without the bytes by which their kind is known, by their fuzz targets."""
    class Pixels(bytes):
        shape, itemsize = (2, 2), 1

        def tobytes(self):
            return self

    messages = [(0, "/tf_static", "tf2_msgs/TFMessage", Cdr(None, "").transform("base", "camera")),
                (0, "/camera/image_raw", "sensor_msgs/Image", Cdr(0, "camera").image(Pixels(b"abcd"), "mono8")),
                (0, "/camera/camera_info", "sensor_msgs/CameraInfo", Cdr(0, "camera").camera_info(320, 240, 262.5)),
                (0, "/imu", "sensor_msgs/Imu", Cdr(0, "imu").imu()),
                (0, "/boxes", "vision_msgs/Detection2DArray", Cdr(0, "camera").detections(0, (1, 2, 3, 4), "chair"))]
    targets = {}
    with tempfile.TemporaryDirectory() as folder:
        for target, magic, write in (("mcap", b"\x89MCAP0\r\n", write_mcap), ("bag", b"#ROSBAG V2.0\n", write_bag),
                                     ("bag", b"#ROSBAG V2.0\n", lambda *args: write_bag(*args, "bz2")),
                                     ("rosbag2", b"SQLite format 3", write_database)):
            path = os.path.join(folder, str(len(targets)) + target)
            write(path, messages)
            with open(path, "rb") as f:
                made = f.read()
            for file in (made, *(mcap_in_chunks(made) if target == "mcap" else ())):
                targets.setdefault(target, []).append(file.removeprefix(magic))
    return targets


def seeds():
    glb_text, glb = triangle()
    return {
        "map": [b"\0" + bytes(range(1, 60)), b"\0" + b"\xff\x03" * 30],
        "detections": [json.dumps(d).encode() for d in DETECTIONS] + [
            b"filename,width,height,class,xmin,ymin,xmax,ymax,score\n7.png,640,480,cup,1,2,3,4,0.5\n", b"41 0.5 0.5 0.25 0.5 0.9 3\n0 .1 .1 .1 .1\n"],
        "calibration": [bytes([kind]) + text.encode() for kind, texts in CAMERAS.items() for text in texts],
        "imu": [b"#timestamp [ns],w_x,w_y,w_z\n1000000000,0.1,-2,3e-1,9.8\n1005000000,0,0,0\n", b"T_BS: [0, 0, 1, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 1]\n",
                b"timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n" + b"".join(b"%.3f, 0.01, -1, %d, .1, 20, %d\n" % (7 + i / 90, i % 2, i % 3) for i in range(30)),
                b"t(ms);gyroX (deg/s);gyroY;gyroZ;user_x_g;user_y_g;user_z_g;gravity_x;gravity_y;gravity_z\n5;1;2;3;0;0;0;0;1;0\n9;nan;nan;nan;0;0;0;0;1;0\n9;1;2;3;;;;;;"],
        "list": [b"# time path\n0.5 rgb/a.png\n0.6,rgb/b.png\n", b"1500000000.1.png\n1500000000.033333.png\n",
                 b"0.5 rgb/a.png 0.5 depth/a.png\n", b"#timestamp [ns],filename\n1403636579763555584,a.png\n",
                 "".join(f"{100 + i - 50 * (i > 5)} a.png\n" for i in range(12)).encode()],
        **recordings(),
        "trajectory": [b"# time x y z qx qy qz qw\n0.5 1 2 3 0 0 0 1\n1.5 1 2 3 0 0 1 0 0.9\n",
                       b"#timestamp [ns],p_x,p_y,p_z,q_w,q_x,q_y,q_z\n1403636579763555584,1,2,3,1,0,0,0\n",
                       b"1 0 0 1 0 1 0 2 0 0 1 3\n", b"\xff\xfe0\0 \0" + "1 2 3 0 0 0 1\n".encode("utf-16-le")],
        "settings": [text.encode() for text in SETTINGS],
        "classes": [text.encode() for text in CLASSES],
        "gravity": [b"# time gx gy gz\n0 0 9.8 0\n0.5 0.1 9.8 0\n1,0,9.8,1\n"],
        "onnx": [onnx(), b"{0: 'person', 1: \"baby's bed\"}"],
        "exif": [jpeg_with_exif()],
        "container": videos(),
        "dataset": datasets(),
        "gltf": [glb_text, b'{"buffers": [{"uri": "a%20b.bin"}], "images": [{"uri": "../x.png"}]}', b'{"images": [{"uri": "model.gltf"}]}'],
        "http": [b"GET /a%20b?c=d&e HTTP/1.1\r\nHost: localhost\r\n\r\n",
                 b"GET http://[::1]:80//a?b HTTP/1.1\r\nHost: a\r\n\r\n",
                 b"POST HTTPS://localhost HTTP/1.1\r\nContent-Encoding: identity\r\nContent-Length: 1\r\n\r\na",
                 b"POST /file HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\nExpect: 100-continue\r\n\r\nabc",
                 b"POST / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n"],
        "websocket": [frame(1, b'{"a": 1}') + frame(9, b"") + frame(8, b"\x03\xe8"), frame(2, bytes(100))],
        "service": [f"{method} {path} application/json\n{json.dumps(body) if body else ''}".encode()
                    for method, path, body in requests()] +
                   [f"POST /v1/maps/desk/localize {kind}\n{IMAGE_URL}".encode() for kind in ("text/plain", "image/png")] +
                   [f'POST /v1/maps/desk/localize application/json\n{{"images": [{{"image": "{IMAGE_URL}"}}]}}'.encode()],
    }


def main():
    for target, contents in seeds().items():
        folder = os.path.join(sys.argv[1], target)
        os.makedirs(folder, exist_ok=True)
        for i, content in enumerate(contents):
            with open(os.path.join(folder, f"seed{i}"), "wb") as f:
                f.write(content)


if __name__ == "__main__":
    main()
