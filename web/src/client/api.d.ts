// Made of data/openapi.json by web/build.mjs: do not edit. docs/service.md tells what the values mean, their frames and units.

/** x, y, z */
export type Vector = [number, number, number];

/** x, y, z, w */
export type Quaternion = [number, number, number, number];

/** x1, y1, x2, y2 in pixels */
export type Box = [number, number, number, number];

/** Of a camera: camera to world, OpenCV's axes. Of an anchor: anchor to world, y up, front +z. */
export interface Pose {
  position: Vector;
  rotation: Quaternion;
}

/** auto: found by the map. */
export type Camera = string | Intrinsics;

/** In pixels */
export interface Intrinsics {
  width: number;
  height: number;
  fx: number;
  model?: "pinhole" | "fisheye";
  fy?: number;
  cx?: number;
  cy?: number;
  distortion?: number[];
  name?: string;
  is_guess?: boolean;
}

export interface Detection {
  bbox: Box;
  category_id?: number;
  detection_score?: number;
  /** [category_id, score] of all classes that it may be; without them category_id and detection_score are needed */ labels?: [number, number][];
  ellipse?: [number, number, number, number, number];
}

export type Mode = "points" | "objects" | "points+objects";

export interface Image {
  /** JPEG or PNG, also as a data: URL; without it the detections alone are used */ image?: string;
  camera?: Camera;
  detections?: Detection[];
  gravity?: Vector;
  prior?: Pose;
  time?: number;
}

export interface LocalizeRequest {
  images: Image[];
  mode?: Mode;
}

export interface Localized {
  map: string;
  digest: string;
  results: Result[];
  anchors: Anchor[];
}

export type Result = Found | NotFound;

export interface Found {
  found: true;
  pose: Pose;
  confidence: number;
  evidence: "points" | "objects" | "points+objects";
  inlier_points: number;
  matched_objects: number;
  sigma_position: number;
  ms: number;
  camera?: Intrinsics;
  objects?: { id: number; category: string; box: Box }[];
}

export interface NotFound {
  found: false;
  why_not: string;
  confidence: number;
  ms: number;
}

/** changed: seconds since 1970 */
export interface StoredMap {
  name: string;
  digest: string;
  bytes: number;
  changed: number;
}

export interface Map {
  name: string;
  digest: string;
  bytes: number;
  changed: number;
  keyframes: number;
  landmarks: number;
  objects: Object[];
  anchors: Anchor[];
  bounds: [Vector, Vector] | null;
  up: Vector | null;
  is_metric: boolean;
  unit_sigma: number;
}

export interface Ellipsoid {
  center: Vector;
  half_axes: Vector;
  rotation: Quaternion;
}

export interface Object {
  id: number;
  category: string;
  ellipsoid: Ellipsoid;
  name?: string;
}

export interface Anchor {
  name: string;
  model: string;
  size: number;
  pose: Pose;
  version: number;
  object?: number;
}

export interface AnchorRequest {
  model: string;
  name?: string;
  pose?: Pose;
  origin?: Vector;
  direction?: Vector;
  object?: number;
  size?: number;
}

export interface AnchorEdit {
  name?: string;
  model?: string;
  size?: number;
  /** radians about its y axis */ turn?: number;
  pose?: Pose;
}

export interface Error {
  error: string;
}

export interface Anchors {
  version: number;
  /** these are all the anchors: without `since`, or where the map was removed or replaced after it */ complete: boolean;
  anchors: Anchor[];
  removed: string[];
}

export interface Maps {
  maps: StoredMap[];
}
