#include "oaslam/net/request_check.h"

#include <algorithm>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <string_view>

#include "oaslam/net/host_policy.h"
#include "oaslam/util/lower.h"
#include "oaslam/util/printable.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

namespace http = boost::beast::http;

// Decodes a part of a target; in a query, + is a blank. Nothing where it is malformed, or has a
// zero byte.
std::optional<std::string> Decode(std::string text, bool is_query) {
  if (is_query) std::ranges::replace(text, '+', ' ');
  std::optional<std::string> decoded = DecodePercent(text);
  if (decoded && decoded->find('\0') != std::string::npos) return std::nullopt;
  return decoded;
}

// Cuts a target to its path and query. Where it is a whole address (RFC 9112, 3.2.2), the address
// names the host, and the field Host does not count.
void CutAddress(std::string& target, http::fields& fields) {
  const std::string start = Lower(target.substr(0, 8));
  const size_t scheme = start == "https://" ? 8 : start.starts_with("http://") ? 7 : 0;
  if (scheme == 0) return;
  const size_t end = std::min(target.find_first_of("/?#", scheme), target.size());
  fields.set(http::field::host, target.substr(scheme, end - scheme));
  target.erase(0, end);
  if (!target.starts_with('/')) target.insert(0, 1, '/');
}

bool ReadQuery(std::string_view text, std::map<std::string, std::string>& query) {
  while (!text.empty()) {
    const std::string_view pair = text.substr(0, text.find('&'));
    text.remove_prefix(std::min(pair.size() + 1, text.size()));
    if (pair.empty()) continue;
    const size_t equals = pair.find('=');
    const auto key = Decode(std::string(pair.substr(0, equals)), true);
    const auto value =
        Decode(equals == std::string_view::npos ? "" : std::string(pair.substr(equals + 1)), true);
    if (!key || !value) return false;
    query[*key] = *value;
  }
  return true;
}

// From the header Authorization, or for pages, which cannot set it, from the subprotocols of a
// WebSocket.
std::string TokenOf(const http::fields& fields) {
  constexpr std::string_view kBearer = "Bearer ", kSubprotocol = "oaslam.token.";
  const std::string authorization(fields[http::field::authorization]);
  if (authorization.starts_with(kBearer)) return authorization.substr(kBearer.size());
  for (const auto& offered : http::token_list(fields[http::field::sec_websocket_protocol]))
    if (const std::string protocol(offered); protocol.starts_with(kSubprotocol))
      return protocol.substr(kSubprotocol.size());
  return "";
}

// A page is self-contained: it may load nothing from elsewhere, and no other page may frame it.
// Its worker, which is part of it, compiles the odometry.
constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; worker-src blob:; "
    "style-src 'unsafe-inline'; img-src blob: data:; media-src blob:; connect-src 'self' blob: "
    "data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

}  // namespace

std::optional<HttpRequest> RequestOf(const RequestHead& head, const std::string& address,
                                     bool is_local) {
  HttpRequest request;
  request.fields = head.base();
  std::string target(head.target());
  CutAddress(target, request.fields);
  const size_t question = target.find('?');
  auto path = Decode(target.substr(0, question), false);
  if (!path || !path->starts_with('/')) return std::nullopt;
  // A proxy that cuts "/maps" from "/maps/ws", and puts "/" before the rest, doubles the slash.
  path->erase(0, std::min(path->find_first_not_of('/'), path->size()) - 1);
  if (question != std::string::npos &&
      !ReadQuery(std::string_view(target).substr(question + 1), request.query))
    return std::nullopt;
  request.method = head.method();
  request.path = std::move(*path);
  request.caller = {address, is_local};
  return request;
}

std::optional<HttpAnswer> CheckRequest(const ServerCore& core, HttpRequest& request) {
  const std::string host(request.fields[http::field::host]);
  if (!IsAllowedHost(host, core.host_names))
    return TextAnswer(http::status::forbidden,
                      "unknown host name: use an address or localhost (--host allows a name)\n");
  if (!IsAllowedOrigin(std::string(request.fields[http::field::origin]), host))
    return TextAnswer(http::status::forbidden,
                      "foreign origin (a proxy must pass on the header Host as it was)\n");
  if (!core.tokens) {
    request.caller.access = Access::kWrite;
    return std::nullopt;
  }
  request.caller.access = core.tokens->AccessOf(TokenOf(request.fields));
  request.caller.has_token = request.caller.access != Access::kNone;
  if (request.caller.access >= core.service->AccessFor(request)) return std::nullopt;
  if (request.caller.has_token)
    return TextAnswer(http::status::forbidden, "this token is for reading only\n");
  HttpAnswer answer = TextAnswer(http::status::unauthorized, "a token is needed\n");
  answer.fields.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
}

std::optional<HttpAnswer> CheckCoding(const http::fields& fields) {
  const auto is_only = [&](http::field name, boost::beast::string_view coding) {
    return fields.count(name) == 0 ||
           (fields.count(name) == 1 && boost::beast::iequals(fields[name], coding));
  };
  const auto refuse = [&](http::status status, http::field name, const char* instead) {
    return TextAnswer(status, std::string(to_string(name)) + ": " +
                                  Printable(std::string(fields[name])) + " is not accepted, " +
                                  instead + "\n");
  };
  // The end of a body in an unknown coding cannot be found.
  if (!is_only(http::field::transfer_encoding, "chunked"))
    return refuse(http::status::bad_request, http::field::transfer_encoding, "allowed: chunked");
  const bool has_body =
      fields.count(http::field::transfer_encoding) > 0 ||
      (fields.count(http::field::content_length) > 0 && fields[http::field::content_length] != "0");
  if (!has_body || is_only(http::field::content_encoding, "identity")) return std::nullopt;
  HttpAnswer answer = refuse(http::status::unsupported_media_type, http::field::content_encoding,
                             "the body must be sent as it is");
  answer.fields.emplace_back("Accept-Encoding", "identity");
  return answer;
}

HttpAnswer TextAnswer(http::status status, const std::string& text) {
  return {.status = status, .content_type = "text/plain; charset=utf-8", .body = text};
}

void SetFields(const HttpAnswer& answer, http::fields& fields) {
  fields.set(http::field::content_type, answer.content_type);
  fields.set(http::field::cache_control, "no-store");
  fields.set(http::field::x_frame_options, "DENY");
  fields.set("X-Content-Type-Options", "nosniff");
  fields.set("Content-Security-Policy", kContentPolicy);
  fields.set("Referrer-Policy", "no-referrer");
  for (const auto& [name, value] : answer.fields) fields.set(name, value);
}

}  // namespace oaslam
