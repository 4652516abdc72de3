#pragma once

#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/http/verb.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace oaslam {

// What a caller may do. Without tokens every caller may write (HttpServer tells when it serves
// without tokens).
enum class Access { kNone, kRead, kWrite };

struct Caller {
  std::string address;    // of the other end, as text
  bool is_local = false;  // on this machine
  Access access = Access::kNone;
  bool has_token = false;  // that the server knows; without tokens every caller may write
};

struct HttpRequest {
  boost::beast::http::verb method = boost::beast::http::verb::get;
  std::string path;                          // decoded, without the query: "/v1/maps"
  std::map<std::string, std::string> query;  // decoded
  boost::beast::http::fields fields;         // of the header
  std::string body;                          // empty where PlanBody named a file
  std::string body_file;                     // that file, which is the service's from then on
  Caller caller;
};

struct HttpAnswer {
  boost::beast::http::status status = boost::beast::http::status::ok;
  std::string content_type = "application/json";
  std::string body{};
  std::string file{};  // path of a file that is sent instead of the body; empty: none
  std::vector<std::pair<std::string, std::string>> fields{};  // further ones of the header
};

// An open WebSocket. To be used on the server's thread only.
class WebSocketConnection {
 public:
  virtual ~WebSocketConnection() = default;
  // Sends one message; the one before must have been written (WebSocketHandler::OnWritten).
  virtual void Send(std::string message, bool is_text) = 0;
  virtual bool IsWriting() const = 0;
  // Closes with a status of RFC 6455, as 1001 (going away) or 1008 (policy).
  virtual void Close(uint16_t status) = 0;
};

// What a service does with one WebSocket. All functions are called on the server's thread.
class WebSocketHandler {
 public:
  virtual ~WebSocketHandler() = default;
  // The largest message that is taken, in bytes; a larger one ends the connection.
  virtual size_t MaxMessage() const = 0;
  virtual void OnOpen(std::shared_ptr<WebSocketConnection> connection) = 0;
  virtual void OnMessage(std::string message, bool is_text) = 0;
  virtual void OnWritten() = 0;
  virtual void OnClosed() = 0;  // the last call
};

class HttpService {
 public:
  using Reply = std::function<void(HttpAnswer)>;  // to be called once, on any thread

  // Where the body of a request goes.
  struct BodyPlan {
    uint64_t limit = 0;  // bytes; a longer body is refused with status 413
    std::string file;    // it is written to this file; empty: it stays in memory
  };

  virtual ~HttpService() = default;
  // What a caller of this request needs; who has less is refused with status 401 or 403. Called
  // before the body is read, as is PlanBody.
  virtual Access AccessFor(const HttpRequest& head) const = 0;
  virtual BodyPlan PlanBody(const HttpRequest& /*head*/) { return {}; }
  // Answers a request. Called on the server's thread, so work is to be done elsewhere.
  virtual void Handle(HttpRequest request, Reply reply) = 0;
  // The handler of a WebSocket that a request asks for; null: there is none at this path.
  virtual std::shared_ptr<WebSocketHandler> Upgrade(const HttpRequest& request) = 0;
};

}  // namespace oaslam
