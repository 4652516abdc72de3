#include "oaslam/objects/association.h"

#include <algorithm>
#include <optional>

#include "oaslam/estimation/assignment.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

constexpr double kMinVisibleShare = 0.3;  // of a projection, to be associated at all
constexpr double kWellInsideShare = 0.8;  // of a projection, to be missed when not detected
constexpr double kMinMissedSizePx = 14;   // smaller objects are not missed, at 640 px width
// A landmark belongs to an object when it was in its boxes a third as often as the most frequent one.
constexpr int kVoteDivisor = 3, kMinVotes = 3;

struct Candidate {
  size_t track = 0;
  const Object* object = nullptr;  // in the snapshot
  std::optional<Box> projection;   // of its ellipsoid, sufficiently inside the image
  double share_inside = 0;
  std::vector<LandmarkId> landmarks;  // that belong to it
};

std::vector<LandmarkId> OwnLandmarks(const Object& object) {
  std::vector<LandmarkId> own;
  if (object.landmark_votes.empty()) return own;
  const int most = *std::ranges::max_element(object.landmark_votes);
  const int enough = std::max(most / kVoteDivisor, kMinVotes);
  for (size_t i = 0; i < object.landmarks.size(); ++i)
    if (object.landmark_votes[i] >= enough) own.push_back(object.landmarks[i]);
  return own;
}

int CountShared(const std::vector<LandmarkId>& a, const std::vector<LandmarkId>& b) {
  int shared = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (*i == *j) ++shared;
    if (*i <= *j)
      ++i;
    else
      ++j;
  }
  return shared;
}

// Tracks whose object was merged or dropped go; objects of the map without a track (of a loaded map) get one.
void SynchronizeWith(const Map& snapshot, int frame, const ObjectsConfig& config, ObjectTracks& tracks) {
  std::vector<ObjectTrack> kept;
  for (ObjectTrack track : tracks.open) {
    const std::optional<ObjectId> id = snapshot.ResolveObject(track.object);
    if (!id && track.in_map) continue;
    if (id) {
      track.object = *id;
      track.in_map = true;
    }
    const bool mapped = id && snapshot.objects.At(*id).state == ObjectState::kMapped;
    if (!mapped && frame - track.last_frame > config.drop_after) continue;
    kept.push_back(track);
  }
  snapshot.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state == ObjectState::kMapped) kept.push_back({id, object.category_id, {}, -1, true});
  });
  // Of several tracks of one object the one seen last.
  std::ranges::sort(kept, [](const ObjectTrack& a, const ObjectTrack& b) {
    return a.object != b.object ? a.object < b.object : a.last_frame > b.last_frame;
  });
  const auto duplicates = std::ranges::unique(kept, {}, &ObjectTrack::object);
  kept.erase(duplicates.begin(), duplicates.end());
  tracks.open = std::move(kept);
}

std::vector<Candidate> FindCandidates(const TrackedFrame& tracked, const Map& snapshot, const ObjectTracks& tracks,
                                      const Box& bounds) {
  std::vector<Candidate> candidates;
  const Camera& camera = snapshot.cameras[tracked.frame.camera];
  for (size_t i = 0; i < tracks.open.size(); ++i) {
    Candidate c{.track = i, .object = snapshot.objects.Find(tracks.open[i].object), .projection = {}, .landmarks = {}};
    if (c.object && c.object->state != ObjectState::kTentative) {
      c.projection = ProjectToBox(c.object->ellipsoid, tracked.cam_from_world, camera);
      if (c.projection) c.share_inside = ShareInside(*c.projection, bounds);
      if (c.share_inside < kMinVisibleShare) c.projection.reset();
      c.landmarks = OwnLandmarks(*c.object);
    }
    candidates.push_back(std::move(c));
  }
  return candidates;
}

std::vector<LandmarkId> LandmarksInside(const TrackedFrame& tracked, const Box& box) {
  std::vector<LandmarkId> inside;
  if (!tracked.frame.features) return inside;
  const auto& keypoints = tracked.frame.features->keypoints;
  for (size_t i = 0; i < tracked.landmarks.size(); ++i) {
    if (!tracked.landmarks[i].IsValid()) continue;
    const double x = keypoints[i].px.x() + kBoxFromPixel, y = keypoints[i].px.y() + kBoxFromPixel;
    if (x >= box.x1 && x <= box.x2 && y >= box.y1 && y <= box.y2) inside.push_back(tracked.landmarks[i]);
  }
  std::ranges::sort(inside);
  return inside;
}

