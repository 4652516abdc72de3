#include "oaslam/objects/association.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "oaslam/estimation/assignment.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/geometry/ideal_image.h"
#include "oaslam/map/next_ids.h"
#include "oaslam/map/parts.h"
#include "oaslam/objects/box_depth.h"
#include "oaslam/objects/box_motion.h"
#include "oaslam/objects/life_cycle.h"
#include "oaslam/objects/own_landmarks.h"

namespace oaslam {
namespace {

// Share of a projection that must be inside the image for an object to be associated; of less, the
// box shows too little to compare.
constexpr double kMinVisibleShare = 0.3;
// Share that must be inside the image for a missing detection to count: detectors often miss cut
// objects.
constexpr double kWellInsideShare = 0.8;
// Detector pixels; missing detections of smaller objects do not count, since detectors often miss
// them.
constexpr double kMinMissedSize = 14;
// Seconds; an older last box is not compared, unless it is of the image before: the view has
// changed since.
constexpr double kMaxBoxAge = 0.5;
// Least overlap of a detection with the track's last box, and with its projected ellipsoid, which
// fits less tightly than a box.
constexpr double kMinIoUWithBox = 0.3, kMinIoUWithProjection = 0.2;
// Seconds after which the errors of a detector are independent.
constexpr double kIndependentInterval = 0.2;

struct Candidate {
  ObjectId object_id;
  const Object* object = nullptr;  // in the snapshot
  std::optional<Box> projection;   // of its ellipsoid, if enough of it is inside the image
  double share_inside = 0;
  double depth = 0, radius = 0;  // depth of its centre; radius of the sphere of the same volume
  std::vector<LandmarkId> landmarks;     // landmarks that belong to it
  std::optional<MotionSinceBox> motion;  // since its last box; nothing where that is not known

  bool IsMapped() const { return object && object->state == ObjectState::kMapped; }
};

// Decides which objects an image may show: those whose sphere, enlarged three times, is partly
// inside the cone around the image.
class ViewCone {
 public:
  ViewCone(const Rigid3& cam_from_world, const IdealImage& image, const Camera& camera)
      : cam_from_world_(cam_from_world) {
    const Box& b = image.bounds();
    for (const double x : {b.x1, b.x2})
      for (const double y : {b.y1, b.y2})
        half_angle_ = std::max(half_angle_, AngleFromAxis(RayOf(camera, {x, y})));
  }
  bool MayShow(const ObjectPlace& place) const {
    constexpr double kTimesAsLarge = 3;  // the ellipsoid may be wrong; more cost time only
    const Eigen::Vector3d center = cam_from_world_ * place.center;
    const double distance = center.norm(), radius = kTimesAsLarge * place.radius;
    return distance <= radius ||
           AngleFromAxis(center) <= half_angle_ + std::asin(radius / distance);
  }

