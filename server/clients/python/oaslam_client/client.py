"""Requests to a service."""
from __future__ import annotations

import http.client
import json
import os
import selectors
import socket
import time
import urllib.parse
from types import TracebackType
from typing import Any, BinaryIO, Callable, Dict, List, Mapping, Optional, Sequence, Type, TypeVar, Union, cast

from .endpoint import Endpoint
from .errors import NoServer, ServiceError
from .images import entry_of
from .shapes import Anchor, Anchors, Camera, Image, Localized, Map, Pose, StoredMap
from .stream import Record, Track

T = TypeVar("T")


class Client:
    """A connection to a service, made when it is needed and kept from request to request. To be used by one thread at a time.

    All methods raise ServiceError where the service refuses, and Unreachable where it does not answer.
    """

    def __init__(self, url: str, token: Optional[str] = None, *, ca_file: Optional[str] = None, fingerprint: Optional[str] = None,
                 insecure: bool = False, timeout: float = 60, retries: int = 0):
        """
        url: http://HOST:PORT or https://HOST:PORT.
        ca_file: PEM file of the certificates by which that of the server is checked, for one that the system does not know.
        fingerprint: SHA-256 of the certificate itself, as `--tls-self-signed` logs it; nothing else of it is checked then.
        insecure: any certificate will do: the other end may be anybody.
        timeout: seconds in which nothing comes.
        retries: how often a request is repeated that was answered with 503, after the time that the answer says, or that found no server.
        Raises ValueError for what cannot be, OSError where ca_file has no certificates.
        """
        self._endpoint = Endpoint(url, token, ca_file, fingerprint, insecure, timeout)
        self._retries, self._connection = retries, cast(Optional[http.client.HTTPConnection], None)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        self.close()

    def close(self) -> None:
        """A later request makes a new connection."""
        if self._connection:
            self._connection.close()
            self._connection = None

    def maps(self) -> List[StoredMap]:
        return cast(List[StoredMap], self._json("GET", "/v1/maps")["maps"])

    def map(self, name: str) -> Map:
        return cast(Map, self._json("GET", _path(name)))

    def upload_map(self, name: str, path: Union[str, "os.PathLike[str]"]) -> StoredMap:
        """Stores a map file, in place of the map of that name if there is one. The file is sent in parts. Raises OSError where it cannot be read."""
        with open(path, "rb") as file:
            return cast(StoredMap, self._json("PUT", _path(name), file, "application/octet-stream"))

    def delete_map(self, name: str) -> None:
        """Removes a map with its anchors."""
        self._json("DELETE", _path(name))

    def localize(self, map: str, images: Sequence[Image], mode: str = "points+objects", *, camera: Optional[Camera] = None) -> Localized:
        """Where images were taken: a result for each, found or not. mode: what may find them: "points", "objects" or "points+objects". camera: of
        the images that say none; "auto" unless given. Raises OSError for a path without a file."""
        if isinstance(images, (str, bytes, Mapping)):
            raise TypeError("images: expected a list of images")
        entries = [entry_of(image, camera=camera) for image in images]
        return cast(Localized, self._json("POST", _path(map, "localize"), {"images": entries, "mode": mode}))

    def anchors(self, map: str, since: Optional[int] = None) -> Anchors:
        """The anchors of a map; those edited after a version, and the names of those removed, if one is given."""
        query = "" if since is None else f"?since={since:d}"
        return cast(Anchors, self._json("GET", _path(map, "anchors") + query))

    def place_anchor(self, map: str, model: str, *, name: Optional[str] = None, pose: Optional[Pose] = None, size: Optional[float] = None,
                     origin: Optional[Sequence[float]] = None, direction: Optional[Sequence[float]] = None, object: Optional[int] = None) -> Anchor:
        """Places an anchor at a pose, or where the ray from `origin` meets the map (the object of that id)."""
        return cast(Anchor, self._json("POST", _path(map, "anchors"), _given(model=model, name=name, pose=pose, size=size, origin=origin,
                                                                              direction=direction, object=object)))

    def edit_anchor(self, map: str, name: str, *, new_name: Optional[str] = None, model: Optional[str] = None, size: Optional[float] = None,
                    turn: Optional[float] = None, pose: Optional[Pose] = None) -> Anchor:
        """Changes what is given of an anchor. turn: radians about its y axis."""
        return cast(Anchor, self._json("PATCH", _path(map, "anchors", name), _given(name=new_name, model=model, size=size, turn=turn, pose=pose)))

    def delete_anchor(self, map: str, name: str) -> None:
        self._json("DELETE", _path(map, "anchors", name))

    def metrics(self) -> str:
        """Counters, in Prometheus' text format."""
        return self._ask("GET", "/metrics", None, None).decode()

    def track(self, map: str, camera: Camera = "auto") -> Track:
        """Opens a stream for a camera that is followed in a map."""
        return self._repeated(lambda: Track(self._endpoint, _path(map, "track"), camera))

    def record(self, map: str, camera: Camera = "auto") -> Record:
        """Opens a stream for a camera that makes a new map of this name."""
        return self._repeated(lambda: Record(self._endpoint, _path(map, "record"), camera))

    def _json(self, method: str, path: str, body: Union[Mapping[str, Any], BinaryIO, None] = None, content_type: str = "application/json") -> Any:
        answer = self._ask(method, path, body, content_type)
        try:
            return json.loads(answer)
        except ValueError:
            raise ServiceError(None, f"{self._endpoint.url}: is no localization service: its answer is no JSON") from None

    def _ask(self, method: str, path: str, body: Union[Mapping[str, Any], BinaryIO, None], content_type: Optional[str]) -> bytes:
        headers = self._endpoint.headers()
        data: Union[bytes, BinaryIO, None] = None
        if body is not None:
            headers["Content-Type"] = content_type or ""
            data = json.dumps(body).encode() if isinstance(body, Mapping) else body
            headers["Content-Length"] = str(len(data) if isinstance(data, bytes) else os.fstat(data.fileno()).st_size)
        return self._repeated(lambda: self._ask_once(method, self._endpoint.prefix + path, data, headers))

    def _repeated(self, act: Callable[[], T]) -> T:
        """Acts until there is an answer that is not 503, at most `retries` times more."""
        for _ in range(self._retries):
            try:
                return act()
            except NoServer:
                time.sleep(1)
            except ServiceError as error:
                if error.retry_after is None:
                    raise
                time.sleep(error.retry_after)
        return act()

    def _ask_once(self, method: str, path: str, data: Union[bytes, BinaryIO, None], headers: Dict[str, str]) -> bytes:
        connection = self._connected()
        try:
            try:
                if data is not None and not isinstance(data, bytes):
                    data.seek(0)
                connection.request(method, path, data, headers)
            except (BrokenPipeError, ConnectionResetError):
                pass  # it may have answered before all was sent, as where the token is wrong
            response = connection.getresponse()
            body = response.read()
        except (OSError, http.client.HTTPException) as error:
            self.close()
            raise self._endpoint.unreachable(error) from error
        if response.status >= 300:
            raise ServiceError.of_answer(response.status, body, response.headers.get("Retry-After"))
        return body

    def _connected(self) -> http.client.HTTPConnection:
        """A connection that the server has not closed meanwhile."""
        if self._connection and (not self._connection.sock or _is_readable(self._connection.sock)):
            self.close()
        if not self._connection:
            self._connection = self._endpoint.connect()
        return self._connection


def _is_readable(connection: socket.socket) -> bool:
    """Between requests: that it has ended."""
    with selectors.DefaultSelector() as selector:
        selector.register(connection, selectors.EVENT_READ)
        return bool(selector.select(0))


def _given(**values: Any) -> Dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _path(*parts: str) -> str:
    return "/v1/maps/" + "/".join(urllib.parse.quote(part, safe="") for part in parts)
