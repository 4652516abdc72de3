"""Cameras over a WebSocket: followed in a map, or making a new one."""
from __future__ import annotations

import json
import os
import struct
import time as clock
from types import TracebackType
from typing import Any, Dict, Iterator, List, Optional, Sequence, Type, Union

from .endpoint import Endpoint
from .errors import ServiceError
from .images import bytes_of
from .shapes import Anchor, Camera
from .websocket import Closed, Refused, WebSocket


class Stream:
    """A camera's connection. Messages are dicts with a "type", as in docs/service.md. To be used by one thread at a time.

    hello: the first message of the service, which tells what is in the map.
    """

    def __init__(self, endpoint: Endpoint, path: str, camera: Camera):
        """Raises ServiceError and Unreachable."""
        self._endpoint, self._camera, self._next_id = endpoint, camera, 0
        connection = endpoint.connect()
        host = connection.host if ":" not in connection.host else f"[{connection.host}]"
        try:
            self._socket = WebSocket(connection.sock, f"{host}:{connection.port}", endpoint.prefix + path, endpoint.headers())
            self.hello = self.wait_for("hello")
        except Refused as refused:
            connection.close()
            raise ServiceError.of_answer(refused.status, refused.body) from None
        except OSError as error:
            connection.close()
            raise endpoint.unreachable(error) from error
        except ServiceError:
            connection.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        self.close()

    def send_image(self, image: Union[bytes, str, "os.PathLike[str]"], *, time: Optional[float] = None, camera: Optional[Camera] = None,
                   gravity: Optional[Sequence[float]] = None, detections: Optional[Sequence[Dict[str, Any]]] = None,
                   angular_velocity: Optional[Sequence[Sequence[float]]] = None, imu: Optional[Sequence[Sequence[float]]] = None,
                   cam_from_imu: Optional[Dict[str, Any]] = None) -> int:
        """Sends a JPEG or PNG file, and returns the id that its pose will have. While one image is worked at, the service keeps only the newest of
        those that come.

        time: when it was taken, seconds of any clock that ascends; now unless given. camera: that of the stream unless given. gravity: m/s2, in
        the camera's axes (x right, y down, z forward), pointing down. angular_velocity: rows of time, x, y, z in rad/s about these axes, best those of
        the last second: an image that the service dropped takes its rows with it, and rows that come again are ignored. imu: instead of them, rows of
        time, wx, wy, wz, ax, ay, az along the IMU's axes, in rad/s and m/s2 with gravity. cam_from_imu: how the IMU lies to the camera, a pose with
        position (metres) and rotation, with each image; as the camera unless given.
        """
        header: Dict[str, Any] = {"type": "image", "id": self._next_id, "time": clock.monotonic() if time is None else time,
                                  "camera": self._camera if camera is None else camera}
        if gravity is not None:
            header["gravity"] = list(gravity)
        if angular_velocity is not None:
            header["angular_velocity"] = [list(row) for row in angular_velocity]
        if imu is not None:
            header["imu"] = [list(row) for row in imu]
        if cam_from_imu is not None:
            header["cam_from_imu"] = cam_from_imu
        if detections is not None:
            header["detections"] = list(detections)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        self._send(struct.pack("<I", len(text)) + text + bytes_of(image))
        self._next_id += 1
        return header["id"]

    def send(self, message: Dict[str, Any]) -> None:
        """Sends a message of docs/service.md that is no image."""
        self._send(json.dumps(message))

    def receive(self, timeout: Optional[float] = None) -> Optional[Dict[str, Any]]:
        """The next message; None if there is none within so many seconds (0: none is there yet). Without a timeout it waits for as long as the
        service shows that it lives. Raises Closed when the service ends the stream, and Unreachable."""
        try:
            message: Dict[str, Any] = json.loads(self._socket.receive(timeout))
        except TimeoutError as error:
            if timeout is None:
                raise self._endpoint.unreachable(error) from error
            return None
        except Closed:
            raise
        except OSError as error:
            raise self._endpoint.unreachable(error) from error
        self._note(message)
        return message

    def wait_for(self, *types: str) -> Dict[str, Any]:
        """The next message of one of these types; others are passed over. Raises ServiceError for an "error" that is not among them."""
        while True:
            message = self.receive()
            assert message is not None
            if message["type"] in types:
                return message
            if message["type"] == "error":
                raise ServiceError(None, message["message"])

    def __iter__(self) -> Iterator[Dict[str, Any]]:
        """Messages until the service ends the stream."""
        while True:
            try:
                message = self.receive()
            except Closed as end:
                if end.code == 1000:
                    return
                raise
            assert message is not None
            yield message

    def close(self) -> None:
        self._socket.close()

    def _note(self, message: Dict[str, Any]) -> None:
        """For what a kind of stream remembers of messages."""

    def _send(self, message: Union[str, bytes]) -> None:
        try:
            self._socket.send(message)
        except OSError as error:
            raise self._endpoint.unreachable(error) from error


class Track(Stream):
    """A camera that is followed in a map. anchors: those of the map by name, up to date with the last message that was received."""

    def __init__(self, endpoint: Endpoint, path: str, camera: Camera):
        self.anchors: Dict[str, Anchor] = {}
        super().__init__(endpoint, path, camera)

    def _note(self, message: Dict[str, Any]) -> None:
        if message["type"] in ("hello", "map"):
            self.anchors.clear()
        if "anchors" in message:
            for name in message.get("removed", ()):
                self.anchors.pop(name, None)
            changed: List[Anchor] = message["anchors"]
            self.anchors.update({anchor["name"]: anchor for anchor in changed})


class Record(Stream):
    """A camera that makes a new map. A stream that ends without `finish` leaves nothing."""

    def finish(self) -> Dict[str, Any]:
        """Saves the map; returns {"type": "saved", "map", "digest"}. Raises ServiceError where there is no map yet."""
        self.send({"type": "finish"})
        return self.wait_for("saved")
