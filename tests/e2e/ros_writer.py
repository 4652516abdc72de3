"""Writes recordings of ROS, also for the seeds of the fuzz targets (tests/fuzz/make_seeds.py)."""
import bz2
import sqlite3
import struct

START = 1_700_000_000  # seconds


class Cdr:
    """A message in little-endian CDR."""
    def __init__(self, second, frame):
        self.body = b""
        if second is not None:
            self.put("I", START + int(second), round(second % 1 * 1e9)).text(frame)

    def put(self, kind, *values):
        for value in values:
            size = struct.calcsize(kind)
            self.body += b"\0" * (-len(self.body) % size) + struct.pack("<" + kind, value)
        return self

    def bytes(self, data):
        self.put("I", len(data)).body += data
        return self

    def text(self, text):
        return self.bytes(text.encode() + b"\0")

    def image(self, pixels, encoding):
        height, width = pixels.shape
        return self.put("I", height, width).text(encoding).put("B", 0).put("I", width * pixels.itemsize).bytes(pixels.tobytes())

    def camera_info(self, width, height, f):
        x, y = width / 2, height / 2
        self.put("I", height, width).text("plumb_bob").put("I", 0).put("d", f, 0, x, 0, f, y, 0, 0, 1)
        return self.put("d", 1, 0, 0, 0, 1, 0, 0, 0, 1, f, 0, x, 0, 0, f, y, 0, 0, 0, 1, 0).put("I", 0, 0, 0, 0, 0, 0).put("B", 0)

    def transform(self, parent, child):
        self.put("I", 1).put("I", 0, 0).text(parent).text(child)
        return self.put("d", 0, 0, 0, 0, 0, 0, 1)

    def imu(self):
        return self.put("d", *[0] * 13, *[0.001] * 3, *[0] * 9, 0, -9.81, 0, *[0] * 9)

    def detections(self, second, box, name):
        left, top, right, bottom = box
        self.put("I", 1, START + int(second), round(second % 1 * 1e9)).text("camera").put("I", 1).text(name).put("d", 0.9, *[0] * 43)
        return self.put("d", (left + right) / 2, (top + bottom) / 2, 0, right - left, bottom - top).text("")


def write_mcap(path, messages):
    """`messages`: (seconds when it was recorded, topic, type, Cdr). Without chunks."""
    def record(kind, content):
        return bytes([kind]) + struct.pack("<Q", len(content)) + content

    def text(value):
        return struct.pack("<I", len(value)) + value.encode()

    channels = {}
    with open(path, "wb") as file:
        file.write(b"\x89MCAP0\r\n" + record(1, text("ros2") + text("")))
        for time, topic, kind, message in sorted(messages, key=lambda m: m[0]):
            if topic not in channels:
                key = channels[topic] = struct.pack("<H", len(channels) + 1)
                file.write(record(3, key + text(kind.replace("/", "/msg/")) + text("ros2msg") + text("")) +
                           record(4, key + key + text(topic) + text("cdr") + text("")))
            nanoseconds = START * 10**9 + round(time * 1e9)
            file.write(record(5, channels[topic] + struct.pack("<IQQ", 0, nanoseconds, nanoseconds) + b"\0\1\0\0" + message.body))
        file.write(record(15, b"\0" * 4) + record(2, b"\0" * 20) + b"\x89MCAP0\r\n")


def write_bag(path, messages, compression="none"):
    """The same as a ROS 1 bag of one chunk (none, bz2), whose messages are not converted: they are read as ROS 1's."""
    def text(value):
        return struct.pack("<I", len(value)) + value

    def record(kind, fields, data):
        return text(b"".join(text(field) for field in [b"op=" + bytes([kind]), *fields])) + text(data)

    chunk, connections = b"", {}
    for time, topic, kind, message in messages:
        conn = connections.get(topic)
        if conn is None:
            conn = connections[topic] = b"conn=" + struct.pack("<I", len(connections))
            chunk += record(7, [conn, b"topic=" + topic.encode()], text(b"type=" + kind.encode()))
        chunk += record(2, [conn, b"time=" + struct.pack("<II", START + int(time), 0)], message.body)
    with open(path, "wb") as file:
        packed = bz2.compress(chunk) if compression == "bz2" else chunk
        file.write(b"#ROSBAG V2.0\n" + record(3, [], b"") + record(5, [b"compression=" + compression.encode(), b"size=" + struct.pack("<I", len(chunk))], packed))


def write_database(path, messages):
    """The same as a database of rosbag2."""
    database = sqlite3.connect(path)
    database.executescript("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT);"
                           "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);")
    topics = {}
    for time, topic, kind, message in messages:
        if topic not in topics:
            topics[topic] = len(topics) + 1
            database.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')", (topics[topic], topic, kind.replace("/", "/msg/")))
        database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", (topics[topic], int((START + time) * 1e9), b"\0\1\0\0" + message.body))
    database.commit()
    database.close()
