#include "oaslam/odometry/odometry.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <fstream>

#include "camera_choice.h"
#include "commands.h"
#include "common.h"
#include "dataset_choice.h"
#include "failures.h"
#include "frame_inputs.h"
#include "mask_choice.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/relocalization/depth_registration.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/stopwatch.h"
#include "recorded_inputs.h"

namespace oaslam::apps {
namespace {

struct OdometryCommandOptions {
  CommonOptions common;
  SideFiles side;
  std::string images, camera, out, report, mask;
  uint64_t seed = 0;
};

// One line for each image, for who wants to see what the odometry did.
class Report {
 public:
  explicit Report(const std::string& path) : path_(path) {
    if (path.empty()) return;
    file_.open(path);
    if (!file_) throw InputError(path + ": cannot be written");
    file_ << "timestamp,state,tracked,inliers,sigma_position,sigma_rotation_deg,sigma_scale,"
             "keyframe,ms,metres_per_unit,sigma_metre\n";
  }

  void Add(double timestamp, const OdometryEstimate& e, double ms) {
    if (!file_.is_open()) return;
    file_ << fmt::format("{:.6f},{},{},{},{:.6f},{:.4f},{:.5f},{},{:.2f},{:.6g},{:.5f}\n",
                         timestamp, ToString(e.state), e.tracked, e.inliers,
                         SigmaOfPosition(e.covariance), SigmaOfRotation(e.covariance) / kDegree,
                         std::sqrt(e.scale_drift), static_cast<int>(e.is_keyframe), ms,
                         e.metres_per_unit, e.metre_sigma);
  }

  // Throws InputError where it could not be written.
  void Finish() {
    if (!file_.is_open()) return;
    file_.close();
    if (!file_) throw InputError(path_ + ": cannot be written whole");
  }

 private:
  std::string path_;
  std::ofstream file_;
};

struct Tracked {
  std::vector<StampedPose> trajectory;
  int images = 0;
  double ms = 0;
};

void TrackAll(FrameInputs& inputs, Odometry& odometry, bool quiet, Report& report,
              Tracked& tracked) {
  ProgressBar progress(inputs.size(), quiet);
  const Camera& camera = inputs.camera();
  DepthRegistration registration;
  while (!Interrupted()) {
    const std::optional<FrameInput> frame = inputs.Next();
    if (!frame) break;
    const cv::Mat& grey = frame->input.image;
    const double timestamp = frame->input.timestamp;
    if (grey.cols != camera.width || grey.rows != camera.height)
      throw BadInput("image {} ({}) has {}x{} pixels, expected {}x{}", frame->index, frame->name,
                     grey.cols, grey.rows, camera.width, camera.height);
    const Stopwatch watch;
    const std::shared_ptr<const DepthMap> depth =
        frame->input.depth ? registration.Register(*frame->input.depth, camera) : nullptr;
    const OdometryEstimate estimate = odometry.Process(
        ViewOf(grey), timestamp, {frame->input.angular_velocity, frame->input.imu, depth});
    const double ms = watch.WallMs();
    tracked.ms += ms;
    ++tracked.images;
    report.Add(timestamp, estimate, ms);
    if (estimate.state != OdometryState::kBlind)
      tracked.trajectory.push_back({timestamp, estimate.cam_from_odom.Inverse()});
    progress.Update(tracked.images, ToString(estimate.state));
  }
  progress.Finish();
}

void RunOdometry(const OdometryCommandOptions& given) {
  OdometryCommandOptions options = given;
  TakeDataset(options.images, options.common,
              {&options.camera, &options.side, nullptr, options.side.DepthOfDataset()});
  TakeRecording(options.images, options.common, {&options.camera, &options.side, nullptr});
  if (IsAutoCamera(options.camera) && !options.side.recorded_camera)
    throw InputError("odometry: --camera auto: a calibration file or fov:DEGREES is needed");
  const OutputFolder folder = FolderOfOutputFile(options.out);
  Report report(options.report);
  FrameInputs inputs({options.images, options.camera, {}},
                     SideInputs(options.side, options.camera, {}, options.common), options.common);
  Odometry odometry(inputs.camera(), OdometryOptions{}, options.seed);
  if (const cv::Mat mask = MaskFor(options.mask, options.camera, options.images, options.common);
      !mask.empty())
    odometry.SetMask(ImageMask(ViewOf(mask)));
  odometry.SetImu(inputs.cam_from_imu());
  Tracked tracked;
  InstallInterruptHandler();
  Failures failures;  // reported after the results are saved
  failures.Try([&] { TrackAll(inputs, odometry, options.common.quiet, report, tracked); });
  failures.Try([&] { SaveTrajectory(options.out, tracked.trajectory); });
  failures.Try([&] { report.Finish(); });
  inputs.ReportSensors(odometry.imu());
  failures.Throw();
  spdlog::info("{}{} of {} images with a pose, {:.1f} ms an image -> {}",
               Interrupted() ? "interrupted: " : "", tracked.trajectory.size(), tracked.images,
               tracked.images > 0 ? tracked.ms / tracked.images : 0.0, options.out);
  EndIfInterrupted();
}

}  // namespace

void AddOdometryCommand(CLI::App& app) {
  auto options = std::make_shared<OdometryCommandOptions>();
  CLI::App* command = app.add_subcommand("odometry",
                                         "The camera's motion alone, without a map: drifts, but "
                                         "has a pose for every image with texture");
  command
      ->add_option(
          "images", options->images,
          "folder of a dataset or of images, list file, video, recording of ROS (.mcap, .bag, "
          "rosbag2), or camera (webcam:0, rtsp://...)")
      ->required();
  command->add_option("--camera", options->camera,
                      "Calibration file, or fov:DEGREES; by default that of a dataset");
  command->add_option("--out", options->out, "Where to write the trajectory (TUM)")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--report", options->report,
                   "Where to write what was tracked in each image (CSV)")
      ->type_name("FILE");
  AddMaskOption(*command, options->mask);
  AddImuOption(*command, options->side);
  AddDepthOptions(*command, options->side);
  command->add_option("--seed", options->seed, "Of the random samples");
  AddFrameOptions(*command, options->common);
  AddImageOptions(*command, options->common);
  AddQuietOption(*command, options->common);
  command->callback([options] { RunOdometry(*options); });
}

}  // namespace oaslam::apps
