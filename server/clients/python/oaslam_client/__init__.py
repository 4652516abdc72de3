"""Client of `oaslam serve`, which tells where cameras are in maps (docs/service.md of OA-SLAM). It needs Python 3.9 and nothing else.

    from oaslam_client import Client

    with Client("http://localhost:8340") as client:
        print(client.localize("desk", ["photo.jpg"])["results"][0])
"""
from .client import Client
from .errors import ServiceError, Unreachable
from .shapes import Anchor, Anchors, Camera, Image, Localized, Map, Pose, Result, StoredMap
from .stream import Record, Track
from .websocket import Closed

__all__ = ["Anchor", "Anchors", "Camera", "Client", "Closed", "Image", "Localized", "Map", "Pose", "Record", "Result", "ServiceError", "StoredMap", "Track",
           "Unreachable"]
