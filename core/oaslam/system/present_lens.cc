#include "oaslam/system/present_lens.h"

#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/relocalization/by_points.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// A change by less is none: autofocus moves the focal length by so much.
constexpr double kFocusing = 0.03;
// Of the logarithm: a change worth to begin the motion anew.
constexpr double kBetter = 0.01;

}  // namespace

double PresentLens::sigma() const {
  // Of the logarithm of the ratio: what is lost while a zoom is noticed (docs/lab/camera.md).
  constexpr double kShare = 0.07;
  return kShare * std::abs(std::log(ratio_));
}

bool PresentLens::IsUncertain() const {
  return (search_ && search_->seen > 0) ||
         (following_ && std::abs(std::log(ratio_ / following_->from)) > kFocusing);
}

// While a camera is estimated, what is seen of its lens is no news yet.
LogLevel PresentLens::Level() const {
  return camera_.focal_sigma > 0 ? LogLevel::kDebug : LogLevel::kWarning;
}

void PresentLens::See(const OdometryEstimate& estimate, bool is_followed, double timestamp) {
  const double before = std::exchange(ratio_, estimate.focal_ratio);
  if (is_followed && !following_) {
    following_ = Following{timestamp, before, {}, timestamp, before};
    Log(Level(),
        "the lens changes since {:.2f} s: its focal length, {:.1f} px, is followed from image to "
        "image",
        timestamp, FocalAt(before));
  } else if (!is_followed && following_) {
    const Following was = *std::exchange(following_, std::nullopt);
    if (std::abs(std::log(ratio_ / was.from)) > kFocusing)
      Log(Level(),
          "the lens has changed between {:.2f} and {:.2f} s: its focal length was {:.1f} px, and "
          "is {:.1f} px",
          was.since, timestamp, FocalAt(was.from), FocalAt(ratio_));
  }
  const bool was_blind = std::exchange(is_blind_, estimate.state == OdometryState::kBlind);
  if (!is_blind_) return;
  if (!was_blind)
    search_ = Search{timestamp, -INFINITY};
  else if (search_)
    search_->since = timestamp;  // until there is something to see
}

void PresentLens::LookAway() {
  following_.reset();
  search_.reset();
}

// The logarithm of the ratio by the map, and its standard deviation; nothing where the image is not
// found there with certainty.
std::optional<std::pair<double, double>> PresentLens::Measure(const Frame& frame, const Map& map,
                                                              const SlamConfig& config,
                                                              Relocalizer& relocalizer) const {
  constexpr int kLeastInliers = 30, kManyInliers = 100;
  constexpr double kKnown = 0.01;  // of a camera that the map has
  // A fresh random generator: no later image depends on whether a lens was looked for.
  Rng rng(static_cast<uint64_t>(config.runner.seed));
  const double accept = config.relocalization.accept_confidence;
  Relocalization found = relocalizer.Find(frame, map, RelocalizationMode::kPoints, rng);
  bool is_sure = found.IsFound();
  if (is_sure) found = RefineFocal(frame, map, std::move(found), accept);  // by all its points
  if (!is_sure || found.points.inliers < kManyInliers) {
    // Moving ahead looks like a zoom: the place that is found may be that of the former lens.
    Relocalization free = relocalizer.FindWithFreeFocal(frame, map, rng);
    if (free.IsFound() && (!is_sure || free.points.inliers > found.points.inliers)) {
      found = std::move(free);
      is_sure = true;
    }
  }
  if (!is_sure || !found.camera || found.points.inliers < kLeastInliers ||
      !std::isfinite(found.focal_sigma))
    return std::nullopt;
  return std::pair(std::log(found.camera->fx / camera_.fx),
                   found.focal_sigma > 0 ? found.focal_sigma : kKnown);
}

void PresentLens::LookAfterZoom(double timestamp, const std::shared_ptr<const Map>& map) {
  constexpr double kRests = 0.02, kSeconds = 0.4;
  Following& now = *following_;
  if (!now.map) now.map = map;
  if (std::abs(std::log(ratio_ / now.rests_at)) > kRests) {
    now.rests_since = timestamp;
    now.rests_at = ratio_;
    now.is_measured = false;
  }
  if (now.is_measured || timestamp - now.rests_since < kSeconds ||
      std::abs(std::log(ratio_ / now.from)) < kFocusing)
    return;
  now.is_measured = true;
  search_ = Search{timestamp, -INFINITY, true, now.map};
}

bool PresentLens::IsTimeToLook(const Frame& frame, const Map& map) {
  constexpr double kSeconds = 1, kInterval = 0.09;
  constexpr int kMostLooks = 12;  // each takes as long as to find a lost camera
  if (search_ && (frame.timestamp - search_->since > kSeconds || search_->looks == kMostLooks ||
                  map.keyframes.empty()))
    search_.reset();
  if (!search_ || frame.features_skipped || frame.timestamp - search_->looked_at < kInterval)
    return false;
  search_->looked_at = frame.timestamp;
  ++search_->looks;
  return true;
}

// Whether the map tells another focal length. Ends the search where it tells the same one.
bool PresentLens::TellsAnother(double log_ratio, double sigma) {
  constexpr int kSame = 3;
  if (search_->seen > 0) return true;
  const double off = std::abs(log_ratio - std::log(ratio_)),
               least = search_->has_zoomed ? kBetter : 0.05, sigmas = search_->has_zoomed ? 3 : 5;
  if (off < least && sigma < least / 2 && ++search_->same == kSame) search_.reset();
  return off >= least && off >= sigmas * sigma;
}

bool PresentLens::IsReplaced(const Frame& frame, const std::shared_ptr<const Map>& map,
                             const SlamConfig& config, Relocalizer& relocalizer) {
  constexpr int kEnough = 4;  // images that measure the lens
  if (following_) LookAfterZoom(frame.timestamp, map);
  if (!IsTimeToLook(frame, *map)) return false;
  if (!search_->map) search_->map = map;
  const auto measured = Measure(frame, *search_->map, config, relocalizer);
  if (!measured) return false;
  const auto [log_ratio, sigma] = *measured;
  Log(LogLevel::kDebug, "focal length by the map at {:.2f} s: {:.1f} px, {:.1f} %", frame.timestamp,
      FocalAt(std::exp(log_ratio)), 100 * sigma);
  if (!TellsAnother(log_ratio, sigma)) return false;
  search_->weight += 1 / (sigma * sigma);
  search_->weighted_log_ratio += log_ratio / (sigma * sigma);
  const double mean = search_->weighted_log_ratio / search_->weight;
  const bool is_first = search_->seen == 0, has_zoomed = search_->has_zoomed;
  if (++search_->seen == kEnough) search_.reset();
  if (!is_first && std::abs(mean - std::log(ratio_)) < kBetter) return false;
  const double before = std::exchange(ratio_, std::exp(mean));
  Log(Level(), "{} at {:.2f} s: the focal length was {:.1f} px, and is {:.1f} px by the map",
      has_zoomed ? "the lens has zoomed" : "another lens", frame.timestamp, FocalAt(before),
      FocalAt(ratio_));
  return true;
}

}  // namespace oaslam
