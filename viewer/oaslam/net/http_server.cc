#include "oaslam/net/http_server.h"

#include <fmt/format.h>

#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>

#include "oaslam/net/http_connection.h"
#include "oaslam/net/tls.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

using boost::asio::ip::tcp;

boost::asio::ip::address AddressOf(const ServerOptions& options) {
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(
      options.address == "localhost" ? "127.0.0.1" : options.address, error);
  if (error)
    throw BadInput("--bind {}: expected an address, such as 127.0.0.1, 0.0.0.0 or ::1",
                   options.address);
  return address;
}

}  // namespace

void CheckSafety(const ServerOptions& options) {
  if (options.tls_cert.empty() != options.tls_key.empty())
    throw InputError("--tls-cert and --tls-key: each needs the other");
  if (options.tls_self_signed && !options.tls_cert.empty())
    throw InputError("--tls-self-signed: not together with --tls-cert");
  if (AddressOf(options).is_loopback() || options.insecure) return;
  std::string missing;
  if (options.tls_cert.empty() && !options.tls_self_signed)
    missing = "TLS (--tls-cert and --tls-key, or --tls-self-signed)";
  if (options.token_file.empty())
    missing += std::string(missing.empty() ? "" : " and ") + "tokens (--token-file)";
  if (missing.empty()) return;
  throw BadInput(
      "--bind {}: others than this machine could reach {}, which needs {}; --insecure does "
      "without, for networks that you trust",
      options.address, options.what, missing);
}

void CheckServer(const ServerOptions& options) {
  boost::asio::io_context io;
  HttpServer(io, options, nullptr);
}

class HttpServer::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(boost::asio::io_context& io, const ServerOptions& options,
       std::shared_ptr<HttpService> service)
      : acceptor_(io), timer_(io), core_(std::make_shared<ServerCore>()) {
    if (options.port < 0 || options.port > 65535)
      throw BadInput("port {}: allowed: 0 to 65535", options.port);
    CheckSafety(options);
    core_->options = options;
    core_->service = std::move(service);
    if (!options.token_file.empty()) core_->tokens = Tokens::Load(options.token_file);
    core_->tls = MakeTls(options);
    core_->host_names = options.hosts;
    boost::system::error_code error;
    if (std::string machine = boost::asio::ip::host_name(error); !error && !machine.empty())
      core_->host_names.push_back(std::move(machine));
    Listen();
  }

  int port() const { return acceptor_.local_endpoint().port(); }

  std::string url() const {
    const std::string& address = core_->options.address;
    const bool is_any = address == "0.0.0.0" || address == "::";
    const std::string host = is_any ? "localhost" : address;
    return fmt::format("{}://{}:{}/", core_->tls ? "https" : "http",
                       host.find(':') == std::string::npos ? host : "[" + host + "]", port());
  }

  void Start() {
    if (core_->options.tls_self_signed)
      Log(LogLevel::kInfo,
          "TLS: a certificate for this run, which browsers ask about; its SHA-256 is " +
              FingerprintOf(*core_->tls));
    Accept();
  }

  void Accept() {
    acceptor_.async_accept(
        [self = shared_from_this()](boost::system::error_code error, tcp::socket socket) {
          if (error == boost::asio::error::operation_aborted || !self->acceptor_.is_open()) return;
          if (error) return self->AcceptLater();
          self->Serve(std::move(socket));
          self->Accept();
        });
  }

  void Drain(std::function<void()> done) {
    core_->is_draining = true;
    StopAccepting();
    ForEach([](Connection& connection) { connection.EndSoon(); });
    WaitForEnd(std::chrono::steady_clock::now() + core_->options.farewell, std::move(done));
  }

  void Close() {
    core_->is_draining = true;
    StopAccepting();
    timer_.cancel();
    ForEach([](Connection& connection) { connection.EndNow(); });
  }

 private:
  void Listen() {
    const tcp::endpoint endpoint(AddressOf(core_->options),
                                 static_cast<unsigned short>(core_->options.port));
    boost::system::error_code error;
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(boost::asio::socket_base::max_listen_connections, error);
    if (error)
      throw BadInput(
          "{} cannot listen at {} port {}: {}{}", core_->options.what, core_->options.address,
          core_->options.port, error.message(),
          error == boost::asio::error::address_in_use ? "; port 0 takes one that is free" : "");
  }

  // There are no file descriptors left: closes an idle connection, and accepts again in a moment.
  void AcceptLater() {
    EvictIdle();
    timer_.expires_after(std::chrono::milliseconds(100));
    timer_.async_wait([self = shared_from_this()](boost::system::error_code stopped) {
      if (!stopped) self->Accept();
    });
  }

  // Ends the connection that has waited longest for a request, or else the one that has sent
  // longest at a body, to make place for another one.
  bool EvictIdle() {
    std::list<Connection*>& from = core_->idle.empty() ? core_->receiving : core_->idle;
    if (from.empty()) return false;
    from.front()->EndNow();
    from.splice(from.end(), from, from.begin());
    return true;
  }

  void Serve(tcp::socket socket) {
    constexpr int kMaxRefusals = 512;  // at a time; a flood of more is closed without an answer
    boost::system::error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto most = static_cast<size_t>(core_->options.max_connections);
    if (core_->connections.size() < most || EvictIdle())
      ServeConnection(std::move(socket), core_);
    else if (core_->refusals < kMaxRefusals)
      RefuseConnection(std::move(socket), core_);
  }

  void StopAccepting() {
    boost::system::error_code ignored;
    acceptor_.close(ignored);
  }

  // An act may end its connection, which erases it from the set: hence the copy.
  template <typename Act>
  void ForEach(Act&& act) {
    const std::set<Connection*> connections = core_->connections;
    for (Connection* connection : connections)
      if (core_->connections.contains(connection)) act(*connection);
  }

  void WaitForEnd(std::chrono::steady_clock::time_point limit, std::function<void()> done) {
    if (core_->connections.empty() || std::chrono::steady_clock::now() > limit) {
      Close();
      return done();
    }
    timer_.expires_after(std::chrono::milliseconds(20));
    timer_.async_wait([self = shared_from_this(), limit,
                       done = std::move(done)](boost::system::error_code stopped) mutable {
      if (!stopped) self->WaitForEnd(limit, std::move(done));
    });
  }

  tcp::acceptor acceptor_;
  boost::asio::steady_timer timer_;
  const std::shared_ptr<ServerCore> core_;
};

HttpServer::HttpServer(boost::asio::io_context& io, const ServerOptions& options,
                       std::shared_ptr<HttpService> service)
    : impl_(std::make_shared<Impl>(io, options, std::move(service))) {}
HttpServer::~HttpServer() { impl_->Close(); }

int HttpServer::port() const { return impl_->port(); }
std::string HttpServer::url() const { return impl_->url(); }
void HttpServer::Start() { impl_->Start(); }
void HttpServer::Drain(std::function<void()> done) { impl_->Drain(std::move(done)); }
void HttpServer::Close() { impl_->Close(); }

}  // namespace oaslam
