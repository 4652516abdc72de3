"""A WebSocket client (RFC 6455)."""
from __future__ import annotations

import base64
import http.client
import io
import os
import socket
import ssl
import struct
import time
from typing import Mapping, Optional, Union

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Refused(ConnectionError):
    """The server answered without a WebSocket."""

    def __init__(self, status: int, body: bytes):
        super().__init__(f"status {status}")
        self.status, self.body = status, body


class Closed(ConnectionError):
    """The server has closed the connection. Code 1000: as was to be, since there is no more to say."""

    def __init__(self, code: int):
        super().__init__(f"the server has closed the connection (code {code})")
        self.code = code


class WebSocket:
    """A WebSocket over a connected socket. To be used by one thread at a time."""

    def __init__(self, connection: socket.socket, host: str, path: str, headers: Optional[Mapping[str, str]] = None):
        """Raises Refused or OSError."""
        self.socket, self._buffer, self._message, self._is_text = connection, bytearray(), bytearray(), True
        self._deadline: Optional[float] = None
        key = base64.b64encode(os.urandom(16)).decode()
        fields = {"Host": host, "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13", **(headers or {})}
        self.socket.sendall((f"GET {path} HTTP/1.1\r\n" + "".join(f"{name}: {value}\r\n" for name, value in fields.items()) + "\r\n").encode())
        while b"\r\n\r\n" not in self._buffer:
            self._receive_more()
        head, _, rest = bytes(self._buffer).partition(b"\r\n\r\n")
        self._buffer = bytearray(rest)
        line, _, lines = head.partition(b"\r\n")
        status = int(line.split()[1])
        if status != 101:
            length = int(http.client.parse_headers(io.BytesIO(lines + b"\r\n\r\n")).get("Content-Length", 0))
            self._need(length)
            raise Refused(status, bytes(self._buffer[:length]))

    def send(self, message: Union[str, bytes]) -> None:
        if isinstance(message, str):
            self.send_frame(TEXT, message.encode())
        else:
            self.send_frame(BINARY, message)

    def send_frame(self, opcode: int, payload: bytes) -> None:
        mask, length = os.urandom(4), len(payload)
        head = bytes([0x80 | opcode])
        if length < 126:
            head += bytes([0x80 | length])
        elif length < 65536:
            head += bytes([0x80 | 126]) + struct.pack(">H", length)
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", length)
        # As numbers, since a loop over the bytes of an image takes longer than to send it.
        pad = (mask * (length // 4 + 1))[:length]
        masked = (int.from_bytes(payload, "big") ^ int.from_bytes(pad, "big")).to_bytes(length, "big")
        self.socket.sendall(head + mask + masked)

    def receive(self, timeout: Optional[float] = None) -> Union[str, bytes]:
        """The next message; pings are answered. Raises Closed, ConnectionError when the connection is lost, and TimeoutError where no message is
        complete within so many seconds, or, without a timeout, where nothing at all comes within that of the socket. Nothing is lost by a
        TimeoutError."""
        self._deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            first = self._need(2)[0]
            payload = self._take_payload()
            opcode = first & 15
            if opcode == CLOSE:
                raise Closed(struct.unpack(">H", payload[:2])[0] if len(payload) >= 2 else 1005)
            if opcode == PING:
                self.send_frame(PONG, payload)
            elif opcode <= BINARY:
                if opcode:
                    self._is_text = opcode == TEXT
                self._message += payload
                if first & 0x80:
                    message, self._message = bytes(self._message), bytearray()
                    return message.decode() if self._is_text else message

    def close(self) -> None:
        try:
            self.send_frame(CLOSE, struct.pack(">H", 1000))
        except OSError:
            pass  # the other end was faster
        self.socket.close()

    def _receive_more(self) -> None:
        usual = self.socket.gettimeout()
        if self._deadline is not None:
            self.socket.settimeout(max(0, self._deadline - time.monotonic()))
        try:
            part = self.socket.recv(65536)
        except (socket.timeout, BlockingIOError, ssl.SSLWantReadError):
            raise TimeoutError("nothing came in time") from None
        finally:
            self.socket.settimeout(usual)
        if not part:
            raise ConnectionResetError("the connection was lost")
        self._buffer += part

    def _need(self, count: int) -> bytearray:
        while len(self._buffer) < count:
            self._receive_more()
        return self._buffer

    def _take_payload(self) -> bytes:
        """That of the first frame, which leaves the buffer when it is complete."""
        begin, length = 2, self._need(2)[1] & 127
        if length == 126:
            begin, length = 4, struct.unpack(">H", self._need(4)[2:4])[0]
        elif length == 127:
            begin, length = 10, struct.unpack(">Q", self._need(10)[2:10])[0]
        payload = bytes(self._need(begin + length)[begin:begin + length])
        del self._buffer[:begin + length]
        return payload
