#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "oaslam/service/localization_service.h"
#include "oaslam/service/map_shelf.h"
#include "oaslam/service/messages.h"
#include "oaslam/service/metrics.h"
#include "oaslam/service/private_folder.h"
#include "oaslam/service/worker_pool.h"

namespace oaslam {

// A stream that follows a map.
class MapFollower {
 public:
  virtual ~MapFollower() = default;
  // The map or its edits have changed. Called on the server's thread.
  virtual void OnMapChanged() = 0;
};

// Detectors, each for one thread at a time, made when they are needed. Thread-safe.
class DetectorShelf {
 public:
  explicit DetectorShelf(std::function<std::unique_ptr<Detector>()> make)
      : make_(std::move(make)) {}
  bool empty() const { return !make_; }
  std::vector<Detection> Detect(const cv::Mat& bgr);

 private:
  const std::function<std::unique_ptr<Detector>()> make_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Detector>> idle_;
};

// What all requests and streams of a service share.
struct ServiceState {
  ServiceState(ServiceOptions given, boost::asio::any_io_executor executor_of_server);

  const ServiceOptions options;
  const boost::asio::any_io_executor executor;  // of the server's thread
  Metrics metrics;
  DetectorShelf detectors;
  std::map<std::string, std::set<MapFollower*>> followers;  // by map; on the server's thread only
  MapShelf shelf;
  const std::shared_ptr<PrivateFolder> files;  // for what is being uploaded or recorded
  WorkerPool workers;                          // last member: it uses all others
};

// Runs on the thread of the server.
void TellFollowers(ServiceState& state, const std::string& map);

// Keeps an image where the options ask for it.
void KeepImage(const ServiceState& state, const std::string& map, const std::string& bytes);

// Places, edits and removes anchors for all who use the map, and returns the problem, if there is
// one, with its HTTP status. Each edit begins with the newest version of the anchor in the store,
// so that of two edits at the same time neither undoes a part of the other.
struct AnchorOutcome {
  int status = 200;
  std::string problem;
  std::string name;  // of the anchor
};
AnchorOutcome PlaceAnchor(ServiceState& state, const ServedMap& map, const AnchorRequest& request);
AnchorOutcome ChangeAnchor(ServiceState& state, const ServedMap& map, const std::string& name,
                           const AnchorEdit& edit);
AnchorOutcome RemoveAnchor(ServiceState& state, const ServedMap& map, const std::string& name);

// "anchors", "removed", "version" and "complete" (AnchorNews).
Json JsonOfAnchors(const ServedMap& map, const MapEdits& edits, int64_t since);

}  // namespace oaslam
