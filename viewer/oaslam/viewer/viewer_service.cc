#include "oaslam/viewer/viewer_service.h"

#include <algorithm>
#include <string_view>

#include "oaslam/net/gzipped.h"
#include "oaslam/net/request_check.h"
#include "oaslam/viewer/page.h"
#include "oaslam/viewer/viewer_session.h"

namespace oaslam {
namespace {

namespace http = boost::beast::http;

constexpr std::string_view kModels = "/models/";

// Where there are no tokens, only pages on this machine may change anything.
bool MayCommand(const Caller& caller) {
  return caller.has_token ? caller.access == Access::kWrite : caller.is_local;
}

}  // namespace

Access ViewerService::AccessFor(const HttpRequest& head) const {
  return head.path == "/" ? Access::kNone : Access::kRead;
}

void ViewerService::Handle(HttpRequest request, Reply reply) {
  if (request.method != http::verb::get && request.method != http::verb::head)
    return reply(TextAnswer(http::status::method_not_allowed, "only GET and HEAD\n"));
  if (request.path.starts_with(kModels))
    return reply(AnswerModel(request.path.substr(kModels.size())));
  if (request.path != "/") return reply(TextAnswer(http::status::not_found, "not found\n"));
  reply(GzippedAnswer(request, ViewerPage(), "text/html; charset=utf-8"));
}

// A file of a model of virtual content, or one that it refers to.
HttpAnswer ViewerService::AnswerModel(const std::string& path) const {
  const auto found = options_.models ? options_.models->Find(path) : std::nullopt;
  if (!found) return TextAnswer(http::status::not_found, "not found\n");
  return {
      .content_type = found->content_type, .body = std::string(found->bytes), .file = found->path};
}

std::shared_ptr<WebSocketHandler> ViewerService::Upgrade(const HttpRequest& request) {
  if (request.path != "/ws") return nullptr;
  const bool may_command = MayCommand(request.caller);
  return std::make_shared<ViewerSession>(shared_from_this(),
                                         options_.accepts_commands && may_command,
                                         options_.accepts_anchors && may_command);
}

void ViewerService::Broadcast() {
  for (ViewerSession* viewer : viewers_) viewer->SendNews();
}

bool ViewerService::AllHaveFollowed() const {
  return std::ranges::all_of(viewers_,
                             [](const ViewerSession* viewer) { return viewer->HasFollowed(); });
}

}  // namespace oaslam
