"""What goes wrong with a service."""
from __future__ import annotations

import json
from typing import Optional


class ServiceError(Exception):
    """The service answered that it could not.

    status: that of HTTP; None for an error told in a stream. message: one sentence. retry_after: seconds after which it may be tried again, for 503.
    """

    def __init__(self, status: Optional[int], message: str, retry_after: Optional[float] = None):
        super().__init__(message if status is None else f"{message} (status {status})")
        self.status, self.message, self.retry_after = status, message, retry_after

    @classmethod
    def of_answer(cls, status: int, body: bytes, retry_after: Optional[str] = None) -> ServiceError:
        message = body.decode(errors="replace").strip()
        try:
            message = str(json.loads(message)["error"])
        except (ValueError, KeyError, TypeError):
            pass  # a text, as of what stands before the service
        if status != 503:
            return cls(status, message)
        return cls(status, message, float(retry_after) if retry_after and retry_after.isdigit() else 1)


class Unreachable(ConnectionError):
    """There is no connection to the service, or it ended before the answer."""


class NoServer(Unreachable):
    """No connection was made, so that nothing has been asked."""
