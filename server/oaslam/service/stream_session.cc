#include "oaslam/service/stream_session.h"

#include <boost/asio/post.hpp>
#include <chrono>
#include <cstring>
#include <utility>

#include "oaslam/formats/json_text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

constexpr uint16_t kNormal = 1000, kPolicy = 1008;  // RFC 6455, 7.4.1
constexpr size_t kMostCommands = 16;                // that wait; a person gives one or two a second

StreamStep ErrorStep(const std::string& message, bool ends) {
  return {{{{"type", "error"}, {"message", message}}}, ends};
}

// The header of a message with an image, which is the rest.
nlohmann::json HeaderOf(const std::string& message, std::string& image) {
  constexpr size_t kMostHeader = 1 << 20;  // bytes; some thousand detections
  uint32_t length = 0;
  if (message.size() >= sizeof(length)) std::memcpy(&length, message.data(), sizeof(length));
  if (length == 0 || length > kMostHeader || length > message.size() - sizeof(length))
    throw BadInput("message: the length of its header, {}, is wrong", length);
  nlohmann::json header =
      ParseJson(std::string_view(message).substr(sizeof(length), length), "header");
  const JsonInput json(header, "header");
  json.Only({"type", "id", "time", "gravity", "angular_velocity", "imu", "cam_from_imu", "camera",
             "detections", "motion", "features"});
  if (json["type"].Text() != "image") json["type"].Refuse("must be \"image\"");
  json["time"].Number();
  image = message.substr(sizeof(length) + length);
  return header;
}

StreamStep ImageStep(StreamWork& work, const std::string& message, int dropped) {
  std::string bytes;
  const nlohmann::json header = HeaderOf(message, bytes);
  ImageRequest image = ReadImageRequest(JsonInput(header, "header"));
  image.bytes = std::move(bytes);
  return work.Image(image, header, dropped);
}

StreamStep CommandStep(StreamWork& work, const std::string& message) {
  const nlohmann::json json = ParseJson(message, "message");
  JsonInput(json, "message")["type"].Text();
  return work.Command(json);
}

}  // namespace

StreamSession::StreamSession(std::shared_ptr<ServiceState> state, std::string map,
                             std::unique_ptr<StreamWork> work)
    : state_(std::move(state)),
      map_(std::move(map)),
      work_(std::move(work)),
      retry_(state_->executor) {}

StreamSession::~StreamSession() = default;

void StreamSession::OnOpen(std::shared_ptr<WebSocketConnection> connection) {
  connection_ = std::move(connection);
  state_->followers[map_].insert(this);
  Next();
}

void StreamSession::OnMessage(std::string message, bool is_text) {
  if (!is_text) {
    dropped_ += image_.has_value();
    image_ = std::move(message);
  } else if (commands_.size() < kMostCommands) {
    commands_.push_back(std::move(message));
  } else if (connection_) {
    return connection_->Close(kPolicy);
  }
  Next();
}

void StreamSession::OnMapChanged() {
  must_look_ = true;
  Next();
}

void StreamSession::OnClosed() {
  connection_ = nullptr;
  retry_.cancel();
  const auto found = state_->followers.find(map_);
  if (found == state_->followers.end()) return;
  found->second.erase(this);
  if (found->second.empty()) state_->followers.erase(found);
}

void StreamSession::OnWritten() { Next(); }

// Sends what is to be sent; where there is nothing, begins the next piece of work.
void StreamSession::Next() {
  if (!connection_ || connection_->IsWriting()) return;
  if (!outgoing_.empty()) {
    std::string message = std::move(outgoing_.front());
    outgoing_.pop_front();
    return connection_->Send(std::move(message), true);
  }
  if (ends_) return connection_->Close(kNormal);
  if (is_working_) return;
  if (must_begin_) {
    Run([](StreamWork& work) { return work.Begin(); });
  } else if (must_look_) {
    Run([](StreamWork& work) { return work.Look(); });
  } else if (!commands_.empty()) {
    Run([message = commands_.front()](StreamWork& work) { return CommandStep(work, message); });
  } else if (image_) {
    Run([message = *image_, dropped = dropped_](StreamWork& work) {
      return ImageStep(work, message, dropped);
    });
  }
}

void StreamSession::Run(std::function<StreamStep(StreamWork&)> step) {
  const auto self = shared_from_this();
  const bool is_added =
      state_->workers.TryAdd([self, work = work_, step = std::move(step), begins = must_begin_] {
        StreamStep done;
        try {
          done = step(*work);
        } catch (const InputError& error) {
          done = ErrorStep(error.what(), begins);
        } catch (const StoreUnavailable& error) {
          done = ErrorStep(error.what(), begins);
        } catch (const std::exception& error) {
          Log(LogLevel::kWarning, "stream of map {}: {}", self->map_, error.what());
          done = ErrorStep("internal error", true);
        }
        boost::asio::post(self->state_->executor, [self, done = std::move(done)]() mutable {
          self->Take(std::move(done));
        });
      });
  if (!is_added) {
    // The queue of the workers is full: the stream tries again after a part of the time that an
    // image takes.
    constexpr auto kPause = std::chrono::milliseconds(20);
    retry_.expires_after(kPause);
    retry_.async_wait([self](boost::system::error_code stopped) {
      if (!stopped) self->Next();
    });
    return;
  }
  is_working_ = true;
  if (must_begin_)
    must_begin_ = false;
  else if (must_look_)
    must_look_ = false;
  else if (!commands_.empty())
    commands_.pop_front();
  else
    image_.reset();
}

void StreamSession::Take(StreamStep step) {
  is_working_ = false;
  for (const Json& message : step.messages) outgoing_.push_back(JsonText(message));
  ends_ = ends_ || step.ends;
  Next();
}

}  // namespace oaslam
