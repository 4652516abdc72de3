#pragma once

#include <cstdint>

namespace oaslam {

constexpr int32_t kMapApplicationId = 0x4F41534C;  // "OASL"
// PRAGMA user_version. Format 10 knows the metre by objects alone. Format 9 does not say what the
// metre follows from, 8 lacks the recordings, too; older ones were in no release, and are not read.
constexpr int32_t kMapFormatVersion = 11, kOldestMapFormatVersion = 8;

// The map is stored in parts, each with a checksum of its own (table `parts`). Keyframes and
// landmarks are in parts of this many ids, each about a megabyte; each submap is one part.
constexpr uint32_t kKeyframesOfAPart = 64, kLandmarksOfAPart = 4096;

// Documented in docs/formats.md: change both together. Poses are quaternion x y z w and
// translation; blobs are little-endian.
constexpr const char* kMapSchema = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value) WITHOUT ROWID;
CREATE TABLE cameras(id INTEGER PRIMARY KEY, name TEXT, model TEXT, width INTEGER, height INTEGER,
  fx REAL, fy REAL, cx REAL, cy REAL, k1 REAL, k2 REAL, p1_or_k3 REAL, p2_or_k4 REAL, k3 REAL, is_guess INTEGER);
CREATE TABLE keyframes(id INTEGER PRIMARY KEY, frame_index INTEGER, timestamp REAL, camera INTEGER REFERENCES cameras,
  cam_from_world_qx REAL, cam_from_world_qy REAL, cam_from_world_qz REAL, cam_from_world_qw REAL,
  cam_from_world_tx REAL, cam_from_world_ty REAL, cam_from_world_tz REAL);
CREATE TABLE retired_keyframes(id INTEGER PRIMARY KEY, parent INTEGER,
  cam_from_parent_qx REAL, cam_from_parent_qy REAL, cam_from_parent_qz REAL, cam_from_parent_qw REAL,
  cam_from_parent_tx REAL, cam_from_parent_ty REAL, cam_from_parent_tz REAL);
CREATE TABLE features(keyframe INTEGER PRIMARY KEY REFERENCES keyframes, count INTEGER, levels INTEGER, scale_factor REAL, scales BLOB,
  x1 REAL, y1 REAL, x2 REAL, y2 REAL, keypoints BLOB, descriptors BLOB);
CREATE TABLE learned_descriptors(keyframe INTEGER PRIMARY KEY REFERENCES keyframes, count INTEGER, keypoints BLOB, descriptors BLOB, depths BLOB);
CREATE TABLE covisibility(keyframe INTEGER REFERENCES keyframes, rank INTEGER, neighbor INTEGER REFERENCES keyframes, shared INTEGER,
  PRIMARY KEY(keyframe, rank)) WITHOUT ROWID;
CREATE TABLE landmarks(id INTEGER PRIMARY KEY, x REAL, y REAL, z REAL, normal_x REAL, normal_y REAL, normal_z REAL,
  min_distance REAL, max_distance REAL, first_keyframe INTEGER, visible INTEGER, found INTEGER, descriptor BLOB);
CREATE TABLE observations(landmark INTEGER REFERENCES landmarks, keyframe INTEGER REFERENCES keyframes, keypoint INTEGER,
  PRIMARY KEY(landmark, keyframe)) WITHOUT ROWID;
CREATE TABLE objects(id INTEGER PRIMARY KEY, category_id INTEGER, state TEXT, center_x REAL, center_y REAL, center_z REAL,
  half_axis_x REAL, half_axis_y REAL, half_axis_z REAL, world_from_object_qx REAL, world_from_object_qy REAL, world_from_object_qz REAL,
  world_from_object_qw REAL, covariance BLOB, detection_rate REAL, mean_iou REAL, total_observations INTEGER, last_seen_frame INTEGER, name TEXT);
CREATE TABLE object_observations(object INTEGER REFERENCES objects, rank INTEGER, frame_index INTEGER, anchor INTEGER,
  cam_from_anchor_qx REAL, cam_from_anchor_qy REAL, cam_from_anchor_qz REAL, cam_from_anchor_qw REAL,
  cam_from_anchor_tx REAL, cam_from_anchor_ty REAL, cam_from_anchor_tz REAL, camera INTEGER REFERENCES cameras,
  x1 REAL, y1 REAL, x2 REAL, y2 REAL, score REAL, truncated INTEGER, PRIMARY KEY(object, rank)) WITHOUT ROWID;
CREATE TABLE object_labels(object INTEGER REFERENCES objects, category_id INTEGER, share REAL,
  PRIMARY KEY(object, category_id)) WITHOUT ROWID;
CREATE TABLE object_landmarks(object INTEGER REFERENCES objects, landmark INTEGER, votes INTEGER,
  PRIMARY KEY(object, landmark)) WITHOUT ROWID;
CREATE TABLE merged_objects(id INTEGER PRIMARY KEY, merged_into INTEGER);
CREATE TABLE trajectory(rank INTEGER PRIMARY KEY, frame_index INTEGER, timestamp REAL, reference INTEGER,
  cam_from_reference_qx REAL, cam_from_reference_qy REAL, cam_from_reference_qz REAL, cam_from_reference_qw REAL,
  cam_from_reference_tx REAL, cam_from_reference_ty REAL, cam_from_reference_tz REAL, state TEXT);
CREATE TABLE recordings(number INTEGER PRIMARY KEY, name TEXT, images TEXT, first_frame INTEGER);
CREATE TABLE class_names(category_id INTEGER PRIMARY KEY, name TEXT);
CREATE TABLE anchors(name TEXT PRIMARY KEY, model TEXT, size REAL, keyframe INTEGER,
  cam_from_anchor_qx REAL, cam_from_anchor_qy REAL, cam_from_anchor_qz REAL, cam_from_anchor_qw REAL,
  cam_from_anchor_tx REAL, cam_from_anchor_ty REAL, cam_from_anchor_tz REAL,
  object INTEGER, offset_x REAL, offset_y REAL, offset_z REAL) WITHOUT ROWID;
CREATE TABLE parts(name TEXT, first INTEGER, last INTEGER, checksum TEXT, PRIMARY KEY(name, first)) WITHOUT ROWID;
CREATE TABLE pieces(number INTEGER PRIMARY KEY, map BLOB);
)sql";

// Columns of a key point in features.keypoints.
struct StoredKeypoint {
  float x, y, angle_rad;
  int32_t octave;
};
static_assert(sizeof(StoredKeypoint) == 16);

}  // namespace oaslam