 private:
  static double AngleFromAxis(const Eigen::Vector3d& ray) {
    return std::atan2(ray.head<2>().norm(), ray.z());
  }
  Rigid3 cam_from_world_;
  double half_angle_ = 0;
};

bool IsFresh(const ObjectTrack& track, const Frame& frame) {
  return track.last_frame >= 0 &&
         (frame.timestamp - track.last_time <= kMaxBoxAge || frame.index - track.last_frame <= 1);
}

// Brings the open tracks up to date with the map: removes those whose object was dropped or is no
// longer near the view, redirects those whose object was merged, and adds tracks for the objects of
// the map in view that have none: mapped ones, and those that are known by their landmarks.
void SynchronizeWith(const Map& snapshot, const Frame& frame, const ViewCone& view,
                     ObjectTracks& tracks) {
  tracks.places.Update(snapshot.objects);
  std::vector<ObjectTrack> kept;
  for (ObjectTrack track : tracks.open) {
    const std::optional<ObjectId> id = snapshot.ResolveObject(track.object);
    if (!id && track.in_map) continue;
    if (id) {
      track.object = *id;
      track.in_map = true;
    }
    const bool mapped = id && snapshot.objects.At(*id).state == ObjectState::kMapped;
    const bool is_kept =
        mapped ? IsFresh(track, frame)
               : !IsForgotten({frame.index - track.last_frame, frame.timestamp - track.last_time});
    if (is_kept) kept.push_back(track);
  }
  for (const ObjectPlace& place : tracks.places.all())
    if ((place.is_mapped || place.is_known_by_landmarks) && view.MayShow(place))
      kept.push_back({.object = place.id, .in_map = true});
  // Of several tracks of one object, keep the one seen last.
  std::ranges::sort(kept, [](const ObjectTrack& a, const ObjectTrack& b) {
    return a.object != b.object ? a.object < b.object : a.last_frame > b.last_frame;
  });
  const auto duplicates = std::ranges::unique(kept, {}, &ObjectTrack::object);
  kept.erase(duplicates.begin(), duplicates.end());
  tracks.open = std::move(kept);
}

// A lower bound on the depth of nearly everything in view, from the landmarks in view, or else from
// the objects that have an ellipsoid; nothing where there are neither.
std::optional<double> LeastDepth(const TrackedFrame& tracked, const Map& snapshot,
                                 const ObjectTracks& tracks) {
  std::vector<double> depths;
  const auto add = [&](const Eigen::Vector3d& point) {
    if (const double z = (tracked.cam_from_world * point).z(); z > 0) depths.push_back(z);
  };
  for (const LandmarkId id : tracked.landmarks)
    if (const Landmark* landmark = snapshot.landmarks.Find(id)) add(landmark->position);
  if (depths.empty())
    for (const ObjectTrack& track : tracks.open)
      if (const Object* object = snapshot.objects.Find(track.object);
          object && object->state != ObjectState::kTentative)
        add(object->ellipsoid.center);
  if (depths.empty()) return std::nullopt;
  const auto near = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 10);
  std::ranges::nth_element(depths, near);
  return *near / 2;
}

std::optional<MotionSinceBox> MotionSince(const ObjectTrack& track, const TrackedFrame& tracked,
                                          const Map& snapshot,
                                          const std::optional<double>& least_depth) {
  if (track.last_frame < 0 || !least_depth) return std::nullopt;
  const std::optional<Rigid3> reference_from_world = snapshot.ResolvePose(track.reference);
  if (!reference_from_world) return std::nullopt;
  const Rigid3 then_from_world = track.cam_from_reference * *reference_from_world;
  const Rigid3 now_from_then = tracked.cam_from_world * then_from_world.Inverse();
  // Nor is anything nearer than the distance between the two cameras.
  return MotionSinceBox{now_from_then, std::max(*least_depth, now_from_then.translation.norm())};
}

std::vector<Candidate> FindCandidates(const TrackedFrame& tracked, const Map& snapshot,
                                      const ObjectTracks& tracks, const IdealImage& image) {
  std::vector<Candidate> candidates;
  const std::optional<double> least_depth = LeastDepth(tracked, snapshot, tracks);
  const Camera& camera = *tracked.frame.camera;
  for (const ObjectTrack& track : tracks.open) {
    const Object* object = snapshot.objects.Find(track.object);
    Candidate c;
    c.object_id = track.object;
    c.object = object;
    c.motion = MotionSince(track, tracked, snapshot, least_depth);
    const bool has_ellipsoid = c.object && c.object->state != ObjectState::kTentative;
    // Unmapped objects that are not tracked at present are compared by their landmarks alone.
    if (has_ellipsoid && (c.IsMapped() || track.last_frame >= 0)) {
      c.projection = ProjectToBox(c.object->ellipsoid, tracked.cam_from_world, camera);
      if (c.projection) c.share_inside = image.ShareShown(*c.projection);
      c.depth = (tracked.cam_from_world * c.object->ellipsoid.center).z();
      c.radius = std::cbrt(c.object->ellipsoid.half_axes.prod());
      if (c.share_inside < kMinVisibleShare) c.projection.reset();
    }
    if (has_ellipsoid || (c.object && c.object->known_by_landmarks))
      c.landmarks = OwnLandmarks(*c.object);
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
    if (x >= box.x1 && x <= box.x2 && y >= box.y1 && y <= box.y2)
      inside.push_back(tracked.landmarks[i]);
  }
  std::ranges::sort(inside);
  return inside;
}

double OverlapWithLastBox(const ObjectDetection& detection, const Candidate& candidate,
                          const ObjectTrack& track, const Camera& camera) {
  return candidate.motion ? OverlapAfterMotion(track.last_box, detection.box, detection.truncated,
                                               *candidate.motion, camera)
                          : IoU(track.last_box, detection.box);
}

// The overlap required of boxes whose labels agree to this degree: the less the labels agree, the
// more the boxes must overlap.
double LeastOverlap(double configured, double agreement) {
  return configured + (1 - configured) * (1 - agreement);
}

double Affinity(const ObjectDetection& detection, const std::vector<LandmarkId>& landmarks,
                const Candidate& candidate, const ObjectTrack& track, const Frame& frame,
                const Camera& camera) {
  const LabelsRef labels = candidate.object ? LabelsOf(*candidate.object) : LabelsOf(track);
  const double agreement = LabelAgreement(LabelsOf(detection), labels);
  if (!(agreement >= kLeastAgreement)) return 0;
  double score = 0;
  if (IsFresh(track, frame)) {
    const double iou = OverlapWithLastBox(detection, candidate, track, camera);
    if (iou >= LeastOverlap(kMinIoUWithBox, agreement)) score = iou;
  }
  if (candidate.projection) {
    const double iou = IoU(
        ClipAtTruncation(*candidate.projection, detection.box, detection.truncated), detection.box);
    if (iou >= LeastOverlap(kMinIoUWithProjection, agreement)) score = std::max(score, iou);
  }
  // Landmarks are more precise than boxes: where the labels agree equally well, any match by
  // landmarks scores higher than one by overlap alone.
  const int shared = CountShared(landmarks, candidate.landmarks);
  if (shared >= kMinSharedPoints)
    score += 1 + static_cast<double>(shared) / static_cast<double>(landmarks.size());
  return agreement * score;
}

void SeeIn(const Frame& frame, const ObjectSighting& sighting, ObjectTrack& track) {
  const ObjectObservation& observation = sighting.observation;
  track.category_id = sighting.category_id;
  track.shares = sighting.shares;
  track.last_box = observation.box;
  track.last_frame = frame.index;
  track.last_time = frame.timestamp;
  track.reference = observation.reference;
  track.cam_from_reference = observation.cam_from_reference;
}

// Judges which mapped objects the frame should show, and whether it shows them in their places.
class PlaceJudge {
 public:
  PlaceJudge(const TrackedFrame& tracked, const Map& snapshot,
             const std::vector<Candidate>& candidates, const std::vector<int>& track_of,
             const std::vector<ObjectSighting>& sightings)
      : tracked_(tracked),
        snapshot_(snapshot),
        candidates_(candidates),
        seen_(candidates.size(), 0) {
    for (size_t i = 0; i < track_of.size(); ++i) {
      if (track_of[i] >= 0) seen_[track_of[i]] = 1;
      if (track_of[i] < 0 || !candidates[track_of[i]].IsMapped())
        in_unknown_depth_.push_back(sightings[i].observation.box);
    }
    for (const ObjectDetection& d : tracked.frame.detections)
      if (snapshot.classes.IsMovable(d.category_id)) in_unknown_depth_.push_back(d.box);
  }

