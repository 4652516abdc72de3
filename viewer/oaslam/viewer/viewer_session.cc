#include "oaslam/viewer/viewer_session.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "oaslam/viewer/message.h"
#include "oaslam/viewer/viewer_service.h"

namespace oaslam {
namespace {

using nlohmann::json;

constexpr int kMaxUnacknowledged = 2;        // one being sent, one being drawn
constexpr uint16_t kPolicyViolation = 1008;  // RFC 6455, 7.4.1

std::optional<uint32_t> IdOf(const json& message) {
  const auto id = message.find("id");
  if (id == message.end() || !id->is_number_unsigned() || id->get<uint64_t>() >= UINT32_MAX)
    return std::nullopt;
  return id->get<uint32_t>();
}

}  // namespace

ViewerSession::ViewerSession(std::shared_ptr<ViewerService> service, bool may_command,
                             bool may_place)
    : service_(std::move(service)), may_command_(may_command), may_place_(may_place) {
  service_->viewers_.insert(this);
}

ViewerSession::~ViewerSession() { service_->viewers_.erase(this); }

void ViewerSession::OnOpen(std::shared_ptr<WebSocketConnection> connection) {
  connection_ = std::move(connection);
  Send(Hello());
}

std::string ViewerSession::Hello() const {
  MessageBuilder hello("hello");
  hello.header["protocol"] = 1;
  hello.header["commands"] = may_command_;
  hello.header["anchors"] = may_place_;
  json& models = hello.header["models"] = json::array();
  if (service_->options_.models)
    for (const std::string& name : service_->options_.models->names())
      models.push_back(
          {{"name", name}, {"url", "/models/" + service_->options_.models->entry(name)}});
  return std::move(hello).Finish();
}

void ViewerSession::OnMessage(std::string message, bool is_text) {
  if (!connection_) return;  // it is being closed
  if (is_text && Take(message)) return SendNews();
  std::exchange(connection_, nullptr)->Close(kPolicyViolation);
}

bool ViewerSession::HasFollowed() const {
  return unacknowledged_ == 0 && !(connection_ && connection_->IsWriting());
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
  if (command->IsOfAnchors() ? may_place_ : may_command_) service_->options_.on_command(*command);
  return true;
}

std::optional<std::string> ViewerSession::Answer() {
  if (asked_object_)
    return service_->scene_.DescribeObject(*std::exchange(asked_object_, std::nullopt));
  if (asked_keyframe_)
    return service_->scene_.DescribeKeyframe(*std::exchange(asked_keyframe_, std::nullopt));
  return std::nullopt;
}

void ViewerSession::SendNews() {
  if (!connection_ || connection_->IsWriting() || unacknowledged_ >= kMaxUnacknowledged) return;
  // News and answers alternate, so that a viewer with many questions still receives news.
  const bool is_turn_of_news = std::exchange(was_answer_, false);
  std::optional<std::string> message =
      is_turn_of_news ? service_->scene_.News(cursor_) : std::nullopt;
  if (!message) {
    message = Answer();
    was_answer_ = message.has_value();
  }
  if (!message && !is_turn_of_news) message = service_->scene_.News(cursor_);
  if (message) Send(std::move(*message));
}

void ViewerSession::Send(std::string message) {
  ++unacknowledged_;
  connection_->Send(std::move(message), false);
}

}  // namespace oaslam
