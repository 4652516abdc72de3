// Where the odometry's window missed a lower minimum: from the true poses as a start it comes out
// at a cost that is lower by a tenth. That measures the search alone, with no luck of seeds, since
// what the images cannot tell counts as no failure.
//   search_failures [--seed=N] [--step=N] [--from=N] [--to=N] [--trace] SEQUENCE...
// --step: every N-th image; --from, --to: images; --trace: a line for each window.
// A sequence is a folder with video.mp4 or rgb.txt, camera.yaml and groundtruth.txt (TUM).
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/camera_file.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/similarity.h"
#include "oaslam/image_source.h"
#include "oaslam/odometry/odometry.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/util/median.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

constexpr double kEvery = 0.1;  // seconds between the windows that are looked at
constexpr double kLower = 0.9;  // of the cost found: a lower one was missed

struct Options {
  uint64_t seed = 0;
  int step = 1, from = 0, to = -1;
  bool trace = false;
};

// The truth at a time; nothing where it has none within 20 ms.
std::optional<Rigid3> TruthAt(const std::vector<StampedPose>& truth, double time_s) {
  auto at = std::ranges::lower_bound(truth, time_s, {}, &StampedPose::timestamp);
  if (at != truth.begin() &&
      (at == truth.end() || at->timestamp - time_s > time_s - std::prev(at)->timestamp))
    --at;
  if (at == truth.end() || std::abs(at->timestamp - time_s) > 0.02) return std::nullopt;
  return at->world_from_cam;
}

// odom_from_world by the images of a window up to a time; nothing where they hardly move.
std::optional<Similarity> OdomFromWorld(const Window& window,
                                        const std::vector<Rigid3>& world_from_cam, double until_s) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  Eigen::Vector3d mean_here = Eigen::Vector3d::Zero(), mean_there = mean_here;
  int count = 0;
  for (size_t i = 0; i < window.images.size(); ++i) {
    if (window.images[i].time_s > until_s) break;
    const Eigen::Quaterniond turn = window.images[i].cam_from_odom.rotation.conjugate() *
                                    world_from_cam[i].rotation.conjugate();
    sum += turn.coeffs() * turn.coeffs().transpose();
    mean_here += window.images[i].cam_from_odom.OriginInSource();
    mean_there += world_from_cam[i].translation;
    ++count;
  }
  if (count < 3) return std::nullopt;
  mean_here /= count;
  mean_there /= count;
  double here = 0, there = 0;
  for (int i = 0; i < count; ++i) {
    here += (window.images[i].cam_from_odom.OriginInSource() - mean_here).squaredNorm();
    there += (world_from_cam[i].translation - mean_there).squaredNorm();
  }
  if (!(here > 0 && there > 0)) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> axes(sum);
  const Eigen::Quaterniond rotation(Eigen::Vector4d(axes.eigenvectors().col(3)));
  const double scale = std::sqrt(here / there);
  return Similarity(scale, rotation, mean_here - scale * (rotation * mean_there));
}

struct Compared {
  double found = 0, from_truth = 0;  // cost a sighting
};

// The cost of the images alone at the minimum about a start.
double CostAtMinimum(const InverseDepthProblem& loose, const InverseDepthProblem& bare,
                     InverseDepthState& state) {
  InverseDepthSolver().Minimize(loose, {.max_iterations = 20, .tolerance = 1e-5}, state);
  return CostOfImages(bare, state);
}

