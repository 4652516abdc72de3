// Messages between the program and its pages, as JSON: docs/viewer.md (the viewer), docs/service.md (the page for phones).
// Lengths are in the unit of the map, angles in radians, times in milliseconds unless said.

export type State = "initializing" | "tracking" | "relocalized" | "objects" | "lost" | "odometry" | "preliminary";
/** qx qy qz qw x y z: of a camera to the map (OpenCV axes), of an anchor to the map (y up, front +z). */
export type Pose = ArrayLike<number>;

export type Triple = [number, number, number];
export type Quaternion = [number, number, number, number];
/** Integers at the centres of pixels. */
export type Pixel = [number, number];

export interface Lens { model?: "pinhole" | "fisheye"; width: number; height: number; fx: number; fy: number; cx: number; cy: number; distortion?: number[] }
export interface Ellipsoid { center: Triple; half_axes: Triple; rotation: Quaternion }
/** An object of the map; `mapped` is false for a candidate, which the map has not accepted yet. */
export interface MapObject extends Ellipsoid { id: number; name: string; category: string; category_id: number | string; mapped: boolean }
export interface Model { name: string; url: string }
export interface Anchor { name: string; model: string; size: number; pose: number[]; object?: number }

// The viewer.
export interface SeenObject extends MapObject { category_id: number; observations: number; score: number; mean_iou: number; last_seen_frame: number }
export interface Detection { box: [left: number, top: number, right: number, bottom: number]; score: number; category_id: number; category: string; object?: number }
/** A mapped object's outline in the image; `angle` is that of the first half axis. */
export interface Outline { object: number; label: string; category_id: number; center: Pixel; half_axes: [number, number]; angle: number }
/** One standard deviation of the camera's position, in the axes of the camera. */
export interface Spread { half_axes: Triple; rotation: Quaternion }
export interface FrameMessage {
  frame: number; state: State; pose?: number[]; spread?: Spread; camera: Lens; detections: Detection[]; ellipses: Outline[];
  inliers: number; confidence: number; uncertain?: boolean; ms: { total: number; features: number; track: number; objects: number };
}
export interface RunEvent { kind: string; text: string; frame?: number }
/** It has the frames from `first_frame` on, up to the next one's. */
export interface Recording { name: string; first_frame: number }
export interface Status { live: boolean; paused: boolean; mapping: boolean; dropped: number; title: string; recordings?: Recording[] }
export interface MapSummary { landmarks: number; keyframes: number; loops: number; metric: boolean; up?: Triple }
export interface Observation { frame: number; score: number; truncated: boolean; camera?: Triple }
export type Arrays = Record<string, any>; // Float32Array, Uint32Array or Uint8Array

export interface Hello { type: "hello"; commands: boolean; anchors?: boolean; models?: Model[] }
export interface Update {
  type: "update"; arrays: Arrays; restart?: boolean; map?: MapSummary; objects?: SeenObject[]; objects_gone?: number[]; path_size?: number;
  events?: RunEvent[]; anchors?: Anchor[]; status?: Status; frame?: FrameMessage;
}
export interface ObjectDetail {
  type: "object"; arrays: Arrays; object: SeenObject; covariance: number[]; detection_rate: number; landmarks: number;
  observations: Observation[]; crops: { frame: number; bytes: number }[];
}
export interface KeyframePicture { type: "keyframe"; arrays: Arrays; keyframe: number; frame: FrameMessage }
export type ViewerMessage = Hello | Update | ObjectDetail | KeyframePicture;

// The page for phones.
export type WirePose = import("./client/api").Pose;
export type WireAnchor = import("./client/api").Anchor;
export type WireObject = import("./client/api").Object;
export interface MapMessage {
  type: "hello" | "map"; map?: string; digest?: string; may_write?: boolean; models?: Model[]; anchors?: WireAnchor[]; objects?: WireObject[]; up?: Triple; is_metric?: boolean;
}
/**
 * `time`: that of the image, in seconds. `depth`: the median of its landmarks. `covariance`: 6 x 6, of a small motion of the camera along its axes (translation,
 * rotation vector). `unit`: map units in the unit of the motion that was sent.
 */
export interface Answer {
  type: "pose"; id: number; time: number; state: State; source?: "none" | "map" | "motion" | "objects" | "registration"; pose?: WirePose; confidence?: number; covariance?: number[]; unit?: number; camera?: Lens; depth: number; ms: number;
}
/** What the device's odometry tells of an image; a keyframe: image, position, rotation. */
export interface Motion {
  run: number; image: number; pose: WirePose; preliminary: boolean; agreeing: number; keyframes: number[][]; keyframe: boolean; depths: number[][];
}
export interface ImageHeader {
  id: number; time: number; camera: Lens | "auto"; motion?: Motion | null; gravity?: Triple; angular_velocity?: number[][]; imu?: number[][]; cam_from_imu?: WirePose;
  features?: { count: number; lowest: number; levels: number; factor: number };
}
export interface Progress { type: "progress"; keyframes?: number; landmarks?: number; objects?: number; text: string }
export interface AnchorChanges { type: "anchors"; anchors?: WireAnchor[]; removed?: string[] }
export type ServiceMessage = MapMessage | Answer | Progress | AnchorChanges | { type: "saved"; map?: string } | { type: "error"; message: string };

// To the program.
export interface Place { origin: Triple; direction: Triple; object?: number }
export interface AnchorEdit { size?: number; turn?: number; rename?: string; remove?: true }
export type Request =
  | { type: "ack" | "finish" } | { type: "object" | "keyframe"; id: number } | { type: "command"; name: string; on?: boolean }
  | ({ type: "place"; model: string } & Place) | ({ type: "anchor"; name: string } & AnchorEdit);
