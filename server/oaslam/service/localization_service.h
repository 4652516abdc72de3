#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "oaslam/class_names.h"
#include "oaslam/config.h"
#include "oaslam/content/model_library.h"
#include "oaslam/detector.h"
#include "oaslam/net/http_service.h"
#include "oaslam/service/map_store.h"

namespace oaslam {

struct AnchorOutcome;
struct ServedMap;
struct ServiceState;
struct Target;

struct ServiceOptions {
  std::shared_ptr<MapStore> store;
  SlamConfig config = SlamConfig::Offline();
  size_t memory_bytes = size_t{4} << 30;  // of loaded maps
  size_t workers = 1;
  // Makes a detector, for images that points do not find and that have no boxes, and for new maps;
  // null: none.
  std::function<std::unique_ptr<Detector>()> make_detector;
  Classes classes;          // of the detector, for new maps
  std::string keep_images;  // folder for the images that are sent; empty: none is kept
  std::shared_ptr<const ModelLibrary> models;
};

// Answers where cameras are in the maps of a store (docs/service.md).
class LocalizationService : public HttpService {
 public:
  // `executor`: of the server's thread.
  LocalizationService(ServiceOptions options, boost::asio::any_io_executor executor);

  // Waits for the work under way, that of closed streams included, since at its end it posts to the
  // executor; no more work is begun. To be called once the server is closed, and before the
  // executor is destroyed.
  void Finish();

  Access AccessFor(const HttpRequest& head) const override;
  BodyPlan PlanBody(const HttpRequest& head) override;
  void Handle(HttpRequest request, Reply reply) override;
  std::shared_ptr<WebSocketHandler> Upgrade(const HttpRequest& request) override;

 private:
  HttpAnswer AnswerAtOnce(const Target& target, const HttpRequest& request);
  HttpAnswer Work(const Target& target, HttpRequest& request);
  HttpAnswer Do(const Target& target, HttpRequest& request);
  std::shared_ptr<const ServedMap> MapOf(const Target& target);
  HttpAnswer DescribeMap(const ServedMap& map);
  HttpAnswer PutMap(const std::string& name, const std::string& file);
  HttpAnswer AnswerModel(const std::string& path);
  HttpAnswer AnswerAnchor(const ServedMap& map, const AnchorOutcome& outcome);

  std::shared_ptr<ServiceState> state_;
};

}  // namespace oaslam
