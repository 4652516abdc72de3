#include "oaslam/objects/object_model.h"

#include <limits>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// Below this overlap the fit starts again from a sphere: the old shape may be a local minimum.
constexpr double kBadIoU = 0.5;

EllipsoidFitOptions OptionsOf(const Map& map, const ObjectsConfig& config) {
  EllipsoidFitOptions options;
  if (config.model == ObjectMethod::kPaper)
    options.residual = EllipsoidResidual::kWasserstein;
  else
    options.up = map.up;
  return options;
}

Eigen::Vector3d DirectionInWorld(const Map& map, const ObjectObservation& o) {
  const Rigid3 cam_from_world = o.cam_from_reference * *map.ResolvePose(o.reference);
  return (cam_from_world.rotation.conjugate() * RayOf(map.cameras[o.camera], CenterPixel(o.box)))
      .normalized();
}

}  // namespace

std::vector<BoxView> ViewsOf(const Map& map, std::span<const ObjectObservation> observations) {
  std::vector<BoxView> views;
  views.reserve(observations.size());
  double weight = 0, surfaces = 0;
  for (const ObjectObservation& o : observations) {
    const std::optional<Rigid3> reference_from_world = map.ResolvePose(o.reference);
    OASLAM_CHECK(reference_from_world.has_value());
    views.push_back({o.cam_from_reference * *reference_from_world, &map.cameras[o.camera], o.box,
                     o.score, o.truncated, o.weight, o.surface});
    weight += o.weight;
    if (o.surface > 0) surfaces += o.weight;
  }
  // That a thing is no ellipsoid is the same error in all views: together their surfaces count as
  // those of a few. The boxes tell the rest by their parallax.
  constexpr double kMostSurfaces = 5;
  if (surfaces > kMostSurfaces)
    for (BoxView& view : views) view.surface_weight = kMostSurfaces / surfaces;
  // Observations of a long video are thinned out, but their errors remain correlated through the
  // object, so that together they count no more than kMaxObservations.
  if (weight > kMaxObservations)
    for (BoxView& view : views) view.weight *= kMaxObservations / weight;
  return views;
}

std::optional<ObjectModel> FitObjectModel(const Map& map, std::span<const BoxView> views,
                                          const Ellipsoid* current, const ObjectsConfig& config) {
  const EllipsoidFitOptions options = OptionsOf(map, config);
  const auto measured = [&](const EllipsoidFit& fit) {
    return ObjectModel{fit.ellipsoid, MeasureOverlap(fit.ellipsoid, views, kMinAcceptIoU)};
  };
  std::optional<ObjectModel> best;
  if (current) {
    if (const EllipsoidFit fit = FitEllipsoid(views, *current, options); fit.success)
      best = measured(fit);
    if (best && best->overlap.mean_iou >= kBadIoU) return best;
  }
  const SphereEstimate sphere = EstimateSphere(views, config.min_parallax_deg);
  if (!sphere.success) return best;
  const EllipsoidFit fit = FitFromSphere(views, sphere.sphere, options);
  if (!fit.success) return best;
  const ObjectModel fresh = measured(fit);
  return best && best->overlap.mean_iou >= fresh.overlap.mean_iou ? best : fresh;
}

void AdoptModel(const ObjectModel& model, std::span<const BoxView> views, Object& object) {
  object.ellipsoid = model.ellipsoid;
  object.mean_iou = model.overlap.mean_iou;
  object.covariance = EstimateCovariance(model.ellipsoid, views);
}

void ThinObservations(const Map& map, std::vector<ObjectObservation>& observations) {
  // Angle (rad) that one frame of a 30 Hz video counts for when gaps are compared, so that
  // observations of a camera that stands still have some value, too.
  constexpr double kAnglePerFrame = 0.001;
  if (observations.size() <= kMaxObservations) return;
  std::vector<Eigen::Vector3d> directions;
  for (const ObjectObservation& o : observations) directions.push_back(DirectionInWorld(map, o));
  while (observations.size() > kMaxObservations) {
    size_t closest = 1;
    double smallest = std::numeric_limits<double>::infinity();
    for (size_t i = 1; i + 1 < observations.size(); ++i) {
      const double gap = (directions[i + 1] - directions[i - 1]).norm() +
                         kAnglePerFrame * observations[i].weight *
                             (observations[i + 1].frame_index - observations[i - 1].frame_index);
      if (gap >= smallest) continue;
      smallest = gap;
      closest = i;
    }
    directions.erase(directions.begin() + static_cast<std::ptrdiff_t>(closest));
    observations.erase(observations.begin() + static_cast<std::ptrdiff_t>(closest));
  }
}

}  // namespace oaslam
