#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <utility>

#include "oaslam/camera_estimation.h"
#include "oaslam/camera_file.h"
#include "oaslam/detection/view_change.h"
#include "oaslam/service/received_image.h"
#include "oaslam/service/stream_session.h"
#include "oaslam/slam.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// Of images by which an unknown camera is estimated: as long as a person follows the request to
// move sideways.
constexpr double kCameraSeconds = 10;
constexpr const char* kGuess = "fov:60";  // of a phone held upright; used where the estimate fails
constexpr int kLeastKeyframes = 5;        // with fewer, a map finds no camera

class Recording : public StreamWork {
 public:
  Recording(std::shared_ptr<ServiceState> state, std::string map)
      : state_(std::move(state)), name_(std::move(map)) {}

  StreamStep Begin() override;
  StreamStep Look() override { return {}; }
  StreamStep Command(const nlohmann::json& message) override;
  StreamStep Image(const ImageRequest& image, const nlohmann::json& header, int dropped) override;

 private:
  void EstimateCamera(const cv::Mat& image, double time);
  void BeginMap(const Camera& camera);
  Json Progress(const char* phase, const std::string& text) const;
  StreamStep Save();

  const std::shared_ptr<ServiceState> state_;
  const std::string name_;
  std::optional<CameraEstimator> estimator_;
  std::optional<Camera> camera_;
  std::optional<Rigid3> cam_from_imu_;
  std::unique_ptr<Slam> slam_;
  ViewChange view_change_;
  double last_time_ = -std::numeric_limits<double>::infinity();
};

StreamStep Recording::Begin() {
  state_->shelf.store().CheckNew(name_);
  if (state_->shelf.store().Find(name_))
    return {{{{"type", "error"}, {"message", fmt::format("there is a map \"{}\" already", name_)}}},
            true};
  return {{{{"type", "hello"}, {"protocol", 1}, {"map", name_}, {"may_write", true}}}, false};
}

void Recording::BeginMap(const Camera& camera) {
  SlamConfig config = state_->options.config;
  config.runner.mode = RunnerMode::kSequential;  // no threads of its own
  slam_ = std::make_unique<Slam>(config, camera);
  slam_->SetClassNames(state_->options.classes.names);
  slam_->SetClassRelations(state_->options.classes.relations);
  if (cam_from_imu_) slam_->SetImu(*cam_from_imu_);
  camera_ = camera;
  estimator_.reset();
}

void Recording::EstimateCamera(const cv::Mat& image, double time) {
  if (!estimator_) estimator_.emplace(state_->options.config);
  estimator_->Add(image, time);
  if (estimator_->Duration() < kCameraSeconds && !estimator_->IsFull()) return;
  const CameraEstimate found = estimator_->Estimate();
  BeginMap(found.is_determined ? found.camera : LoadCamera(kGuess, image.size()));
}

Json Recording::Progress(const char* phase, const std::string& text) const {
  Json message = {{"type", "progress"}, {"phase", phase}};
  const MapSnapshot map = slam_ ? slam_->Snapshot() : MapSnapshot();
  message["keyframes"] = map.Keyframes().size();
  message["landmarks"] = map.Landmarks().size();
  message["objects"] = map.Objects().size();
  message["text"] = text;
  return message;
}

StreamStep Recording::Image(const ImageRequest& request, const nlohmann::json& header,
                            int dropped) {
  const Stopwatch watch;
  if (!(request.time > last_time_))
    throw BadInput("time: {:.6f}, is not after that of the image before, {:.6f}", request.time,
                   last_time_);
  if (request.features) throw InputError("features: a map is made of images");
  const bool detects = !request.detections && !state_->detectors.empty();
  last_time_ = request.time;
  if (TakeImuPose(request, cam_from_imu_) && slam_) slam_->SetImu(*cam_from_imu_);
  ImageInput input = ImageInputOf(request);
  input.image = DecodeReceivedImage(request.bytes, detects ? ImageColor::kBgr : ImageColor::kGrey);
  KeepImage(*state_, name_, request.bytes);
  const std::optional<Camera> given = CameraFor(request.camera, input.image.size());
  if (given && !slam_) BeginMap(*given);
  if (slam_ && cv::Size(camera_->width, camera_->height) != input.image.size())
    throw BadInput("image: {} x {} pixels, the map is made of {} x {}", input.image.cols,
                   input.image.rows, camera_->width, camera_->height);
  if (!slam_) {
    EstimateCamera(input.image, request.time);
    Json answer = JsonOfPose(request, header, TrackingState::kInitializing);
    answer["dropped"] = dropped;
    answer["ms"] = watch.WallMs();
    return {{std::move(answer), Progress("camera",
                                         "Move sideways slowly, past things with details: "
                                         "the lens of this camera is being measured.")},
            false};
  }
  if (detects && view_change_.Choose(input.image, request.time))
    input.detections = state_->detectors.Detect(input.image);
  const TrackingResult tracked = slam_->Process(input);
  Json answer = JsonOfPose(request, header, tracked.state);
  if (const std::optional<Rigid3> pose = tracked.PoseIn(tracked.world)) {
    answer["pose"] = JsonOf(*pose);
    answer["depth"] = tracked.depth;
  }
  answer["confidence"] = tracked.confidence;
  if (!camera_->is_guess) answer["camera"] = JsonOf(*camera_);  // the page keeps what is found
  answer["dropped"] = dropped;
  answer["ms"] = watch.WallMs();
  const bool has_no_map =
      tracked.state == TrackingState::kInitializing || tracked.state == TrackingState::kPreliminary;
  const char* text = has_no_map ? "Move sideways slowly, past things with details."
                     : tracked.HasPose()
                         ? "Walk around what is to be mapped, and come back to where you began."
                         : "Lost: go back to where you were, and move slowly.";
  return {{std::move(answer), Progress("mapping", text)}, false};
}

StreamStep Recording::Command(const nlohmann::json& message) {
  const std::string type = JsonInput(message, "message")["type"].Text();
  if (type != "finish") throw BadInput("message: type \"{}\", allowed: finish", type);
  return Save();
}

StreamStep Recording::Save() {
  if (!slam_) throw InputError("there is no map yet: the camera has to be known first");
  slam_->Finish();
  if (slam_->Snapshot().Keyframes().size() < kLeastKeyframes)
    throw InputError("there is no map yet: it takes a camera that moves sideways past things");
  // Somebody else may have made one meanwhile.
  if (state_->shelf.store().Find(name_)) throw BadInput("there is a map \"{}\" already", name_);
  const fs::path file = state_->files->NewPath();
  const std::shared_ptr<void> held = HoldFile(state_->files, file);
  slam_->Save(file.string());
  const StoredMap stored = state_->shelf.store().Put(name_, file);
  state_->shelf.Refresh(name_);
  return {{Progress("saving", "Saved."),
           {{"type", "saved"}, {"map", name_}, {"digest", stored.digest}}},
          true};
}

}  // namespace

std::unique_ptr<StreamWork> RecordWork(std::shared_ptr<ServiceState> state,
                                       const std::string& map) {
  return std::make_unique<Recording>(std::move(state), map);
}

}  // namespace oaslam
