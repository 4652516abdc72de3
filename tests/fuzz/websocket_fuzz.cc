#include "connection.h"
#include "fuzz.h"
#include "test_server.h"

namespace oaslam {
namespace {

// Sends back what comes, one message at a time.
class Echo : public WebSocketHandler {
 public:
  size_t MaxMessage() const override { return 4096; }
  void OnOpen(std::shared_ptr<WebSocketConnection> connection) override {
    connection_ = std::move(connection);
  }
  void OnMessage(std::string message, bool is_text) override {
    if (connection_ && !connection_->IsWriting()) connection_->Send(std::move(message), is_text);
  }
  void OnWritten() override {}
  void OnClosed() override { connection_.reset(); }

 private:
  std::shared_ptr<WebSocketConnection> connection_;
};

}  // namespace
}  // namespace oaslam

// The bytes are the frames that a client sends once the connection is a WebSocket.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  static const auto service = [] {
    auto made = std::make_shared<TestService>();
    made->upgrade = [] { return std::make_shared<Echo>(); };
    return made;
  }();
  const std::string head =
      "GET /ws HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n";
  fuzz::Serve(service, head + std::string(fuzz::Text(data, size)));
  return 0;
}