  bool IsExpected(size_t j) const {
    const Candidate& c = candidates_[j];
    const double min_size = kMinMissedSize * DetectorPixel(*tracked_.frame.camera);
    return c.projection && c.IsMapped() && c.share_inside >= kWellInsideShare &&
           SizeOf(*c.projection) >= min_size && !IsSeenAsPartOrWhole(j);
  }
  bool IsSeen(size_t j) const { return seen_[j] != 0; }

  // The evidence of an expected object that is not seen in its place: kAbsent if nothing explains
  // that, else kNone.
  PlaceEvidence OfAbsence(size_t j) const {
    const Candidate& c = candidates_[j];
    std::vector<Box> nearer = in_unknown_depth_;
    for (const Candidate& other : candidates_)
      if (other.projection && other.IsMapped() && other.depth + other.radius < c.depth &&
          !AreTogether(c, other))
        nearer.push_back(*other.projection);
    const bool is_clear = HiddenShare(*c.projection, nearer) < kMaxHiddenShare &&
                          WasSeenFrom(snapshot_, *c.object, tracked_.cam_from_world);
    return is_clear ? PlaceEvidence::kAbsent : PlaceEvidence::kNone;
  }

 private:
  bool AreTogether(const Candidate& a, const Candidate& b) const {
    return BelongTogether(snapshot_.classes, a.object->category_id, a.object->ellipsoid,
                          b.object->category_id, b.object->ellipsoid);
  }
  bool IsSeenAsPartOrWhole(size_t j) const {
    if (seen_[j] || snapshot_.classes.whole_of.empty()) return false;
    for (size_t k = 0; k < candidates_.size(); ++k)
      if (seen_[k] && candidates_[k].IsMapped() && AreTogether(candidates_[j], candidates_[k]))
        return true;
    return false;
  }

