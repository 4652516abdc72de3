#include "oaslam/mapping/loop_proposals.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "oaslam/geometry/decompositions.h"

namespace oaslam {
namespace {

constexpr size_t kMostThings = 12;   // of a constellation; bounds the pairs to try
constexpr size_t kFewestThings = 4;  // two determine the similarity, the others confirm it
constexpr double kSameSize = 1.6;    // ratio of radii: sizes from few views differ by as much
// Objects of one place follow each other closely in the order in which they were seen last, so that
// only pairs this near in that order are tried.
constexpr size_t kWindow = 32;

bool AreOfOneSize(double a, double b) { return a < kSameSize * b && b < kSameSize * a; }

using PlacesInTime = std::map<ObjectId, ObjectPlaceInTime>;

struct Match {
  const ObjectPlaceInTime *here, *there;
};

// An object of the old part, with those of the constellation that it may be.
struct OldThing {
  const ObjectPlaceInTime* place;
  std::vector<const ObjectPlaceInTime*> alike;
};

// The rotation that best aligns the directions `from` with `to`: about `up`, if that is known, else
// any (Umeyama 1991). Nothing where the directions do not determine it.
std::optional<Eigen::Quaterniond> FitTurn(const Eigen::Matrix3d& to_from_covariance,
                                          const std::optional<Eigen::Vector3d>& up) {
  if (!up) {
    const SingularValues svd = SingularValuesOf(to_from_covariance);
    if (svd.values[1] < 1e-6 * svd.values[0]) return std::nullopt;
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    if (svd.u.determinant() * svd.v.determinant() < 0) signs.z() = -1;
    return Eigen::Quaterniond(svd.u * signs.asDiagonal() * svd.v.transpose());
  }
  // The angle a about u that maximises sum to . R(a) from, which is sin(a) u . sum(from x to) +
  // cos(a) sum(from . to - (u . from) (u . to)) and a constant.
  const Eigen::Matrix3d& c = to_from_covariance;
  const Eigen::Vector3d cross(c(2, 1) - c(1, 2), c(0, 2) - c(2, 0), c(1, 0) - c(0, 1));
  const double sine = up->dot(cross), cosine = c.trace() - up->dot(c * *up);
  if (std::hypot(sine, cosine) < 1e-12) return std::nullopt;
  return Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(sine, cosine), *up));
}

// The similarity that best aligns the centres of objects with those of their copies (least
// squares). Two pairs determine it where the vertical is known.
std::optional<Similarity> Fit(std::span<const Match> matches,
                              const std::optional<Eigen::Vector3d>& up) {
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
  for (const Match& m : matches) {
    from += m.here->center / static_cast<double>(matches.size());
    to += m.there->center / static_cast<double>(matches.size());
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double from_spread = 0, to_spread = 0;
  for (const Match& m : matches) {
    covariance += (m.there->center - to) * (m.here->center - from).transpose();
    from_spread += (m.here->center - from).squaredNorm();
    to_spread += (m.there->center - to).squaredNorm();
  }
  const auto turn = FitTurn(covariance, up);
  if (!turn || !(from_spread > 0) || !(to_spread > 0)) return std::nullopt;
  const double scale = std::sqrt(to_spread / from_spread);
  return Similarity(scale, *turn, to - scale * (*turn * from));
}

// The similarity by two objects. Without a vertical it takes the smallest rotation, since drift
// turns little; the fit to all objects corrects it.
std::optional<Similarity> FitTwo(const Match& a, const Match& b,
                                 const std::optional<Eigen::Vector3d>& up) {
  const Match both[] = {a, b};
  if (up) return Fit(both, up);
  const Eigen::Vector3d from = b.here->center - a.here->center,
                        to = b.there->center - a.there->center;
  const double scale = to.norm() / from.norm();
  const auto turn = TurnBetween(from, to);
  return Similarity(scale, turn, a.there->center - scale * (turn * a.here->center));
}

// Whether two objects are far enough apart, relative to their size, to determine a direction.
bool AreApart(const ObjectPlaceInTime& a, const ObjectPlaceInTime& b) {
  return (a.center - b.center).norm() > a.radius + b.radius;
}

// The objects of the constellation that have a copy where the similarity moves them; each copy is
// used once.
std::vector<Match> CopiesOf(const Similarity& old_from_current,
                            std::span<const OldThing> candidates) {
  struct Near {
    double distance;
    Match match;
  };
  std::vector<Near> near;
  for (const OldThing& old : candidates)
    for (const ObjectPlaceInTime* here : old.alike) {
      const double distance = (old_from_current * here->center - old.place->center).norm();
      if (distance < old.place->radius &&
          AreOfOneSize(old_from_current.scale * here->radius, old.place->radius))
        near.push_back({distance / old.place->radius, {here, old.place}});
    }
  std::ranges::stable_sort(near, {}, &Near::distance);
  std::vector<Match> matches;
  for (const Near& n : near)
    if (std::ranges::none_of(matches, [&](const Match& m) {
          return m.here == n.match.here || m.there == n.match.there;
        }))
      matches.push_back(n.match);
  return matches;
}

// Requires objects of several classes: a row of chairs also fits itself one chair farther on.
bool IsConstellation(std::span<const Match> matches, size_t things) {
  return matches.size() >= std::max(kFewestThings, (things + 1) / 2) &&
         std::ranges::any_of(matches, [&](const Match& m) {
           return m.here->category_id != matches.front().here->category_id;
         });
}

// Of the objects seen in the last keyframes, those nearest to the camera.
std::vector<const ObjectPlaceInTime*> ThingsAbout(const Eigen::Vector3d& camera, KeyframeId since,
                                                  const PlacesInTime& places) {
  std::vector<std::pair<double, const ObjectPlaceInTime*>> near;
  for (const auto& [id, place] : places)
    if (place.newest >= since) near.emplace_back((place.center - camera).squaredNorm(), &place);
  std::ranges::stable_sort(near, {}, [](const auto& entry) { return entry.first; });
  std::vector<const ObjectPlaceInTime*> things;
  for (const auto& [distance, place] : near)
    if (things.size() < kMostThings) things.push_back(place);
  return things;
}

// The objects not seen since `before` that may be one of the constellation, in the order in which
// they were seen last.
std::vector<OldThing> OldThings(std::span<const ObjectPlaceInTime* const> constellation,
                                KeyframeId before, const PlacesInTime& places) {
  std::vector<OldThing> old;
  for (const auto& [id, place] : places) {
    if (place.newest >= before) continue;
    OldThing thing{&place, {}};
    for (const ObjectPlaceInTime* here : constellation)
      if (here->category_id == place.category_id) thing.alike.push_back(here);
    if (!thing.alike.empty()) old.push_back(std::move(thing));
  }
  std::ranges::stable_sort(old, {}, [](const OldThing& o) { return o.place->newest; });
  return old;
}

}  // namespace

