#pragma once

#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/presence.h"

namespace oaslam {

// One detection of a frame and the object it is of; or that an object was not detected where it
// should have been.
struct ObjectSighting {
  ObjectId object;  // as the tracker knows it; the mapper resolves merged objects
  int category_id = 0;
  bool is_new = false;   // its first: the mapper creates the object
  bool detected = true;  // false: predicted well inside the image and missed; no observation and no
                         // landmarks then
  PlaceEvidence place = PlaceEvidence::kNone;  // of a mapped object
  double timestamp = 0;                        // of the image
  double interval_s = kVideoInterval;          // that the image stands for
  ObjectObservation observation;
  std::vector<LandmarkId> landmarks;  // ascending; of the matched key points inside the box
};

// What the tracker remembers of an object.
struct ObjectTrack {
  ObjectId object;
  int category_id = 0;
  Box last_box;         // ideal image
  int last_frame = -1;  // of last_box; -1: not seen since the tracker started
  double last_time = 0;
  bool in_map = false;  // a snapshot held it
};

// The tracker's open tracks, a value, ascending by object. It alone creates ids of objects.
struct ObjectTracks {
  std::vector<ObjectTrack> open;
  uint32_t next_object = 0;
  std::optional<double> last_time{};  // of the last image with detections

  // For a map from a file: its objects are re-associated, new ones get new ids.
  static ObjectTracks ContinueFrom(const Map& map);
};

struct ObjectAssociation {
  ObjectTracks tracks;  // after this frame
  std::vector<ObjectSighting> sightings;
};

// Decides which object each detection is of: optimal one-to-one within a class, by the overlap with
// the object's last box or with its projection (paper, section "Box-based Object Tracking") or by
// shared landmarks ("Point-based"); the rest open new tracks. Classes that move (Map::classes) are
// left out. The snapshot is the one the frame was tracked in.
ObjectAssociation AssociateObjects(const TrackedFrame& tracked, const Map& snapshot,
                                   ObjectTracks tracks, const ObjectsConfig& config);

}  // namespace oaslam
