"""The JSON of the service as types. docs/service.md tells their meaning, frames and units."""
from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, TypedDict, Union

# "auto", "fov:DEGREES", or intrinsics: {"model", "width", "height", "fx", "fy", "cx", "cy", "distortion"}, in pixels.
Camera = Union[str, Mapping[str, Any]]

# The bytes or the path of a JPEG or PNG file; or {"image": bytes or path, "camera", "detections", "gravity", "prior", "time"}, each of which may
# be missing.
Image = Union[bytes, str, "os.PathLike[str]", Mapping[str, Any]]


class Pose(TypedDict):
    """Camera to world with x right, y down, z forward; or anchor to world with y up and the front towards +z. Map units."""
    position: List[float]  # x, y, z
    rotation: List[float]  # quaternion x, y, z, w


class StoredMap(TypedDict):
    name: str
    digest: str  # SHA-256 of the file
    bytes: int
    changed: float  # seconds since 1970


class AnchorBase(TypedDict):
    name: str
    model: str
    size: float
    pose: Pose
    version: int


class Anchor(AnchorBase, total=False):
    object: int  # that it stands on


class Anchors(TypedDict):
    version: int
    complete: bool  # these are all the anchors: others that were known before are gone
    anchors: List[Anchor]
    removed: List[str]


class Map(StoredMap):
    keyframes: int
    landmarks: int
    objects: List[Dict[str, Any]]  # {"id", "category", "name"?, "ellipsoid"}
    anchors: List[Anchor]
    bounds: Any  # two corners of the box around the landmarks, or None
    up: Any  # unit vector, or None
    is_metric: bool
    unit_sigma: float  # of the metre by the sizes of objects, divided by it; 0 where the metre was given or there is none


class ResultBase(TypedDict):
    found: bool
    confidence: float
    ms: float


class Result(ResultBase, total=False):
    """Of one image. `why_not` is there if it was not found, all others if it was."""
    why_not: str
    pose: Pose
    evidence: str  # points, objects or points+objects
    inlier_points: int
    matched_objects: int
    sigma_position: float  # map units
    camera: Dict[str, Any]
    objects: List[Dict[str, Any]]  # {"id", "category", "box"} of those in view


class Localized(TypedDict):
    map: str
    digest: str
    results: List[Result]  # one for each image
    anchors: List[Anchor]
