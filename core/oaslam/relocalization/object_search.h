#pragma once

#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/relocalization/object_scene.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Whether two poses by objects are distinct: only distinct poses enter a margin or a list of
// candidates.
bool AreElsewhere(const Relocalization& a, const Relocalization& b);

// The evidence that suffices to report a pose by objects alone.
struct ObjectDemands {
  double margin = 0, evidence = 0;  // of ObjectSupport
  int objects = 0;
  double confidence = 0;

  ObjectDemands(const ObjectScene& scene, const RelocalizationConfig& config);
  // Accepts the best pose of an image, or says why not. `matched`: objects, over several images.
  void Judge(int matched, Relocalization& best) const;
};

// The refined poses of an image, best score first; not distinct.
std::vector<Relocalization> SearchPoses(const ObjectScene& scene, const ObjectDemands& demands,
                                        Rng& rng);

}  // namespace oaslam