  const TrackedFrame& tracked_;
  const Map& snapshot_;
  const std::vector<Candidate>& candidates_;
  std::vector<char> seen_;
  // Boxes of objects that move or are not mapped yet. Their depth is unknown, so they may hide any
  // object.
  std::vector<Box> in_unknown_depth_;
};

// Sets ObjectSighting::place, and adds sightings of expected objects that were not detected. The
// first sightings correspond to `track_of`.
void JudgePlaces(const TrackedFrame& tracked, const Map& snapshot,
                 const std::vector<Candidate>& candidates, const std::vector<int>& track_of,
                 std::vector<ObjectSighting>& sightings) {
  const PlaceJudge judge(tracked, snapshot, candidates, track_of, sightings);
  for (size_t i = 0; i < track_of.size(); ++i) {
    if (track_of[i] < 0) continue;
    const Candidate& c = candidates[track_of[i]];
    if (!c.projection || !c.IsMapped()) continue;
    const ObjectObservation& o = sightings[i].observation;
    const double iou = IoU(ClipAtTruncation(*c.projection, o.box, o.truncated), o.box);
    if (iou >= kMinAcceptIoU)
      sightings[i].place = PlaceEvidence::kInPlace;
    else if (judge.IsExpected(track_of[i]))
      sightings[i].place = judge.OfAbsence(track_of[i]);
  }
  for (size_t j = 0; j < candidates.size(); ++j) {
    if (judge.IsSeen(j) || !judge.IsExpected(j)) continue;
    ObjectSighting missed;
    missed.object = candidates[j].object_id;
    missed.detected = false;
    missed.place = judge.OfAbsence(j);
    sightings.push_back(std::move(missed));
  }
  // Where most objects are out of place, the camera pose or the detector is probably wrong.
  const auto in_place =
      std::ranges::count(sightings, PlaceEvidence::kInPlace, &ObjectSighting::place);
  const auto absent = std::ranges::count(sightings, PlaceEvidence::kAbsent, &ObjectSighting::place);
  if (absent <= std::max<std::ptrdiff_t>(in_place, 1)) return;
  for (ObjectSighting& sighting : sightings)
    if (sighting.place == PlaceEvidence::kAbsent) sighting.place = PlaceEvidence::kNone;
}

}  // namespace

ObjectTracks ObjectTracks::ContinueFrom(const Map& map) {
  ObjectTracks tracks;
  tracks.next_object = NextObjectOf(map);
  return tracks;
}

namespace {

// The camera of the map in whose ideal image the boxes of an image are kept.
struct ObservingCamera {
  int index = 0;           // into Map::cameras
  double focal_ratio = 1;  // its focal length, divided by the image's
};

// Where the focal length changes from image to image, that of an image is in the map only if the
// image is a keyframe: else the camera of its reference keyframe is taken, or another one of the
// same lens.
ObservingCamera ObservingCameraOf(const TrackedFrame& tracked, const Map& snapshot) {
  const Camera& camera = *tracked.frame.camera;
  if (snapshot.HasCamera(camera)) return {snapshot.IndexOf(camera)};
  const auto ratio_to = [&](int index) {
    return ZoomBetween(camera, snapshot.cameras[static_cast<size_t>(index)]);
  };
  if (const auto carried = snapshot.ResolveKeyframe(tracked.reference)) {
    const int index = snapshot.keyframes.At(carried->by).camera;
    if (const auto ratio = ratio_to(index)) return {index, *ratio};
  }
  for (int index = 0; index < static_cast<int>(snapshot.cameras.size()); ++index)
    if (const auto ratio = ratio_to(index)) return {index, *ratio};
  return {snapshot.IndexOf(camera)};  // which fails: the image is of no camera of the map
}

// A box of the ideal image, as it would be with `ratio` times the focal length.
Box AsThrough(double ratio, const Camera& camera, const Box& box) {
  const double cx = camera.cx + kBoxFromPixel, cy = camera.cy + kBoxFromPixel;
  return {cx + ratio * (box.x1 - cx), cy + ratio * (box.y1 - cy), cx + ratio * (box.x2 - cx),
          cy + ratio * (box.y2 - cy)};
}

}  // namespace

