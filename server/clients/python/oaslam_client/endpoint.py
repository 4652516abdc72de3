"""Where a service is, and how it is reached."""
from __future__ import annotations

import hashlib
import http.client
import re
import ssl
import urllib.parse
from typing import Dict, Optional

from .errors import NoServer, Unreachable

class Endpoint:
    """The address of a service, with the token and what its certificate must be."""

    def __init__(self, url: str, token: Optional[str], ca_file: Optional[str], fingerprint: Optional[str], insecure: bool, timeout: float):
        """Raises ValueError for a URL, token or fingerprint that cannot be, OSError for a file without certificates."""
        try:
            parts = urllib.parse.urlsplit(url)
            self.host, self.port = parts.hostname, parts.port
        except ValueError as error:
            raise ValueError(f"{url}: {error}") from None
        if parts.scheme not in ("http", "https") or not self.host or parts.query or parts.fragment:
            raise ValueError(f"{url}: expected http://HOST:PORT or https://HOST:PORT")
        if token and not re.fullmatch(r"[A-Za-z0-9._~-]+", token):
            raise ValueError("the token: expected letters, digits and -._~")
        self.url, self.prefix, self.timeout = url, parts.path.rstrip("/"), timeout
        self._headers = {"Authorization": "Bearer " + token} if token else {}
        self._fingerprint = (fingerprint or "").replace(":", "").lower()
        if fingerprint and not re.fullmatch("[0-9a-f]{64}", self._fingerprint):
            raise ValueError(f"fingerprint {fingerprint}: expected SHA-256, 64 hexadecimal digits")
        self._context = _context(ca_file, insecure or bool(fingerprint)) if parts.scheme == "https" else None

    def headers(self) -> Dict[str, str]:
        return dict(self._headers)

    def connect(self) -> http.client.HTTPConnection:
        """A new connection. Raises NoServer."""
        if self._context:
            connection: http.client.HTTPConnection = http.client.HTTPSConnection(self.host, self.port, timeout=self.timeout, context=self._context)
        else:
            connection = http.client.HTTPConnection(self.host, self.port, timeout=self.timeout)
        try:
            connection.connect()
            self._check(connection)
        except OSError as error:
            connection.close()
            raise NoServer(f"{self.url}: {error}") from error
        return connection

    def _check(self, connection: http.client.HTTPConnection) -> None:
        if not self._context or not self._fingerprint:
            return
        found = hashlib.sha256(connection.sock.getpeercert(binary_form=True)).hexdigest()
        if found != self._fingerprint:
            raise OSError(f"its certificate has the fingerprint {found}, expected {self._fingerprint}")

    def unreachable(self, error: Exception) -> Unreachable:
        return Unreachable(f"{self.url}: {error or type(error).__name__}")


def _context(ca_file: Optional[str], any_certificate: bool) -> ssl.SSLContext:
    try:
        context = ssl.create_default_context(cafile=ca_file)
    except OSError as error:  # ssl.SSLError is one, and names no file
        raise OSError(f"{ca_file}: no certificates in PEM: {error}") from None
    if any_certificate:
        context.check_hostname = False
        context.verify_mode = ssl.CERT_NONE
    return context
