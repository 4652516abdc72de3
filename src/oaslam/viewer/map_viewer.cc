#include "oaslam/map_viewer.h"

#include <cstdint>
#include <utility>

#include "oaslam/system/slam_access.h"
#include "oaslam/viewer/viewer.h"

namespace oaslam {

class OASLAM_LOCAL MapViewer::Impl {
 public:
  Impl(const Slam& slam, const MapViewerOptions& options)
      : viewer_({.server = {.port = options.port}, .names = SlamAccess::NamesOf(slam)}) {
    status_.title = options.title;
    ShowLive(true);
  }

  std::string url() const { return viewer_.url(); }

  void Show(const Slam& slam, const cv::Mat& image, const TrackingResult& result) {
    ClearAfterBeginning(slam);
    viewer_.Show({.result = result, .view = SlamAccess::View(slam), .image = image.clone()});
    ShowLive(true);
  }

  void ShowMap(const Slam& slam) {
    ClearAfterBeginning(slam);
    SavedMap saved = SlamAccess::Export(slam);
    viewer_.ShowMap(std::make_shared<const Map>(std::move(saved.map)), std::move(saved.trajectory));
    ShowLive(false);
  }

 private:
  // Clears the page where another map was loaded or begun, to which nothing shown belongs.
  void ClearAfterBeginning(const Slam& slam) {
    const uint64_t beginning = SlamAccess::BeginningOf(slam);
    if (std::exchange(beginning_, beginning) != beginning) viewer_.Clear();
  }
  void ShowLive(bool live) {
    if (std::exchange(status_.live, live) != live) viewer_.ShowStatus(status_);
  }

  Viewer viewer_;
  SceneStatus status_;
  uint64_t beginning_ = 0;
};

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
