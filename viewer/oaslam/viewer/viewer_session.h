#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "oaslam/net/http_service.h"
#include "oaslam/viewer/scene.h"

namespace oaslam {

class ViewerService;

// The WebSocket of one open page. The next message is sent when the page has acknowledged the one
// before, so that a page that is slow, or stops reading, holds up only a message or two; what
// happened meanwhile comes in one message.
class ViewerSession : public WebSocketHandler {
 public:
  ViewerSession(std::shared_ptr<ViewerService> service, bool may_command, bool may_place);
  ~ViewerSession() override;

  size_t MaxMessage() const override { return 4096; }  // our page sends about fifty bytes
  void OnOpen(std::shared_ptr<WebSocketConnection> connection) override;
  void OnMessage(std::string message, bool is_text) override;
  void OnWritten() override { SendNews(); }
  void OnClosed() override { connection_.reset(); }

  void SendNews();
  bool HasFollowed() const;

 private:
  // Handles a message; false where it is not one that our page sends.
  bool Take(const std::string& text);
  bool TakeCommand(const nlohmann::json& message);
  std::string Hello() const;
  void Send(std::string message);
  std::optional<std::string> Answer();

  const std::shared_ptr<ViewerService> service_;
  const bool may_command_, may_place_;
  std::shared_ptr<WebSocketConnection> connection_;  // while it is open
  SceneCursor cursor_;
  bool was_answer_ = false;
  int unacknowledged_ = 0;
  std::optional<ObjectId> asked_object_;  // newest question of each kind
  std::optional<KeyframeId> asked_keyframe_;
};

}  // namespace oaslam
