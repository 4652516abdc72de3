#include <fmt/format.h>

#include <optional>
#include <utility>

#include "oaslam/formats/json_text.h"
#include "oaslam/service/received_features.h"
#include "oaslam/service/received_image.h"
#include "oaslam/service/stream_lens.h"
#include "oaslam/service/stream_session.h"
#include "oaslam/slam.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

class Tracking : public StreamWork {
 public:
  Tracking(std::shared_ptr<ServiceState> state, std::string map, bool may_write)
      : state_(std::move(state)), name_(std::move(map)), may_write_(may_write) {}

  StreamStep Begin() override { return Enter("hello"); }
  StreamStep Look() override;
  StreamStep Command(const nlohmann::json& message) override;
  StreamStep Image(const ImageRequest& image, const nlohmann::json& header, int dropped) override;

 private:
  StreamStep Enter(const char* type);
  StreamStep Told(const AnchorOutcome& outcome);
  // The camera of the image: the given one, else one that is estimated from the map. Nothing where
  // that fails.
  std::optional<Camera> CameraOf(const ImageRequest& request, const ImageInput& input);

  const std::shared_ptr<ServiceState> state_;
  const std::string name_;
  const bool may_write_;
  std::shared_ptr<const ServedMap> map_;
  int64_t anchors_version_ = 0;  // that the client has
  std::unique_ptr<Slam> slam_;   // of camera_; null: none yet
  std::optional<Camera> camera_;
  std::optional<Rigid3> cam_from_imu_;
  StreamLens lens_;  // since the camera was given last
  bool is_lost_ = true;
};

// The message with all that a client needs to know of the map as it is now.
StreamStep Tracking::Enter(const char* type) {
  map_ = state_->shelf.Get(name_);
  if (!map_)
    return {{{{"type", "error"}, {"message", fmt::format("there is no map \"{}\"", name_)}}}, true};
  slam_.reset();
  const auto edits = state_->shelf.Edits(name_);
  const Map& content = map_->saved().map;
  Json message = {{"type", type},
                  {"protocol", 1},
                  {"map", name_},
                  {"digest", map_->stored.digest},
                  {"may_write", may_write_}};
  Json& models = message["models"] = Json::array();
  for (const std::string& name : state_->options.models->names())
    models.push_back({{"name", name}, {"url", "/models/" + state_->options.models->entry(name)}});
  message["anchors"] = JsonOfAnchors(*map_, *edits, 0)["anchors"];
  message["objects"] = JsonOfObjects(map_->saved());
  message["up"] = content.up ? JsonOf(*content.up) : Json();
  message["is_metric"] = content.is_metric;
  anchors_version_ = edits->version;
  return {{std::move(message)}, false};
}

StreamStep Tracking::Look() {
  const auto now = state_->shelf.Get(name_);
  if (!now || now->stored.digest != map_->stored.digest) return Enter("map");
  const auto edits = state_->shelf.Edits(name_);
  if (edits->version <= anchors_version_) return {};
  // The map was removed, with its edits, and the same file stored again.
  if (anchors_version_ < edits->map_version) return Enter("map");
  Json message = {{"type", "anchors"}};
  // Before the first edit the version is 0, by which all are asked for: then these are all, but the
  // client has had some that are removed now.
  message.update(JsonOfAnchors(*map_, *edits, anchors_version_));
  message.erase("complete");
  message["removed"] = NewsOf(map_->saved().map, *edits, anchors_version_).removed;
  anchors_version_ = edits->version;
  return {{std::move(message)}, false};
}

StreamStep Tracking::Told(const AnchorOutcome& outcome) {
  if (outcome.problem.empty()) return Look();
  return {{{{"type", "error"}, {"message", outcome.problem}}}, false};
}

