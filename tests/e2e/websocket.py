"""The WebSocket of server/clients/python for the tests: to a port of this machine, with any header; its messages are those of the viewer."""
import json
import socket
import struct

import client_path  # noqa: F401
from oaslam_client import websocket


class WebSocket(websocket.WebSocket):
    def __init__(self, port, timeout=10, receive_buffer=None, path="/ws", fields=None):
        connection = socket.socket()
        if receive_buffer:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        connection.settimeout(timeout)
        connection.connect(("127.0.0.1", port))
        super().__init__(connection, f"127.0.0.1:{port}", path, fields)

    def send(self, message):
        super().send(json.dumps(message))

    def receive(self):
        """(header, bytes) of the next message of a viewer, acknowledged."""
        message = super().receive()
        size = struct.unpack("<I", message[:4])[0]
        self.send({"type": "ack"})
        return json.loads(message[4:4 + size]), message[4 + size:]

    def receive_json(self):
        return json.loads(super().receive())
