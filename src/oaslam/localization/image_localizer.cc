#include "oaslam/image_localizer.h"

#include <utility>

#include "oaslam/localization/localizer.h"
#include "oaslam/localization/snapshot_maker.h"
#include "oaslam/storage/map_file.h"

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
  Impl(const std::string& map_path, const SlamConfig& config, int piece)
      : localizer(config, IndexPiece(map_path, piece)) {}
  const Localizer localizer;
};

ImageLocalizer::ImageLocalizer(const std::string& map_path, const SlamConfig& config, int piece) {
  CheckConfig(config);
  impl_ = std::make_shared<const Impl>(map_path, config, piece);
}
ImageLocalizer::~ImageLocalizer() = default;
ImageLocalizer::ImageLocalizer(const ImageLocalizer&) = default;
ImageLocalizer& ImageLocalizer::operator=(const ImageLocalizer&) = default;

RelocalizationResult ImageLocalizer::Localize(const ImageInput& input, const Camera& camera,
                                              RelocalizationMode mode,
                                              const std::optional<Rigid3>& prior) const {
  return impl_->localizer.Find(input, camera, mode, prior);
}

RelocalizationResult ImageLocalizer::LocalizeWithUnknownCamera(const ImageInput& input,
                                                               RelocalizationMode mode) const {
  return impl_->localizer.FindWithUnknownCamera(input, mode);
}

MapSnapshot ImageLocalizer::Snapshot() const {
  const std::shared_ptr<const SavedMap>& saved = impl_->localizer.map().saved;
  return SnapshotMaker::Of({saved, &saved->map}, {saved, &saved->class_names}, FramesOf(*saved), 1);
}

}  // namespace oaslam
