"""A small WebSocket client (RFC 6455), with Python's standard library only: a viewer for the tests, which may also misbehave."""
import base64
import json
import os
import socket
import struct


class WebSocket:
    def __init__(self, port, timeout=10, receive_buffer=None, path="/ws", fields=""):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(timeout)
        self.socket.connect(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n{fields}\r\n").encode())
        answer = b""
        while b"\r\n\r\n" not in answer:
            byte = self.socket.recv(1)
            if not byte:
                raise ConnectionError("no handshake")
            answer += byte
        if not answer.startswith(b"HTTP/1.1 101"):
            raise ConnectionError(answer.split(b"\r\n")[0].decode())

    def send_frame(self, opcode, payload, final=True):
        mask = os.urandom(4)
        length = len(payload)
        head = bytes([(0x80 if final else 0) | opcode])
        if length < 126:
            head += bytes([0x80 | length])
        elif length < 65536:
            head += bytes([0x80 | 126]) + struct.pack(">H", length)
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", length)
        self.socket.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def send(self, message):
        self.send_frame(1, json.dumps(message).encode())

    def exactly(self, count):
        data = b""
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part:
                raise ConnectionError("closed")
            data += part
        return data

    def receive(self):
        """(header, bytes) of the next message, acknowledged. ConnectionError when closed."""
        message = self.receive_text()
        size = struct.unpack("<I", message[:4])[0]
        self.send({"type": "ack"})
        return json.loads(message[4:4 + size]), message[4 + size:]

    def receive_text(self):
        """The bytes of the next message; pings are answered. ConnectionError when closed."""
        message = b""
        while True:
            first, second = self.exactly(2)
            length = second & 127
            if length == 126:
                length = struct.unpack(">H", self.exactly(2))[0]
            elif length == 127:
                length = struct.unpack(">Q", self.exactly(8))[0]
            payload = self.exactly(length)
            if first & 15 == 8:
                raise ConnectionError("closed by the server")
            if first & 15 == 9:
                self.send_frame(10, payload)
            elif first & 15 in (0, 1, 2):
                message += payload
                if first & 0x80:
                    return message

    def close(self):
        self.socket.close()
