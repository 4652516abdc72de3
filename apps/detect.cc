#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>

#include "commands.h"
#include "common.h"
#include "detector_options.h"
#include "oaslam/error.h"
#include "oaslam/io/detection_file.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam::apps {
namespace {

struct DetectOptions {
  CommonOptions common;
  DetectorSettings detector;
  std::string images, out;
};

void RunDetect(const DetectOptions& options) {
  const std::unique_ptr<Detector> detector = LoadDetector(options.detector);
  if (std::filesystem::is_directory(options.out)) throw InputError(options.out + ": a folder, --out asks for a file");
  const std::string folder = std::filesystem::path(options.out).parent_path().string();
  EnsureOutputFolder(folder.empty() ? "." : folder);
  ImageSourceOptions range = FrameRange(options.common);
  range.color = true;
  const auto source = OpenImages(options.images, range);
  spdlog::info("{}: layout {}, input {}x{}", options.detector.model, ToString(detector->layout()), detector->input_size().width,
               detector->input_size().height);

  InstallInterruptHandler();
  std::vector<ImageDetections> found;
  size_t boxes = 0;
  double ms = 0;
  {
    ProgressBar progress(source->size(), options.common.quiet);
    int done = 0;
    while (!Interrupted()) {
      const std::optional<InputImage> input = source->Next();
      if (!input) break;
      ++done;
      if (input->image.empty()) {
        spdlog::warn("image {} ({}) cannot be read, skipped", input->index, input->name);
        continue;
      }
      const Stopwatch watch;
      found.push_back({input->name, detector->Detect(input->image)});
      ms += watch.WallMs();
      boxes += found.back().detections.size();
      progress.Update(done, fmt::format("{} objects", found.back().detections.size()));
    }
  }
  if (found.empty()) throw InputError(options.images + ": no image could be read");
  SaveDetections(options.out, found);
  spdlog::info("{}{} objects in {} images, {:.1f} ms an image -> {}", Interrupted() ? "interrupted: " : "", boxes, found.size(),
               ms / static_cast<double>(found.size()), options.out);
}

}  // namespace

void AddDetectCommand(CLI::App& app) {
  auto options = std::make_shared<DetectOptions>();
  CLI::App* command = app.add_subcommand("detect", "Run an object detector on images and save what it finds");
  command->add_option("--images", options->images, "TUM folder, list file, folder of images, video, or webcam:N")->required();
  AddDetectorOptions(*command, options->detector)->required();
  command->add_option("--out", options->out, "Where to write the detections (JSON)")->required()->type_name("FILE");
  AddFrameOptions(*command, options->common);
  AddQuietOption(*command, options->common);
  command->callback([options] { RunDetect(*options); });
}

}  // namespace oaslam::apps