StreamStep Tracking::Command(const nlohmann::json& message) {
  const JsonInput json(message, "message");
  const std::string type = json["type"].Text();
  if (!may_write_) throw InputError("you may not edit this map: the token is for reading");
  if (type == "place") {
    AnchorRequest request{.model = json["model"].Text(),
                          .origin = json["origin"].Vector(),
                          .direction = json["direction"].Vector()};
    if (const auto object = json.Find("object"))
      request.object = ObjectId(static_cast<uint32_t>(object->Integer(0, INT32_MAX)));
    if (const auto size = json.Find("size")) request.size = size->Number();
    return Told(PlaceAnchor(*state_, *map_, request));
  }
  if (type != "anchor") throw BadInput("message: type \"{}\", allowed: place, anchor", type);
  const std::string name = json["name"].Text();
  const auto remove = json.Find("remove");
  if (remove && remove->Boolean()) return Told(RemoveAnchor(*state_, *map_, name));
  AnchorEdit edit;
  if (const auto rename = json.Find("rename")) edit.name = rename->Text();
  if (const auto size = json.Find("size")) edit.size = size->Number();
  if (const auto turn = json.Find("turn")) edit.turn_rad = turn->Number();
  return Told(ChangeAnchor(*state_, *map_, name, edit));
}

std::optional<Camera> Tracking::CameraOf(const ImageRequest& request, const ImageInput& input) {
  std::optional<Camera> given = request.camera.camera;
  if (!request.features) given = CameraFor(request.camera, input.image.size());
  if (given) {
    lens_ = {};
    return given;
  }
  const std::optional<Camera>& known = lens_.camera();
  if (known && cv::Size(known->width, known->height) != input.image.size()) lens_ = {};
  if (lens_.IsOpen(input.timestamp))
    lens_.Add(input.timestamp, map_->localizer.Relocalize(input).camera);
  return lens_.camera();
}

StreamStep Tracking::Image(const ImageRequest& request, const nlohmann::json& header, int dropped) {
  const Stopwatch watch;
  ImageInput input = ImageInputOf(request);
  if (TakeImuPose(request, cam_from_imu_) && slam_) slam_->SetImu(*cam_from_imu_);
  if (request.features) {
    input.features = *request.features;
    input.features->features = ReadReceivedFeatures(request.bytes, request.feature_count);
  } else {
    KeepImage(*state_, name_, request.bytes);
    input.image = DecodeReceivedImage(request.bytes, ImageColor::kGrey);
  }
  // The detector runs only while points do not find the camera.
  if (is_lost_ && !request.detections && !request.features && !state_->detectors.empty())
    input.detections =
        state_->detectors.Detect(DecodeReceivedImage(request.bytes, ImageColor::kBgr));
  const std::optional<Camera> camera = CameraOf(request, input);
  if (camera && (!slam_ || camera != camera_)) {
    SlamConfig config = state_->options.config;
    config.runner.mode = RunnerMode::kSequential;  // no threads of its own
    slam_ = std::make_unique<Slam>(config, *camera);
    slam_->SetMapping(false);
    slam_->Load(map_->localizer.map());
    if (cam_from_imu_) slam_->SetImu(*cam_from_imu_);
    camera_ = camera;
  }
  TrackingResult tracked;
  if (slam_ && camera) tracked = slam_->Process(input);
  const std::optional<Rigid3> pose = tracked.PoseIn(tracked.world);
  is_lost_ = IsLost(tracked.state);
  Json answer = JsonOfPose(request, header, tracked.state);
  answer["source"] = ToString(tracked.source);
  if (pose) {
    answer["pose"] = JsonOf(*pose);
    answer["depth"] = tracked.depth;
    answer["covariance"] = JsonNumbers<Json>(tracked.covariance.reshaped());
    if (request.motion && tracked.motion_unit) answer["unit"] = *tracked.motion_unit;
  }
  answer["confidence"] = tracked.confidence;
  if (camera) answer["camera"] = JsonOf(*camera);
  answer["dropped"] = dropped;
  answer["ms"] = watch.WallMs();
  state_->metrics.Observe("oaslam_track_seconds", watch.WallMs() / 1000);
  state_->metrics.Count("oaslam_tracked_total", {{"state", ToString(tracked.state)}});
  return {{std::move(answer)}, false};
}

}  // namespace

std::unique_ptr<StreamWork> TrackWork(std::shared_ptr<ServiceState> state, const std::string& map,
                                      bool may_write) {
  return std::make_unique<Tracking>(std::move(state), map, may_write);
}

}  // namespace oaslam
