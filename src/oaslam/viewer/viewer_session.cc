#include "oaslam/viewer/viewer_session.h"

#include <boost/asio/buffer.hpp>
#include <nlohmann/json.hpp>
#include <utility>

namespace oaslam {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using nlohmann::json;

constexpr int kMaxUnacknowledged = 2;  // one being sent, one being drawn

std::optional<uint32_t> IdOf(const json& message) {
  const auto id = message.find("id");
  if (id == message.end() || !id->is_number_unsigned() || id->get<uint64_t>() >= UINT32_MAX)
    return std::nullopt;
  return id->get<uint32_t>();
}

}  // namespace

ViewerSession::ViewerSession(beast::tcp_stream stream, std::shared_ptr<ServerState> server,
                             std::shared_ptr<void> token)
    : socket_(std::move(stream)), server_(std::move(server)), token_(std::move(token)) {
  server_->viewers.insert(this);
}

ViewerSession::~ViewerSession() { server_->viewers.erase(this); }

void ViewerSession::Run(Request request) {
  constexpr size_t kMaxMessage = 4096;  // bytes; our page sends about fifty
  request_ = std::move(request);
  boost::system::error_code error;
  const auto peer = beast::get_lowest_layer(socket_).socket().remote_endpoint(error);
  const bool is_local = !error && peer.address().is_loopback();
  may_command_ = server_->accepts_commands && is_local;
  may_place_ = server_->accepts_anchors && is_local;
  beast::get_lowest_layer(socket_).expires_never();
  websocket::stream_base::timeout timeout{std::chrono::seconds(10), std::chrono::seconds(30), true};
  socket_.set_option(timeout);
  socket_.read_message_max(kMaxMessage);
  socket_.binary(true);
  socket_.auto_fragment(false);
  socket_.async_accept(request_, [self = shared_from_this()](beast::error_code failure) {
    if (failure) return;
    self->is_open_ = true;
    self->Send(self->Hello());
    self->Read();
  });
}

std::string ViewerSession::Hello() const {
  MessageBuilder hello("hello");
  hello.header["protocol"] = 1;
  hello.header["commands"] = may_command_;
  hello.header["anchors"] = may_place_;
  json& models = hello.header["models"] = json::array();
  if (server_->models)
    for (const std::string& name : server_->models->names())
      models.push_back({{"name", name}, {"url", "/models/" + server_->models->entry(name)}});
  return std::move(hello).Finish();
}

void ViewerSession::Read() {
  socket_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, size_t) {
    if (error) {
      self->is_open_ = false;
      return;
    }
    const bool is_ours =
        self->socket_.got_text() && self->Take(beast::buffers_to_string(self->buffer_.data()));
    self->buffer_.consume(self->buffer_.size());
    if (!is_ours) return self->Close(websocket::close_code::policy_error);
    self->SendNews();
    self->Read();
  });
}

bool ViewerSession::Take(const std::string& text) {
  const json message = json::parse(text, nullptr, false);
  if (!message.is_object() || !message.contains("type") || !message["type"].is_string())
    return false;
  const auto type = message["type"].get<std::string>();
  if (type == "ack") return --unacknowledged_ >= 0;
  if (type == "command" || type == "place" || type == "anchor") return TakeCommand(message);
  const std::optional<uint32_t> id = IdOf(message);
  if (!id) return false;
  if (type == "object")
    asked_object_ = ObjectId(*id);
  else if (type == "keyframe")
    asked_keyframe_ = KeyframeId(*id);
  else
    return false;
  return true;
}

// A command without permission is ignored and is no error, since the page may
// be older than the run.
bool ViewerSession::TakeCommand(const json& message) {
  const std::optional<ViewerCommand> command = ParseCommand(message);
  if (!command) return false;
  if (command->IsOfAnchors() ? may_place_ : may_command_) server_->on_command(*command);
  return true;
}

std::optional<std::string> ViewerSession::Answer() {
  if (asked_object_)
    return server_->scene->DescribeObject(*std::exchange(asked_object_, std::nullopt));
  if (asked_keyframe_)
    return server_->scene->DescribeKeyframe(*std::exchange(asked_keyframe_, std::nullopt));
  return std::nullopt;
}

void ViewerSession::SendNews() {
  if (!is_open_ || is_writing_ || unacknowledged_ >= kMaxUnacknowledged) return;
  // News and answers alternate, so that a viewer with many questions still receives news.
  const bool is_turn_of_news = std::exchange(was_answer_, false);
  std::optional<std::string> message =
      is_turn_of_news ? server_->scene->News(cursor_) : std::nullopt;
  if (!message) {
    message = Answer();
    was_answer_ = message.has_value();
  }
  if (!message && !is_turn_of_news) message = server_->scene->News(cursor_);
  if (message) Send(std::move(*message));
}

void ViewerSession::Send(std::string message) {
  outgoing_ = std::move(message);
  is_writing_ = true;
  ++unacknowledged_;
  socket_.async_write(boost::asio::buffer(outgoing_),
                      [self = shared_from_this()](beast::error_code error, size_t) {
                        self->is_writing_ = false;
                        if (error)
                          self->is_open_ = false;
                        else
                          self->SendNews();
                      });
}

void ViewerSession::Close(websocket::close_code reason) {
  if (!std::exchange(is_open_, false)) return;
  socket_.async_close(reason, [self = shared_from_this()](beast::error_code) {});
}

}  // namespace oaslam
