#include "oaslam/map_localizer.h"

#include "oaslam/error.h"
#include "oaslam/relocalization/image_search.h"
#include "oaslam/relocalization/snapshot_content.h"

namespace oaslam {

class OASLAM_LOCAL MapLocalizer::Impl {
 public:
  const SlamConfig config;
  const MapSnapshot map;  // with an index
};

MapLocalizer::MapLocalizer(const MapSnapshot& map, const SlamConfig& config) {
  CheckConfig(config);
  impl_ = std::make_shared<const Impl>(Impl{config, Indexed(map)});
}

MapLocalizer::MapLocalizer(const std::string& path, const SlamConfig& config)
    : MapLocalizer(MapSnapshot::Load(path), config) {}

RelocalizationResult MapLocalizer::Relocalize(const ImageInput& input,
                                              const RelocalizeOptions& options) const {
  CheckOptions(options, input);
  if (options.follow) throw InputError("relocalize: a MapLocalizer follows no film: use a Slam");
  if (!options.camera && input.image.empty())
    throw InputError("relocalize: without an image the camera must be known");
  const SlamConfig& config = impl_->config;
  const Map& map = *MapOf(impl_->map);
  Relocalizer relocalizer(config, impl_->map.content()->index);
  const Camera camera = options.camera ? *options.camera : UnknownCamera(input.image.size());
  FrameMaker maker(config, camera);
  RelocalizationResult result =
      options.camera
          ? FindImage(input, camera, options, map, config, maker, relocalizer)
          : FindWithUnknownCamera(input, camera, options, map, config, maker, relocalizer);
  result.world = impl_->map.world();
  return result;
}

const MapSnapshot& MapLocalizer::map() const { return impl_->map; }

}  // namespace oaslam
