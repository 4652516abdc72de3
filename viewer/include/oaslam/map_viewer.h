#pragma once

#include <memory>
#include <string>

#include "oaslam/export.h"
#include "oaslam/fork.h"
#include "oaslam/image_input.h"
#include "oaslam/slam.h"
#include "oaslam/tracking_result.h"

namespace oaslam {

// How a viewer is reached.
struct MapViewerOptions {
  static constexpr int kDefaultPort = 8340;
  int port = kDefaultPort;  // 0: any free port
  std::string title{};      // of the page
};

// A page, for any number of browsers on this machine, that shows a Slam at work: the image with its
// key points, boxes and objects, the map in three dimensions, and the state of tracking
// (docs/viewer.md). Its own threads, of low priority, serve the page; no call waits for a browser.
// Call its functions on the thread that uses the Slam:
//
//   MapViewer viewer(slam);
//   std::cout << viewer.url() << "\n";
//   while (const auto image = source->Next()) {
//     const ImageInput input{image->image, image->timestamp};
//     viewer.Show(slam, input, slam.Process(input));
//   }
class OASLAM_API MapViewer {
 public:
  // Begins to listen at 127.0.0.1. Throws InputError where the port is taken. The names of classes
  // are taken from `slam` now.
  explicit MapViewer(const Slam& slam, const MapViewerOptions& options = {});
  // Waits up to 6 s for browsers to receive what was shown last.
  ~MapViewer();
  MapViewer(MapViewer&&) noexcept;
  MapViewer& operator=(MapViewer&&) noexcept;

  // "http://127.0.0.1:8340/".
  std::string url() const;

  // Shows the newest image of a Slam. `input` is what Process was given (the image is copied), and
  // `result` what it returned.
  void Show(const Slam& slam, const ImageInput& input, const TrackingResult& result);
  // Shows the whole map with its trajectory, as after Load or Finish. Waits as Slam::Save does.
  void ShowMap(const Slam& slam);

 private:
  class Impl;
  ProcessBound<Impl> impl_;
};

}  // namespace oaslam
