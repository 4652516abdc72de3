#pragma once

#include <functional>
#include <memory>
#include <set>

#include "oaslam/content/model_library.h"
#include "oaslam/net/http_service.h"
#include "oaslam/viewer/scene.h"
#include "oaslam/viewer/viewer_command.h"

namespace oaslam {

class ViewerSession;

// What the viewer's server serves: the page at /, its WebSocket at /ws, and the files of models
// below /models/. Used on the server's thread only.
class ViewerService : public HttpService, public std::enable_shared_from_this<ViewerService> {
 public:
  struct Options {
    // Whether pages that may command (MayCommand) may send commands of either kind.
    bool accepts_commands = false, accepts_anchors = false;
    std::shared_ptr<const ModelLibrary> models{};  // may be null
    std::function<void(const ViewerCommand&)> on_command{};
  };

  // `scene` must outlive the service's use.
  ViewerService(Scene& scene, Options options) : scene_(scene), options_(std::move(options)) {}

  // The page itself tells nothing about the map, and a browser sends no token for it.
  Access AccessFor(const HttpRequest& head) const override;
  void Handle(HttpRequest request, Reply reply) override;
  std::shared_ptr<WebSocketHandler> Upgrade(const HttpRequest& request) override;

  // Sends the news to every viewer that is ready for it.
  void Broadcast();
  // Whether all viewers have acknowledged everything sent.
  bool AllHaveFollowed() const;

 private:
  friend class ViewerSession;

  HttpAnswer AnswerModel(const std::string& path) const;

  Scene& scene_;
  const Options options_;
  std::set<ViewerSession*> viewers_;
};

}  // namespace oaslam
