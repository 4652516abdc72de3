#include "detector_options.h"

#include <filesystem>
#include <iostream>
#include <mutex>

#include "oaslam/detection/model_folders.h"
#include "oaslam/detection/turned_detector.h"
#include "oaslam/images/exif_orientation.h"

namespace oaslam::apps {
namespace fs = std::filesystem;
namespace {

// Discards what is written to std::cerr while a network is loaded: Debian's build of ONNX Runtime
// (1.21) registers each operator twice and prints a line about each. Errors come as exceptions.
class QuietStderr {
 public:
  QuietStderr() = default;
  ~QuietStderr() { std::cerr.rdbuf(before_); }
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  inline static std::mutex one_at_a_time_;
  std::lock_guard<std::mutex> lock_{one_at_a_time_};
  std::streambuf* before_ = std::cerr.rdbuf(nullptr);
};

}  // namespace

CLI::Option* AddDetectorOptions(CLI::App& app, DetectorSettings& settings) {
  app.add_option("--detector-layout", settings.layout,
                 "Layout of the network's output, if it is not recognised correctly")
      ->check(CLI::IsMember({"auto", "yolox", "yolov5", "yolov8", "end2end", "rtdetr"}))
      ->capture_default_str();
  app.add_option("--detector-size", settings.size,
                 "Side of the network's square input in pixels, where the file leaves it open")
      ->check(CLI::Range(32, 4096));
  app.add_option("--detector-turn", settings.turn,
                 "Degrees clockwise that bring the images upright, as the detector wants them; "
                 "auto: by gravity or EXIF where they are known, else what gives the better boxes. "
                 "Boxes are of the images as they are")
      ->check(CLI::IsMember({"auto", "0", "90", "180", "270"}))
      ->capture_default_str();
  app.add_option("--detector-min-score", settings.min_score,
                 "Detections at or below this score are dropped")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--detector-backend", settings.backend,
                 "Library that runs the network; auto is the faster one of those in this program")
      ->check(CLI::IsMember({"auto", "onnxruntime", "opencv"}))
      ->capture_default_str();
  return app
      .add_option("--detector", settings.model,
                  "Object detector: an ONNX file of the YOLO family, the name of one (`oaslam "
                  "models` lists them), default (yolox_nano), or none")
      ->type_name("DETECTOR");
}

void AddDetectEveryOption(CLI::App& app, DetectorSettings& settings) {
  app.add_option("--detect-every", settings.every,
                 "Run the detector on every Nth image; by default where the view has changed, and "
                 "ten times a second at most while the camera is lost")
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
}

std::unique_ptr<Detector> LoadDetector(const DetectorSettings& settings) {
  if (!settings.IsGiven()) return nullptr;
  DetectorOptions options;
  options.layout = DetectorLayoutFromString(settings.layout).value_or(DetectorLayout::kAuto);
  options.backend = NetworkBackendFromString(settings.backend).value_or(NetworkBackend::kAuto);
  options.input_size = {settings.size, settings.size};
  options.min_score = settings.min_score;
  const QuietStderr quiet;
  return Detector::Load(settings.model, options);
}

std::optional<int> TurnOf(const DetectorSettings& settings) {
  return settings.turn == "auto" ? std::nullopt : std::optional(std::stoi(settings.turn) / 90);
}

std::optional<int> KnownTurn(const InputImage& image,
                             const std::optional<Eigen::Vector3d>& gravity_in_cam) {
  if (gravity_in_cam)
    if (const auto turn = UprightTurn(*gravity_in_cam)) return turn;
  const std::optional<int> stored = image.path.empty() ? std::nullopt : ExifTurn(image.path);
  return stored && image.orientation == Orientation::kUpright ? 0 : stored;
}

TurnedDetector FindTurn(const std::string& images, ImageSourceOptions range, Detector& detector) {
  constexpr double kStep_s = 0.5, kMost_s = 10, kMostDoubtful_s = 30;  // other views tell more
  range.color = true;
  range.quiet = true;  // the run that follows opens the same images
  const auto source = OpenImages(images, range);
  TurnedDetector turned([&](const cv::Mat& image) { return detector.Detect(image); });
  std::optional<double> first, last;
  while (std::optional<InputImage> image = source->Next()) {
    if ((turned.turn() && !turned.is_doubtful()) || Interrupted()) break;
    if (image->image.empty() || (last && image->timestamp < *last + kStep_s)) continue;
    if (!first) first = image->timestamp;
    if (image->timestamp > *first + (turned.is_doubtful() ? kMostDoubtful_s : kMost_s) ||
        KnownTurn(*image, std::nullopt))
      break;
    last = image->timestamp;
    turned(image->image, image->timestamp);
  }
  return turned;
}

std::string NameOfDetector(const DetectorSettings& settings) {
  return settings.model == "default" ? kDefaultModel : fs::path(settings.model).filename().string();
}

Classes ClassesFor(const CommonOptions& common, const Detector* detector,
                   const ClassNames& categories) {
  if (common.classes.empty() && detector != nullptr && !detector->class_names().empty())
    return {detector->class_names(), {}};
  if (common.classes.empty() && !categories.empty()) return {categories, {}};
  return LoadClasses(common);
}

}  // namespace oaslam::apps
