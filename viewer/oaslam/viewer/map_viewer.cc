#include "oaslam/map_viewer.h"

#include <utility>

#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/slam.h"
#include "oaslam/system/slam_view.h"
#include "oaslam/viewer/viewer.h"

namespace oaslam {

class OASLAM_LOCAL MapViewer::Impl {
 public:
  Impl(const Slam& slam, const MapViewerOptions& options)
      : viewer_({.server = {.port = options.port}, .names = slam.Snapshot().CategoryNames()}) {
    status_.title = options.title;
    ShowLive(true);
  }

  std::string url() const { return viewer_.url(); }

  void Show(const Slam& slam, const cv::Mat& image, const TrackingResult& result) {
    ClearInNewWorld(result.world);
    FrameRecord record = RecordOf(slam, result);
    record.image = image.clone();
    viewer_.Show(std::move(record));
    ShowLive(true);
  }

  void ShowMap(const Slam& slam) {
    const MapSnapshot map = slam.WholeMap();
    ClearInNewWorld(map.world());
    const std::shared_ptr<const SavedMap>& saved = map.content()->saved;
    viewer_.ShowMap(MapOf(map), saved ? saved->trajectory : std::vector<FramePose>());
    ShowLive(false);
  }

 private:
  // Clears the page where another map was loaded or begun, to which nothing shown belongs.
  void ClearInNewWorld(WorldId world) {
    if (std::exchange(world_, world) != world) viewer_.Clear();
  }
  void ShowLive(bool live) {
    if (std::exchange(status_.live, live) != live) viewer_.ShowStatus(status_);
  }

  Viewer viewer_;
  SceneStatus status_;
  WorldId world_;
};

FrameRecord RecordOf(const Slam& slam, const TrackingResult& result) {
  return {.result = result, .view = *slam.NewestView()};
}

MapViewer::MapViewer(const Slam& slam, const MapViewerOptions& options)
    : impl_(std::make_unique<Impl>(slam, options)) {}
MapViewer::~MapViewer() = default;
MapViewer::MapViewer(MapViewer&&) noexcept = default;
MapViewer& MapViewer::operator=(MapViewer&&) noexcept = default;

std::string MapViewer::url() const { return impl_->url(); }

void MapViewer::Show(const Slam& slam, const ImageInput& input, const TrackingResult& result) {
  impl_->Show(slam, input.image, result);
}

void MapViewer::ShowMap(const Slam& slam) { impl_->ShowMap(slam); }

}  // namespace oaslam
