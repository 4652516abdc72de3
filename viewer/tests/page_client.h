#pragma once

#include <string>

#include "message_reader.h"
#include "test_server.h"
#include "web_socket_client.h"

namespace oaslam {

inline unsigned short PortOf(const std::string& url) {
  return static_cast<unsigned short>(std::stoi(url.substr(url.rfind(':') + 1)));
}

// The whole answer to some bytes, until the connection ends.
inline std::string AnswerTo(const std::string& url, const std::string& bytes) {
  RawClient client(PortOf(url));
  client.Send(bytes);
  return client.ReadAll();
}

// A page of a viewer.
class PageClient : public WebSocketClient {
 public:
  // `url`: of the viewer.
  explicit PageClient(const std::string& url) : WebSocketClient(PortOf(url)) {}
  DecodedMessage Read() { return DecodedMessage(WebSocketClient::Read()); }
  void Acknowledge() { Send(R"({"type":"ack"})"); }
  // The next message of a type; all messages are acknowledged.
  DecodedMessage ReadUntil(const std::string& type) {
    for (;;) {
      DecodedMessage message = Read();
      Acknowledge();
      if (message.header["type"] == type) return message;
    }
  }
};

}  // namespace oaslam