double Affinity(const ObjectDetection& detection, const std::vector<LandmarkId>& landmarks, const Candidate& candidate,
                const ObjectTrack& track, int frame, const ObjectsConfig& config) {
  if (track.category_id != detection.category_id) return 0;
  double score = 0;
  if (track.last_frame >= 0 && frame - track.last_frame <= config.max_box_age) {
    const double iou = IoU(track.last_box, detection.box);
    if (iou >= config.min_iou_box) score = iou;
  }
  if (candidate.projection) {
    const double iou = IoU(ClipAtTruncation(*candidate.projection, detection.box, detection.truncated), detection.box);
    if (iou >= config.min_iou_projection) score = std::max(score, iou);
  }
  // Landmarks are more precise than boxes: they outweigh any overlap.
  const int shared = CountShared(landmarks, candidate.landmarks);
  if (shared >= config.min_shared_points)
    score += 1 + static_cast<double>(shared) / static_cast<double>(landmarks.size());
  return score;
}

}  // namespace

ObjectTracks ObjectTracks::ContinueFrom(const Map& map) {
  ObjectTracks tracks;
  const auto reserve = [&](ObjectId id) { tracks.next_object = std::max(tracks.next_object, id.value + 1); };
  map.objects.ForEach([&](ObjectId id, const Object&) { reserve(id); });
  map.merged_objects.ForEach([&](ObjectId id, const ObjectId&) { reserve(id); });
  return tracks;
}

ObjectAssociation AssociateObjects(const TrackedFrame& tracked, const Map& snapshot, ObjectTracks tracks,
                                   const ObjectsConfig& config) {
  const Frame& frame = tracked.frame;
  const Camera& camera = snapshot.cameras[frame.camera];
  SynchronizeWith(snapshot, frame.index, config, tracks);
  const std::vector<Candidate> candidates = FindCandidates(tracked, snapshot, tracks, IdealImageBounds(camera));

  std::vector<ObjectSighting> sightings;
  for (const ObjectDetection& detection : frame.detections) {
    if (!(detection.score > config.min_score)) continue;
    ObjectSighting sighting;
    sighting.category_id = detection.category_id;
    sighting.landmarks = LandmarksInside(tracked, detection.box);
    sighting.observation = {frame.index,   tracked.reference, tracked.cam_from_reference, frame.camera,
                            detection.box, detection.score,   detection.truncated};
    sightings.push_back(std::move(sighting));
  }
  Eigen::MatrixXd scores(sightings.size(), candidates.size());
  for (size_t i = 0; i < sightings.size(); ++i) {
    const ObjectObservation& o = sightings[i].observation;
    const ObjectDetection detection{sightings[i].category_id, o.score, o.box, o.truncated};
    for (size_t j = 0; j < candidates.size(); ++j)
      scores(i, j) = Affinity(detection, sightings[i].landmarks, candidates[j], tracks.open[j], frame.index, config);
  }

  const std::vector<int> track_of = AssignMaximum(scores);
  std::vector<char> seen(candidates.size(), 0);
  for (size_t i = 0; i < sightings.size(); ++i) {
    ObjectSighting& sighting = sightings[i];
    if (track_of[i] >= 0) {
      ObjectTrack& track = tracks.open[track_of[i]];
      sighting.object = track.object;
      track.last_box = sighting.observation.box;
      track.last_frame = frame.index;
      seen[track_of[i]] = 1;
    } else {
      sighting.object = ObjectId(tracks.next_object++);
      sighting.is_new = true;
      tracks.open.push_back({sighting.object, sighting.category_id, sighting.observation.box, frame.index, false});
    }
  }
  if (!frame.detections.empty()) {
    for (size_t j = 0; j < candidates.size(); ++j) {
      const Candidate& c = candidates[j];
      if (seen[j] || !c.projection || c.object->state != ObjectState::kMapped || c.share_inside < kWellInsideShare)
        continue;
      if (SizeOf(*c.projection) < kMinMissedSizePx * camera.width / 640) continue;
      sightings.push_back({.object = tracks.open[j].object,
                           .category_id = c.object->category_id,
                           .detected = false,
                           .observation = {},
                           .landmarks = {}});
    }
  }
  return {std::move(tracks), std::move(sightings)};
}

}  // namespace oaslam