bool IsTurnAndScaleOfDrift(const Similarity& correction) {
  // 34 degrees; wide, since points verify the loop.
  constexpr double kMaxAngle = 0.6, kMaxScale = 2.5;
  return correction.rotation.angularDistance(Eigen::Quaterniond::Identity()) < kMaxAngle &&
         std::abs(std::log(correction.scale)) < std::log(kMaxScale);
}

// Looks only at objects that may have changed since the last call.
void LoopProposals::Update(const Map& map) {
  map.objects.ForEachDifference(known_, [&](ObjectId id, const Object*, const Object* now) {
    if (!now || now->state != ObjectState::kMapped || now->observations.empty())
      places_.erase(id);
    else
      places_.insert_or_assign(id, ObjectPlaceInTime{id, now->category_id, now->ellipsoid.center,
                                                     now->ellipsoid.half_axes.maxCoeff(),
                                                     now->observations.back().reference});
  });
  known_ = map.objects;
}

std::optional<LoopProposal> LoopProposals::Find(const Map& map, KeyframeId current,
                                                uint32_t min_apart) {
  Update(map);
  if (current.value < min_apart) return std::nullopt;
  const KeyframeId recently(current.value - min_apart);
  const Eigen::Vector3d camera = map.keyframes.At(current).cam_from_world.OriginInSource();
  const auto things = ThingsAbout(camera, recently, places_);
  if (things.size() < kFewestThings) return std::nullopt;
  const std::vector<OldThing> old = OldThings(things, recently, places_);

  std::vector<Match> best;
  const auto try_pair = [&](const Match& a, const Match& b, std::span<const OldThing> about) {
    if (!AreApart(*a.here, *b.here) || !AreApart(*a.there, *b.there)) return;
    const auto rough = FitTwo(a, b, map.up);
    if (!rough || !IsTurnAndScaleOfDrift(*rough) ||
        !AreOfOneSize(rough->scale * a.here->radius, a.there->radius) ||
        !AreOfOneSize(rough->scale * b.here->radius, b.there->radius))
      return;
    const std::vector<Match> matches = CopiesOf(*rough, about);
    if (matches.size() <= best.size() || !IsConstellation(matches, things.size())) return;
    best = matches;
  };
  for (size_t i = 0; i < old.size(); ++i) {
    const std::span<const OldThing> about =
        std::span(old).subspan(i, std::min(kWindow, old.size() - i));
    for (const OldThing& other : about.subspan(1))
      for (const ObjectPlaceInTime* a : old[i].alike)
        for (const ObjectPlaceInTime* b : other.alike)
          if (a != b) try_pair({a, old[i].place}, {b, other.place}, about);
  }
  if (best.empty()) return std::nullopt;
  const auto fitted = Fit(best, map.up);
  if (!fitted || !IsTurnAndScaleOfDrift(*fitted)) return std::nullopt;
  LoopProposal proposal{*fitted, {}};
  for (const Match& m : best) proposal.old_objects.push_back(m.there->id);
  std::ranges::sort(proposal.old_objects);
  return proposal;
}

}  // namespace oaslam
