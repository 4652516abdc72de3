#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "oaslam/net/http_service.h"

namespace oaslam {

struct ServerOptions {
  std::string address = "127.0.0.1";
  int port = 0;  // 0: any that is free
  // PEM files of a certificate with its chain and its key; or a certificate that is made for this
  // run.
  std::string tls_cert{}, tls_key{};
  bool tls_self_signed = false;
  std::string token_file{};          // empty: every caller may write
  bool insecure = false;             // beyond this machine also without TLS or tokens
  std::vector<std::string> hosts{};  // names by which it may be called, besides that of the machine
  std::string what = "the viewer";   // that listens, for messages

  int max_connections = 2048;
  // Memory for the bodies of all requests together; one for which none is left is answered 503.
  uint64_t max_body_bytes = uint64_t{512} << 20;
  // Limits of time: for a TLS handshake or the header of a request, and between two requests; for a
  // body or an answer it is longer by what these take at the least rate, in bytes a second. Who
  // needs more is given up without an answer.
  std::chrono::milliseconds patience{30'000};
  uint64_t least_rate = 16 * 1024;
  std::chrono::milliseconds farewell{10'000};  // for requests in flight, when it ends
};

// Throws InputError, which says what to add, for options that would let others than this machine
// reach the server without TLS and tokens, unless `insecure`; and for half of a pair of TLS files.
void CheckSafety(const ServerOptions& options);

// Throws InputError where an HttpServer with these options could not start, without serving.
void CheckServer(const ServerOptions& options);

// Serves one HttpService over HTTP/1.1 and WebSocket (Boost.Beast), or over TLS 1.2 and later. All
// runs on the one thread that runs the io_context. It answers only requests whose Host is this
// machine's or one of `hosts`, and whose Origin, if there is one, is the same; by itself it answers
// 400, 401, 403, 404, 413, 431, 500 and 503.
class HttpServer {
 public:
  // Listens at once. Throws InputError where the address does not belong to this machine, the port
  // is in use, a file cannot be used, or the options are not safe (CheckSafety).
  HttpServer(boost::asio::io_context& io, const ServerOptions& options,
             std::shared_ptr<HttpService> service);
  ~HttpServer();

  int port() const;
  std::string url() const;  // "https://127.0.0.1:8340/"
  void Start();
  // Takes no more connections or requests, answers those in flight, closes WebSockets (1001), and
  // then calls `done`, at the latest after `farewell`.
  void Drain(std::function<void()> done);
  // Ends all connections at once.
  void Close();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace oaslam
