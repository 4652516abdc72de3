#pragma once

#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/object_places.h"
#include "oaslam/objects/presence.h"

namespace oaslam {

// A detection in a frame with the object it shows, or the fact that an expected object was not
// detected.
struct ObjectSighting {
  ObjectId object;  // as the tracker knows it; the mapper resolves merged objects
  int category_id = 0;
  LabelShares shares{};
  bool is_new = false;  // first sighting: the mapper creates the object
  // False: the object was expected well inside the image and not detected; the sighting has no
  // observation and no landmarks then.
  bool detected = true;
  PlaceEvidence place = PlaceEvidence::kNone;  // whether a mapped object is in its place
  double timestamp = 0;                        // of the image
  double interval_s = kVideoInterval;          // seconds since the previous image
  ObjectObservation observation;
  std::vector<LandmarkId> landmarks;  // of the matched key points inside the box, ascending
};

// The tracker's knowledge of an object.
struct ObjectTrack {
  ObjectId object;
  int category_id = 0;  // of the detection with last_box
  Box last_box{};       // ideal image
  int last_frame = -1;  // of last_box; -1: not seen since the tracker started
  double last_time = 0;
  bool in_map = false;  // a snapshot contained the object
  // The pose of the image of last_box, relative to a keyframe.
  KeyframeId reference{};
  Rigid3 cam_from_reference{};
  LabelShares shares{};  // of the detection with last_box
};

// The open tracks of the tracker, ascending by object: of the objects seen lately, and of the
// mapped ones that may be in view. Only the tracker creates ids of objects.
struct ObjectTracks {
  std::vector<ObjectTrack> open;
  uint32_t next_object = 0;
  std::optional<double> last_time{};        // of the last image with detections
  std::optional<double> units_per_metre{};  // of the map, by the last image with depths
  ObjectPlaces places{};                    // of the last snapshot

  // For a map from a file: its objects are associated again, and new objects get new ids.
  static ObjectTracks ContinueFrom(const Map& map);
};

struct ObjectAssociation {
  ObjectTracks tracks;  // the tracks after this frame
  std::vector<ObjectSighting> sightings;
};

// Decides which object each detection shows: the best one-to-one assignment. A pair scores by how
// well the labels agree (label_shares.h), times the overlap of the box with the object's last box
// or with its projection (paper, section "Box-based Object Tracking"), or by shared landmarks
// ("Point-based"). Unlike in the paper, the last box is first moved as the camera has moved since
// (box_motion.h). Unassigned detections open new tracks. Classes that move (Map::classes) are left
// out. `snapshot` is the map in which the frame was tracked.
ObjectAssociation AssociateObjects(const TrackedFrame& tracked, const Map& snapshot,
                                   ObjectTracks tracks, const ObjectsConfig& config);

}  // namespace oaslam