ObjectAssociation AssociateObjects(const TrackedFrame& tracked, const Map& snapshot,
                                   ObjectTracks tracks, const ObjectsConfig& config) {
  const Frame& frame = tracked.frame;
  const Camera& camera = *frame.camera;
  const IdealImage image(camera);
  SynchronizeWith(snapshot, frame, ViewCone(tracked.cam_from_world, image, camera), tracks);
  const std::vector<Candidate> candidates = FindCandidates(tracked, snapshot, tracks, image);

  const double interval =
      tracks.last_time ? std::max(frame.timestamp - *tracks.last_time, 0.0) : kVideoInterval;
  const double weight = std::min(interval, kIndependentInterval) / kVideoInterval;
  if (!frame.detections.empty()) tracks.last_time = frame.timestamp;

  if (const auto unit = UnitsPerMetre(tracked, snapshot)) tracks.units_per_metre = unit;
  const ObservingCamera observing = ObservingCameraOf(tracked, snapshot);
  std::vector<ObjectSighting> sightings;
  for (const ObjectDetection& detection : frame.detections) {
    // Where the lens model is not one to one, a box may be empty in the ideal image.
    if (!(detection.score > config.min_score) || !(detection.box.Area() > 0) ||
        snapshot.classes.IsMovable(detection.category_id))
      continue;
    ObjectSighting sighting;
    sighting.category_id = detection.category_id;
    sighting.shares = detection.shares;
    sighting.landmarks = LandmarksInside(tracked, detection.box);
    sighting.observation = {
        frame.index,   tracked.reference, tracked.cam_from_reference, observing.index,
        detection.box, detection.score,   detection.truncated,        weight};
    if (frame.depth && tracks.units_per_metre)
      sighting.observation.surface =
          *tracks.units_per_metre * SurfaceIn(detection.box, camera, *frame.depth).value_or(0);
    sightings.push_back(std::move(sighting));
  }
  Eigen::MatrixXd scores(sightings.size(), candidates.size());
  for (size_t i = 0; i < sightings.size(); ++i) {
    const ObjectObservation& o = sightings[i].observation;
    const ObjectDetection detection{sightings[i].category_id, o.score, o.box, o.truncated,
                                    sightings[i].shares};
    for (size_t j = 0; j < candidates.size(); ++j)
      scores(i, j) =
          Affinity(detection, sightings[i].landmarks, candidates[j], tracks.open[j], frame, camera);
  }

  const std::vector<int> track_of = AssignMaximum(scores);
  for (size_t i = 0; i < sightings.size(); ++i) {
    ObjectSighting& sighting = sightings[i];
    if (track_of[i] >= 0) {
      ObjectTrack& track = tracks.open[track_of[i]];
      sighting.object = track.object;
      SeeIn(frame, sighting, track);
    } else {
      sighting.object = ObjectId(tracks.next_object++);
      sighting.is_new = true;
      ObjectTrack track{.object = sighting.object};
      SeeIn(frame, sighting, track);
      tracks.open.push_back(track);
    }
  }
  if (!frame.detections.empty()) JudgePlaces(tracked, snapshot, candidates, track_of, sightings);
  for (ObjectSighting& sighting : sightings) {
    sighting.timestamp = frame.timestamp;
    sighting.interval_s = interval;
    if (observing.focal_ratio != 1)
      sighting.observation.box = AsThrough(observing.focal_ratio, camera, sighting.observation.box);
  }
  return {std::move(tracks), std::move(sightings)};
}

}  // namespace oaslam
