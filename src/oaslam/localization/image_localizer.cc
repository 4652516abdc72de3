#include "oaslam/image_localizer.h"

#include <algorithm>
#include <utility>

#include "oaslam/localization/image_search.h"
#include "oaslam/localization/snapshot_maker.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

IndexedMap IndexPiece(const std::string& path, int piece) {
  SavedMap saved = LoadMap(path);
  LeadWithPiece(path, piece, saved);
  return IndexedMap(std::move(saved));
}

}  // namespace

class OASLAM_LOCAL ImageLocalizer::Impl {
 public:
  const SlamConfig config;
  const IndexedMap map;
};

ImageLocalizer::ImageLocalizer(const std::string& map_path, const SlamConfig& config, int piece) {
  CheckConfig(config);
  impl_ = std::make_shared<const Impl>(Impl{config, IndexPiece(map_path, piece)});
}
ImageLocalizer::ImageLocalizer(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
ImageLocalizer::~ImageLocalizer() = default;
ImageLocalizer::ImageLocalizer(const ImageLocalizer&) = default;
ImageLocalizer& ImageLocalizer::operator=(const ImageLocalizer&) = default;

RelocalizationResult ImageLocalizer::Localize(const ImageInput& input, const Camera& camera,
                                              RelocalizationMode mode,
                                              const std::optional<Rigid3>& prior) const {
  CheckMode(mode);
  CheckCamera(camera);
  CheckGravity(input.gravity_in_cam);
  CheckPose(prior);
  const Stopwatch watch;
  const Map& map = impl_->map.saved->map;
  Frame frame;
  if (input.image.empty()) {
    frame.camera = std::make_shared<const Camera>(camera);
    frame.detections = CheckedDetections(camera, input.detections);
    frame.gravity_in_cam = input.gravity_in_cam;
    mode = RelocalizationMode::kObjects;
  } else {
    frame =
        FrameMaker(impl_->config, camera).Make(input, 0, impl_->config.features.count, map.classes);
  }
  const double ms_features = watch.WallMs();
  Rng rng(static_cast<uint64_t>(impl_->config.runner.seed));
  RelocalizationResult result = ResultOf(
      Relocalizer(impl_->config, impl_->map.index).Find(frame, map, mode, rng, nullptr, prior));
  result.ms_features = ms_features;
  result.ms = watch.WallMs() - ms_features;
  return result;
}

RelocalizationResult ImageLocalizer::LocalizeWithUnknownCamera(const ImageInput& input,
                                                               RelocalizationMode mode) const {
  CheckMode(mode);
  CheckGravity(input.gravity_in_cam);
  Camera camera;  // only its size is used
  camera.width = input.image.cols;
  camera.height = input.image.rows;
  camera.fx = camera.fy = std::max(camera.width, camera.height);
  camera.cx = (camera.width - 1) / 2.0;
  camera.cy = (camera.height - 1) / 2.0;
  CheckCamera(camera);
  FrameMaker maker(impl_->config, camera);
  Relocalizer relocalizer(impl_->config, impl_->map.index);
  return FindWithUnknownCamera(input, camera, impl_->map.saved->map, mode, impl_->config, maker,
                               relocalizer);
}

MapSnapshot ImageLocalizer::Snapshot() const {
  const std::shared_ptr<const SavedMap>& saved = impl_->map.saved;
  return SnapshotMaker::Of({saved, &saved->map}, {saved, &saved->class_names}, FramesOf(*saved), 1);
}

ImageLocalizer LocalizerAccess::Make(const SlamConfig& config, IndexedMap map) {
  return ImageLocalizer(
      std::make_shared<const ImageLocalizer::Impl>(ImageLocalizer::Impl{config, std::move(map)}));
}

const IndexedMap& LocalizerAccess::MapOf(const ImageLocalizer& localizer) {
  return localizer.impl_->map;
}

}  // namespace oaslam
