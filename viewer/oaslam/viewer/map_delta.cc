#include "oaslam/viewer/map_delta.h"

#include "oaslam/anchors/editing.h"

namespace oaslam {
namespace {

using nlohmann::json;

void AddLandmarks(const Map* before, const Map& now, MessageBuilder& message) {
  std::vector<uint32_t> ids, gone;
  std::vector<float> positions;
  now.landmarks.ForEachDifference(before ? before->landmarks : Table<LandmarkId, Landmark>(),
                                  [&](LandmarkId id, const Landmark* a, const Landmark* b) {
                                    if (!b) return gone.push_back(id.value);
                                    const Eigen::Vector3f x = b->position.cast<float>();
                                    if (a && a->position.cast<float>() == x) return;
                                    ids.push_back(id.value);
                                    positions.insert(positions.end(), x.data(), x.data() + 3);
                                  });
  message.Add("landmark_ids", ids);
  message.Add("landmark_positions", positions);
  message.Add("landmarks_gone", gone);
}

void AddKeyframes(const Map* before, const Map& now, MessageBuilder& message) {
  std::vector<uint32_t> ids, gone, frames, degrees, edges;
  std::vector<float> poses;
  now.keyframes.ForEachDifference(
      before ? before->keyframes : Table<KeyframeId, Keyframe>(),
      [&](KeyframeId id, const Keyframe* a, const Keyframe* b) {
        if (!b) return gone.push_back(id.value);
        const std::array<float, 7> pose = PoseNumbers(b->cam_from_world.Inverse());
        if (a && PoseNumbers(a->cam_from_world.Inverse()) == pose && a->covisible == b->covisible)
          return;
        ids.push_back(id.value);
        frames.push_back(static_cast<uint32_t>(b->frame_index));
        poses.insert(poses.end(), pose.begin(), pose.end());
        degrees.push_back(static_cast<uint32_t>(b->covisible.size()));
        for (const Covisible& c : b->covisible)
          edges.insert(edges.end(), {c.keyframe.value, static_cast<uint32_t>(c.shared)});
      });
  message.Add("keyframe_ids", ids);
  message.Add("keyframe_frames", frames);
  message.Add("keyframe_poses", poses);
  // Degrees in the covisibility graph: the number of pairs (keyframe, shared landmarks) for each.
  message.Add("keyframe_degrees", degrees);
  message.Add("keyframe_edges", edges);
  message.Add("keyframes_gone", gone);
}

bool IsShown(const Object* object) { return object && object->state != ObjectState::kTentative; }

void AddObjects(const Map* before, const Map& now, const ClassNames& names,
                MessageBuilder& message) {
  json changed = json::array(), gone = json::array();
  now.objects.ForEachDifference(before ? before->objects : Table<ObjectId, Object>(),
                                [&](ObjectId id, const Object* a, const Object* b) {
                                  if (!IsShown(b)) {
                                    if (IsShown(a)) gone.push_back(id.value);
                                    return;
                                  }
                                  json description = DescribeObject(id, *b, names);
                                  if (!IsShown(a) || DescribeObject(id, *a, names) != description)
                                    changed.push_back(std::move(description));
                                });
  if (!changed.empty()) message.header["objects"] = std::move(changed);
  if (!gone.empty()) message.header["objects_gone"] = std::move(gone);
}

json DescribeAnchors(const Map& map) {
  json list = json::array();
  for (const AnchorPose& anchor : PosesOf(map)) {
    list.push_back({{"name", anchor.name},
                    {"model", anchor.model},
                    {"size", anchor.size},
                    {"pose", PoseNumbers(anchor.world_from_anchor)}});
    if (anchor.object) list.back()["object"] = anchor.object->value;
  }
  return list;
}

// Adds all anchors where one has changed, since they are few.
void AddAnchors(const Map* before, const Map& now, MessageBuilder& message) {
  json anchors = DescribeAnchors(now);
  if (anchors != (before ? DescribeAnchors(*before) : json::array()))
    message.header["anchors"] = std::move(anchors);
}

}  // namespace

std::array<float, 7> PoseNumbers(const Rigid3& world_from_cam) {
  const Eigen::Vector4f q = world_from_cam.rotation.coeffs().cast<float>();
  const Eigen::Vector3f t = world_from_cam.translation.cast<float>();
  return {q[0], q[1], q[2], q[3], t[0], t[1], t[2]};
}

json DescribeObject(ObjectId id, const Object& object, const ClassNames& names) {
  const Ellipsoid& e = object.ellipsoid;
  double score = 0;
  for (const ObjectObservation& o : object.observations) score += o.score;
  if (!object.observations.empty()) score /= static_cast<double>(object.observations.size());
  return {{"id", id.value},
          {"category_id", object.category_id},
          {"category", NameOf(names, object.category_id)},
          {"name", object.name},
          {"mapped", object.state == ObjectState::kMapped},
          {"center", {e.center.x(), e.center.y(), e.center.z()}},
          {"half_axes", {e.half_axes.x(), e.half_axes.y(), e.half_axes.z()}},
          {"rotation", {e.rotation.x(), e.rotation.y(), e.rotation.z(), e.rotation.w()}},
          {"observations", object.total_observations},
          {"score", score},
          {"mean_iou", object.mean_iou},
          {"last_seen_frame", object.last_seen_frame}};
}

void AddMapDelta(const Map* before, const Map& now, const ClassNames& names,
                 MessageBuilder& message) {
  if (before == &now) return;
  AddLandmarks(before, now, message);
  AddKeyframes(before, now, message);
  AddObjects(before, now, names, message);
  AddAnchors(before, now, message);
  json& map = message.header["map"];
  map["landmarks"] = now.landmarks.size();  // total numbers, with which the page checks itself
  map["keyframes"] = now.keyframes.size();
  map["loops"] = now.loops_closed;
  map["metric"] = now.is_metric;
  if (now.up) map["up"] = {now.up->x(), now.up->y(), now.up->z()};
}

}  // namespace oaslam
