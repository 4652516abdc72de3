#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "oaslam/content/model_library.h"
#include "oaslam/viewer/scene.h"
#include "oaslam/viewer/viewer_command.h"

namespace oaslam {

class ViewerSession;

// State that the connections of one server share. Used on its thread only.
struct ServerState {
  static constexpr int kMaxConnections = 64;
  static constexpr int kMaxRefusals = 512;  // connections that are being refused

  Scene* scene = nullptr;
  std::string machine_name;
  bool accepts_commands = false,
       accepts_anchors = false;                // whether pages on this machine may send them
  std::shared_ptr<const ModelLibrary> models;  // may be null
  std::function<void(const ViewerCommand&)> on_command;
  std::set<ViewerSession*> viewers;
  int connections = 0, refusals = 0;
};

// The connection to one open page. The next message is sent when the page has acknowledged the one
// before, so that a page that is slow, or stops reading, holds up only a message or two; what
// happened meanwhile comes in one message.
class ViewerSession : public std::enable_shared_from_this<ViewerSession> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;

  // `token` lives as long as the connection.
  ViewerSession(boost::beast::tcp_stream stream, std::shared_ptr<ServerState> server,
                std::shared_ptr<void> token);
  ~ViewerSession();

  void Run(Request request);
  void SendNews();
  void Close(boost::beast::websocket::close_code reason);
  bool HasFollowed() const { return unacknowledged_ == 0 && !is_writing_; }

 private:
  void Read();
  // Handles a message; false where it is not one that our page sends.
  bool Take(const std::string& text);
  bool TakeCommand(const nlohmann::json& message);
  std::string Hello() const;
  void Send(std::string message);
  std::optional<std::string> Answer();

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  std::shared_ptr<ServerState> server_;
  std::shared_ptr<void> token_;
  boost::beast::flat_buffer buffer_;
  Request request_;
  std::string outgoing_;
  SceneCursor cursor_;
  bool is_open_ = false, is_writing_ = false, may_command_ = false, may_place_ = false,
       was_answer_ = false;
  int unacknowledged_ = 0;
  std::optional<ObjectId> asked_object_;  // newest question of each kind
  std::optional<KeyframeId> asked_keyframe_;
};

}  // namespace oaslam