std::optional<Compared> Compare(const Window& window, const WindowOptions& options,
                                const std::vector<StampedPose>& truth) {
  std::vector<Rigid3> world_from_cam;
  for (const WindowImage& image : window.images) {
    const auto pose = TruthAt(truth, image.time_s);
    if (!pose) return std::nullopt;
    world_from_cam.push_back(*pose);
  }
  const WindowProblem made = ProblemOf(window, options, true);
  const InverseDepthProblem bare = WithoutPriors(made.problem);
  InverseDepthProblem loose = bare;
  for (DepthPrior& p : loose.points)
    p.sigma = 20 * std::max(std::abs(p.inverse_depth), window.median_inverse_depth);
  InverseDepthState found = made.StateOf(window);
  Compared compared{CostAtMinimum(loose, bare, found), INFINITY};
  const double oldest = window.images.front().time_s, newest = window.newest().time_s;
  for (const double until : {newest, newest - 1, 0.5 * (oldest + newest)}) {
    const auto odom_from_world = OdomFromWorld(window, world_from_cam, until);
    if (!odom_from_world) continue;
    InverseDepthState state = made.StateOf(window);
    for (size_t k = 0; k < made.images.size(); ++k) {
      if (window.images[made.images[k]].is_held) continue;
      const Rigid3& pose = world_from_cam[made.images[k]];
      state.poses[k] = (Similarity(pose.Inverse()) * odom_from_world->Inverse()).AsPose();
    }
    SearchDepths(window.median_inverse_depth, made.problem, state);
    compared.from_truth = std::min(compared.from_truth, CostAtMinimum(loose, bare, state));
  }
  return compared;
}

struct Figures {
  double seconds = 0, failing = 0, longest = 0;  // s
  int windows = 0, failures = 0;                 // a failure lasts until .3 s without one
  std::vector<double> ms, turn_off;              // of images; degrees over half a second
  double scales = 1;
  int runs = 0;
};

// Largest over smallest scale of parts of three seconds in which the camera moves.
double RangeOfScales(const std::vector<StampedPose>& own, const std::vector<StampedPose>& truth) {
  std::vector<double> scales;
  for (size_t k = 0; k + 2 < own.size();) {
    size_t m = k;
    while (m < own.size() && own[m].timestamp < own[k].timestamp + 3) ++m;
    if (m >= own.size()) break;
    double way = 0;
    std::vector<Eigen::Vector3d> here, there;
    for (size_t i = k; i <= m; ++i)
      if (const auto pose = TruthAt(truth, own[i].timestamp)) {
        if (!there.empty()) way += (pose->translation - there.back()).norm();
        here.push_back(own[i].world_from_cam.translation);
        there.push_back(pose->translation);
      }
    const auto spread = [](const std::vector<Eigen::Vector3d>& points) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const auto& p : points) mean += p / static_cast<double>(points.size());
      double sum = 0;
      for (const auto& p : points) sum += (p - mean).squaredNorm();
      return std::sqrt(sum / static_cast<double>(points.size()));
    };
    if (way > 0.45) scales.push_back(spread(here) / spread(there));
    k = m;
  }
  if (scales.size() < 2) return 1;
  const auto [least, most] = std::ranges::minmax_element(scales);
  return *most / *least;
}

