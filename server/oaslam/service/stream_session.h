#pragma once

#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/net/http_service.h"
#include "oaslam/service/service_state.h"

namespace oaslam {

// What one step of the work on a stream tells the client.
struct StreamStep {
  std::vector<Json> messages;
  bool ends = false;  // the connection is closed after the messages
};

// The work on one stream of images. Its functions are called on threads of the workers, one at a
// time. An InputError becomes a message of type error, and the stream goes on.
class StreamWork {
 public:
  virtual ~StreamWork() = default;
  virtual StreamStep Begin() = 0;
  // The map or its edits have changed.
  virtual StreamStep Look() = 0;
  virtual StreamStep Command(const nlohmann::json& message) = 0;
  // `dropped`: images so far that nobody looked at, since newer ones came.
  virtual StreamStep Image(const ImageRequest& image, const nlohmann::json& header,
                           int dropped) = 0;
};

// The connection of a camera that streams images. Work and sending alternate: nothing is worked at
// before all answers to the last thing are written, and meanwhile only the newest image is kept, so
// that nothing queues up, however slow the client or the server.
class StreamSession : public WebSocketHandler,
                      public MapFollower,
                      public std::enable_shared_from_this<StreamSession> {
 public:
  // `map`: whose changes are followed.
  StreamSession(std::shared_ptr<ServiceState> state, std::string map,
                std::unique_ptr<StreamWork> work);
  ~StreamSession() override;

  size_t MaxMessage() const override { return 16 << 20; }
  void OnOpen(std::shared_ptr<WebSocketConnection> connection) override;
  void OnMessage(std::string message, bool is_text) override;
  void OnWritten() override;
  void OnClosed() override;
  void OnMapChanged() override;

 private:
  void Next();
  void Run(std::function<StreamStep(StreamWork&)> step);
  void Take(StreamStep step);

  const std::shared_ptr<ServiceState> state_;
  const std::string map_;
  std::shared_ptr<StreamWork> work_;                 // used by a worker while is_working_
  std::shared_ptr<WebSocketConnection> connection_;  // null: not open
  boost::asio::steady_timer retry_;
  bool must_begin_ = true, must_look_ = false, is_working_ = false;
  std::deque<std::string> commands_;  // that wait
  std::optional<std::string> image_;  // the newest that waits
  int dropped_ = 0;
  std::deque<std::string> outgoing_;
  bool ends_ = false;
};

// A camera that makes a new map: the WebSocket /v1/maps/{map}/record.
std::unique_ptr<StreamWork> RecordWork(std::shared_ptr<ServiceState> state, const std::string& map);

// A camera that is followed in a map, which it does not change: the WebSocket
// /v1/maps/{map}/track.
std::unique_ptr<StreamWork> TrackWork(std::shared_ptr<ServiceState> state, const std::string& map,
                                      bool may_write);

}  // namespace oaslam
