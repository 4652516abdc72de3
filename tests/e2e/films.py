"""Films and pictures as arrays of numpy (height, width, RGB), read and written by ffmpeg."""
import json
import subprocess

import numpy as np


def read(path, count=None):
    """The images of a film, or of one picture."""
    probe = subprocess.run(["ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "stream=width,height", "-of", "json", path],
                           capture_output=True, check=True)
    stream = json.loads(probe.stdout)["streams"][0]
    limit = ["-frames:v", str(count)] if count else []
    raw = subprocess.run(["ffmpeg", "-v", "error", "-nostdin", "-i", path, *limit, "-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
                         capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, stream["height"], stream["width"], 3)


def write(path, images, rate=30):
    """A film without loss, or a picture (.png) of one image."""
    images = np.asarray(images)
    codec = [] if path.endswith(".png") else ["-c:v", "libx264", "-preset", "ultrafast", "-crf", "8", "-pix_fmt", "yuv420p"]
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{images.shape[2]}x{images.shape[1]}", "-r", str(rate), "-i", "-", *codec, path],
                   input=images.tobytes(), check=True)
    return path