Figures Measure(const std::string& folder, const Options& options) {
  namespace fs = std::filesystem;
  const bool is_video = fs::exists(folder + "/video.mp4");
  const auto source = OpenImages(is_video ? folder + "/video.mp4" : folder, {.quiet = true});
  const Camera camera = LoadCamera(folder + "/camera.yaml");
  std::vector<StampedPose> truth = LoadTrajectory(folder + "/groundtruth.txt");
  std::ranges::stable_sort(truth, {}, &StampedPose::timestamp);
  Odometry odometry(camera, {}, options.seed);
  Figures figures;
  std::vector<StampedPose> own;
  double looked_at = -INFINITY, failed_at = -INFINITY, failed_from = 0, first = NAN, last = 0;
  for (int n = 0; auto image = source->Next(); ++n) {
    if (n < options.from || n % options.step != 0) continue;
    if (options.to >= 0 && n >= options.to) break;
    const double time_s = image->timestamp;
    const cv::Mat& grey = image->image;
    const Stopwatch watch;
    const OdometryEstimate estimate = odometry.Process(
        {grey.data, static_cast<std::ptrdiff_t>(grey.step), grey.cols, grey.rows}, time_s);
    figures.ms.push_back(watch.WallMs());
    figures.runs = estimate.run + 1;
    if (std::isnan(first)) first = time_s;
    last = time_s;
    if (estimate.state == OdometryState::kBlind) continue;
    own.push_back({time_s, estimate.cam_from_odom.Inverse()});
    for (size_t i = own.size(); i-- > 0 && estimate.state != OdometryState::kPreliminary;) {
      if (time_s - own[i].timestamp < 0.5) continue;
      const auto before = TruthAt(truth, own[i].timestamp), now = TruthAt(truth, time_s);
      if (before && now)
        figures.turn_off.push_back(
            (own.back().world_from_cam.rotation.conjugate() * own[i].world_from_cam.rotation)
                .angularDistance(now->rotation.conjugate() * before->rotation) /
            kDegree);
      break;
    }
    if (estimate.state == OdometryState::kPreliminary || time_s - looked_at < kEvery - 1e-3)
      continue;
    looked_at = time_s;
    const auto compared = Compare(odometry.window(), odometry.window_options(), truth);
    if (!compared) continue;
    ++figures.windows;
    const bool fails = compared->from_truth < kLower * compared->found;
    if (options.trace)
      fmt::print("{:.2f} found {:.3f} from truth {:.3f} points {} off {:.2f}{}\n", time_s,
                 compared->found, compared->from_truth, estimate.tracked,
                 figures.turn_off.empty() ? 0 : figures.turn_off.back(), fails ? " MISSED" : "");
    if (!fails) continue;
    figures.failing += kEvery;
    if (time_s - failed_at > 0.3) {
      ++figures.failures;
      failed_from = time_s;
    }
    failed_at = time_s;
    figures.longest = std::max(figures.longest, time_s - failed_from + kEvery);
  }
  figures.seconds = last - first;
  figures.scales = RangeOfScales(own, truth);
  return figures;
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1,
                         static_cast<size_t>(share * static_cast<double>(values.size())))];
}

int Main(int argc, char** argv) {
  Options options;
  std::vector<std::string> folders;
  for (int i = 1; i < argc; ++i) {
    const std::string_view arg = argv[i];
    if (arg.starts_with("--seed="))
      options.seed = std::strtoull(argv[i] + 7, nullptr, 10);
    else if (arg.starts_with("--step="))
      options.step = std::max(1, std::atoi(argv[i] + 7));
    else if (arg.starts_with("--from="))
      options.from = std::max(0, std::atoi(argv[i] + 7));
    else if (arg.starts_with("--to="))
      options.to = std::max(0, std::atoi(argv[i] + 5));
    else if (arg == "--trace")
      options.trace = true;
    else
      folders.emplace_back(arg);
  }
  fmt::print(
      "film, s, windows, failures, failing s, longest s, failing s in 1000 s, turn off in .5 s (99 "
      "%, most, degrees), scales, runs, ms (mean, 99 %, most)\n");
  double seconds = 0, failing = 0;
  for (const std::string& folder : folders) {
    const Figures f = Measure(folder, options);
    seconds += f.seconds;
    failing += f.failing;
    double sum = 0;
    for (const double ms : f.ms) sum += ms;
    fmt::print(
        "{}, {:.0f}, {}, {}, {:.1f}, {:.1f}, {:.0f}, {:.1f} {:.1f}, {:.2f}, {}, {:.2f} {:.1f} "
        "{:.1f}\n",
        std::filesystem::path(folder).filename().string(), f.seconds, f.windows, f.failures,
        f.failing, f.longest, f.seconds > 0 ? 1000 * f.failing / f.seconds : 0,
        Quantile(f.turn_off, 0.99), Quantile(f.turn_off, 1), f.scales, f.runs,
        sum / std::max<double>(1, static_cast<double>(f.ms.size())), Quantile(f.ms, 0.99),
        Quantile(f.ms, 1));
    std::fflush(stdout);
  }
  fmt::print("all: {:.0f} s, failing {:.1f} s, {:.1f} in 1000 s\n", seconds, failing,
             seconds > 0 ? 1000 * failing / seconds : 0);
  return 0;
}

}  // namespace
}  // namespace oaslam

int main(int argc, char** argv) {
  try {
    return oaslam::Main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "search_failures: %s\n", e.what());
    return 1;
  }
}
