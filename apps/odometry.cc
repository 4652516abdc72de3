#include "oaslam/odometry/odometry.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>

#include "commands.h"
#include "common.h"
#include "oaslam/camera_file.h"
#include "oaslam/error.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam::apps {
namespace {

struct OdometryCommandOptions {
  CommonOptions common;
  std::string images, camera, out, report;
  uint64_t seed = 0;
};

// One line for each image, for who wants to see what the odometry did.
class Report {
 public:
  explicit Report(const std::string& path) {
    if (path.empty()) return;
    file_.open(path);
    if (!file_) throw InputError(path + ": cannot be written");
    file_ << "timestamp,state,tracked,inliers,sigma_position,sigma_rotation_deg,keyframe,"
             "restarted,ms\n";
  }

  void Add(double timestamp, const OdometryEstimate& e, double ms) {
    if (!file_.is_open()) return;
    constexpr double kDegrees = 57.29578;
    file_ << fmt::format("{:.6f},{},{},{},{:.6f},{:.4f},{},{},{:.2f}\n", timestamp,
                         ToString(e.state), e.tracked, e.inliers,
                         std::sqrt(e.covariance.topLeftCorner<3, 3>().trace()),
                         kDegrees * std::sqrt(e.covariance.bottomRightCorner<3, 3>().trace()),
                         static_cast<int>(e.is_keyframe), static_cast<int>(e.was_restarted), ms);
  }

 private:
  std::ofstream file_;
};

int RunOdometry(const OdometryCommandOptions& options) {
  const OutputFolder folder = FolderOfOutputFile(options.out);
  Report report(options.report);
  InstallInterruptHandler();
  const auto source = OpenImages(options.images, FrameRange(options.common));
  ProgressBar progress(source->size(), options.common.quiet);
  std::optional<Odometry> odometry;
  Camera camera;
  std::vector<StampedPose> trajectory;
  std::optional<double> last_timestamp;
  int images = 0;
  double ms = 0;
  while (!Interrupted()) {
    const std::optional<InputImage> input = source->Next();
    if (!input) break;
    if (input->image.empty()) {
      spdlog::warn("image {} ({}) cannot be read, skipped", input->index, input->name);
      continue;
    }
    if (last_timestamp && !(input->timestamp > *last_timestamp)) {
      spdlog::warn("image {} ({}): its time stamp is not after the one before, skipped",
                   input->index, input->name);
      continue;
    }
    last_timestamp = input->timestamp;
    cv::Mat grey = input->image;
    if (grey.channels() == 3) cv::cvtColor(input->image, grey, cv::COLOR_BGR2GRAY);
    if (!odometry) {
      camera = LoadCamera(options.camera, grey.size());
      odometry.emplace(camera, OdometryOptions{}, options.seed);
    }
    if (grey.cols != camera.width || grey.rows != camera.height)
      throw InputError(fmt::format("image {} ({}) has {}x{} pixels, expected {}x{}", input->index,
                                   input->name, grey.cols, grey.rows, camera.width, camera.height));
    const Stopwatch watch;
    const OdometryEstimate estimate =
        odometry->Process({grey.data, static_cast<std::ptrdiff_t>(grey.step), grey.cols, grey.rows},
                          input->timestamp);
    ms += watch.WallMs();
    report.Add(input->timestamp, estimate, watch.WallMs());
    ++images;
    if (estimate.state != OdometryState::kBlind)
      trajectory.push_back({input->timestamp, estimate.cam_from_odom.Inverse()});
    progress.Update(images, ToString(estimate.state));
  }
  progress.Finish();
  if (images == 0) throw InputError(options.images + ": no image could be read");
  SaveTrajectory(options.out, trajectory);
  spdlog::info("{}{} of {} images with a pose, {:.1f} ms an image -> {}",
               Interrupted() ? "interrupted: " : "", trajectory.size(), images, ms / images,
               options.out);
  return Interrupted() ? 130 : 0;
}

}  // namespace

void AddOdometryCommand(CLI::App& app) {
  auto options = std::make_shared<OdometryCommandOptions>();
  CLI::App* command = app.add_subcommand(
      "odometry",
      "The camera's motion alone, without a map: drifts, but has a pose for every image with "
      "texture");
  command
      ->add_option("images", options->images,
                   "TUM folder, list file, folder of images, video, or webcam:N")
      ->required();
  command->add_option("--camera", options->camera, "Calibration file, or fov:DEGREES")->required();
  command->add_option("--out", options->out, "Where to write the trajectory (TUM)")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--report", options->report,
                   "Where to write what was tracked in each image (CSV)")
      ->type_name("FILE");
  command->add_option("--seed", options->seed, "Of the random samples");
  AddFrameOptions(*command, options->common);
  AddExifOption(*command, options->common);
  AddQuietOption(*command, options->common);
  command->callback([options] {
    if (const int code = RunOdometry(*options)) throw CLI::RuntimeError(code);
  });
}

}  // namespace oaslam::apps
