#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <map>
#include <set>

#include "commands.h"
#include "common.h"
#include "dataset_choice.h"
#include "detector_options.h"
#include "failures.h"
#include "oaslam/detection/detector_pool.h"
#include "oaslam/detection/turned_detector.h"
#include "oaslam/detection_file.h"
#include "oaslam/error.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/image_list.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam::apps {
namespace {

struct DetectOptions {
  CommonOptions common;
  DetectorSettings detector;
  std::string images, path, out;
  bool resume = false;
};

struct Found {
  std::vector<ImageDetections> images;
  size_t boxes = 0;
  int detected = 0;  // images of this run
  double ms = 0;
};

// The names of images for a file of detections: base names, but those that several images have
// with the folder, as seen from that of the source.
class NamesInFile {
 public:
  NamesInFile(const std::string& source, ImageSourceOptions range) {
    if (range.follow || IsCamera(source)) return;
    std::error_code error;
    folder_ = std::filesystem::is_directory(source, error)
                  ? std::filesystem::path(source)
                  : std::filesystem::path(source).parent_path();
    range.quiet = true;
    if (const auto images = ListAll(source, range))
      for (const ListedImage& image : *images) ++count_[BaseName(image.path)];
  }

  std::string Of(const InputImage& image) const {
    const auto count = count_.find(image.name);
    if (count == count_.end() || count->second < 2) return image.name;
    const std::string relative =
        std::filesystem::path(image.path).lexically_relative(folder_).string();
    return relative.empty() || relative.starts_with("..") ? image.path : relative;
  }

 private:
  std::filesystem::path folder_;
  std::map<std::string, int> count_;
};

// Processes the images except those that `found` contains already. Saves every kSaveEvery images,
// so that a kill does not lose everything.
void DetectAll(ImageSource& source, const NamesInFile& names, TurnedDetector& detector,
               const DetectOptions& options, Found& found) {
  constexpr int kSaveEvery = 200;  // images: 10 s of work at 50 ms an image
  // A pipe gets a single document at the end.
  const bool is_file =
      !std::filesystem::exists(options.out) || std::filesystem::is_regular_file(options.out);
  std::set<std::string> done_before;
  for (const ImageDetections& image : found.images) done_before.insert(image.file_name);
  // Of one thread, so that Ctrl-C does not wait for a large network.
  std::optional<int> turn;
  double timestamp = 0;
  DetectorPool pool({[&](const cv::Mat& image) { return detector(image, timestamp, turn); }});
  ProgressBar progress(source.size(), options.common.quiet);
  const bool is_auto = !TurnOf(options.detector);
  int done = 0;
  while (!Interrupted()) {
    const std::optional<InputImage> input = source.Next();
    if (!input) break;
    ++done;
    const std::string name = names.Of(*input);
    if (done_before.contains(name)) continue;
    if (input->image.empty()) {
      spdlog::warn("image {} ({}) cannot be read, skipped", input->index, input->name);
      continue;
    }
    const Stopwatch watch;
    turn = is_auto ? KnownTurn(*input, std::nullopt) : std::nullopt;
    timestamp = input->timestamp;
    std::future<std::vector<Detection>> detections = pool.Add(input->image);
    if (!IsReadyUnlessInterrupted(detections)) return;
    found.images.push_back({name, detections.get()});
    found.ms += watch.WallMs();
    ++found.detected;
    const size_t count = found.images.back().detections.size();
    found.boxes += count;
    if (is_file && found.detected % kSaveEvery == 0) SaveDetections(options.out, found.images);
    progress.Update(done, fmt::format("{} objects", count));
  }
}

void RunDetect(DetectOptions options) {
  if (options.images.empty()) options.images = options.path;
  if (options.images.empty()) throw InputError("detect: no images given: oaslam detect PATH");
  if (options.detector.model.empty()) options.detector.model = "default";
  if (!options.detector.IsGiven()) throw InputError("detect: --detector none finds nothing");
  const std::unique_ptr<Detector> detector = LoadDetector(options.detector);
  const OutputFolder folder = FolderOfOutputFile(options.out);
  ImageSourceOptions range = FrameRange(options.common);
  range.color = true;
  TakeDataset(options.images, options.common, {});
  const auto source = OpenImages(options.images, range);
  const NamesInFile names(options.images, range);
  spdlog::info("{}: layout {}, input {}x{}", NameOfDetector(options.detector),
               ToString(detector->layout()), detector->input_size().width,
               detector->input_size().height);
  Found found;
  if (options.resume && std::filesystem::exists(options.out)) {
    found.images = LoadDetections(options.out).images();
    spdlog::info("{}: {} images are done", options.out, found.images.size());
  }
  const size_t done_before = found.images.size();
  InstallInterruptHandler();
  Failures failures;  // reported after the results are saved
  failures.Try([&] {
    TurnedDetector turned([&](const cv::Mat& image) { return detector->Detect(image); },
                          TurnOf(options.detector));
    DetectAll(*source, names, turned, options, found);
  });
  failures.Try([&] {
    if (found.images.size() > done_before) SaveDetections(options.out, found.images);
  });
  failures.Throw();
  if (found.images.empty() && !Interrupted())
    throw InputError(options.images + ": no image could be read");
  spdlog::info("{}{} objects in {} images, {:.1f} ms an image -> {}",
               Interrupted() ? "interrupted: " : "", found.boxes, found.detected,
               found.detected > 0 ? found.ms / found.detected : 0.0, options.out);
  EndIfInterrupted();
}

}  // namespace

void AddDetectCommand(CLI::App& app) {
  auto options = std::make_shared<DetectOptions>();
  CLI::App* command =
      app.add_subcommand("detect", "Run an object detector on images and save what it finds");
  auto* images = command->add_option("--images", options->images,
                                     "folder of a dataset or of images, list file, video, "
                                     "recording of ROS (.mcap, .bag, rosbag2), "
                                     "or camera (webcam:0, rtsp://...)");
  command->add_option("path", options->path, "the images, as for --images")->excludes(images);
  AddDetectorOptions(*command, options->detector);
  command->add_option("--out", options->out, "Where to write the detections (JSON)")
      ->required()
      ->type_name("FILE");
  command->add_flag(
      "--resume", options->resume,
      "Continue the file of an interrupted run: the images in it are not processed again");
  AddFrameOptions(*command, options->common);
  AddImageOptions(*command, options->common);
  AddFollowOption(*command, options->common);
  AddQuietOption(*command, options->common);
  command->callback([options] { RunDetect(*options); });
}

}  // namespace oaslam::apps
