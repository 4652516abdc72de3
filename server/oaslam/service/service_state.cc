#include "oaslam/service/service_state.h"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <chrono>
#include <fstream>
#include <utility>

#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// A request that waits longer than eight others take is better sent to another server.
constexpr size_t kMostWaitingPerWorker = 8;
constexpr int kOk = 200, kCreated = 201, kBadRequest = 400, kNotFound = 404, kConflict = 409;

// Carries out one edit of the anchors as they are now, and stores it.
template <typename Act>
AnchorOutcome Edit(ServiceState& state, const ServedMap& map, const std::string& name, Act&& act) {
  const std::string& map_name = map.stored.name;
  state.shelf.Refresh(map_name);
  // An anchor is relative to keyframes and objects: in another map these are others.
  const auto served = state.shelf.Get(map_name);
  if (!served) return {kNotFound, fmt::format("there is no map \"{}\"", map_name), name};
  if (served->stored.digest != map.stored.digest)
    return {kConflict, fmt::format("the map \"{}\" was replaced meanwhile", map_name), name};
  const Map now = WithEdits(map.saved().map, *state.shelf.Edits(map_name));
  if (!name.empty() && !now.anchors.contains(name))
    return {kNotFound, fmt::format("there is no anchor \"{}\"", name), name};
  AnchorOutcome outcome = act(now);
  state.shelf.Refresh(map_name);
  return outcome;
}

}  // namespace

std::vector<Detection> DetectorShelf::Detect(const cv::Mat& bgr) {
  std::unique_ptr<Detector> detector;
  {
    const std::scoped_lock lock(mutex_);
    if (!idle_.empty()) {
      detector = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!detector) detector = make_();
  std::vector<Detection> found = detector->Detect(bgr);
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(detector));
  return found;
}

ServiceState::ServiceState(ServiceOptions given, boost::asio::any_io_executor executor_of_server)
    : options(std::move(given)),
      executor(std::move(executor_of_server)),
      detectors(options.make_detector),
      shelf(options.store, options.config, options.memory_bytes,
            [this](const std::string& map) {
              boost::asio::post(executor, [this, map] { TellFollowers(*this, map); });
            }),
      files(TemporaryFolder()),
      workers(options.workers, options.workers * kMostWaitingPerWorker) {}

void TellFollowers(ServiceState& state, const std::string& map) {
  const auto found = state.followers.find(map);
  if (found == state.followers.end()) return;
  for (MapFollower* follower : found->second) follower->OnMapChanged();
}

void KeepImage(const ServiceState& state, const std::string& map, const std::string& bytes) {
  if (state.options.keep_images.empty() || bytes.empty()) return;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::string path =
      fmt::format("{}/{}-{}.{}", state.options.keep_images, map,
                  std::chrono::duration_cast<std::chrono::microseconds>(now).count(),
                  bytes.starts_with("\x89PNG") ? "png" : "jpg");
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file) Log(LogLevel::kWarning, path + ": cannot be written");
}

AnchorOutcome PlaceAnchor(ServiceState& state, const ServedMap& map, const AnchorRequest& request) {
  return Edit(state, map, "", [&](const Map& now) -> AnchorOutcome {
    const bool is_named = !request.name.empty();
    Anchors anchors = now.anchors;
    // A name that the client did not give may be taken by another server at the same time: then the
    // next free one is tried.
    for (;;) {
      const AnchorReport report = oaslam::PlaceAnchor(now, request, anchors);
      if (!report.IsDone())
        return {is_named && now.anchors.contains(request.name) ? kConflict : kBadRequest,
                report.why_not, request.name};
      if (state.shelf.store().EditAnchor(map.stored.name, report.name, anchors.at(report.name),
                                         true))
        return {kCreated, "", report.name};
      if (is_named)
        return {kConflict, fmt::format("there is an anchor \"{}\" already", report.name),
                report.name};
    }
  });
}

AnchorOutcome ChangeAnchor(ServiceState& state, const ServedMap& map, const std::string& name,
                           const AnchorEdit& edit) {
  return Edit(state, map, name, [&](const Map& now) -> AnchorOutcome {
    Anchors anchors = now.anchors;
    const AnchorReport report = oaslam::EditAnchor(now, name, edit, anchors);
    if (!report.IsDone())
      return {edit.name && now.anchors.contains(*edit.name) ? kConflict : kBadRequest,
              report.why_not, name};
    const std::string& name_now = report.name;
    const bool is_renamed = name_now != name;
    if (!state.shelf.store().EditAnchor(map.stored.name, name_now, anchors.at(name_now), is_renamed,
                                        is_renamed ? name : ""))
      return {kConflict, fmt::format("there is an anchor \"{}\" already", name_now), name};
    return {kOk, "", name_now};
  });
}

AnchorOutcome RemoveAnchor(ServiceState& state, const ServedMap& map, const std::string& name) {
  return Edit(state, map, name, [&](const Map&) -> AnchorOutcome {
    state.shelf.store().EditAnchor(map.stored.name, name, std::nullopt, false);
    return {kOk, "", name};
  });
}

Json JsonOfAnchors(const ServedMap& map, const MapEdits& edits, int64_t since) {
  const AnchorNews news = NewsOf(map.saved().map, edits, since);
  Json anchors = Json::array();
  for (const VersionedAnchor& anchor : news.anchors)
    anchors.push_back(JsonOf(anchor.pose, anchor.version));
  return {{"version", edits.version},
          {"complete", news.is_complete},
          {"anchors", std::move(anchors)},
          {"removed", news.is_complete ? std::vector<std::string>() : news.removed}};
}

}  // namespace oaslam
