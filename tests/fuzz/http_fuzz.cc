#include "connection.h"
#include "fuzz.h"
#include "test_server.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  static const auto service = [] {
    static const TempFolder folder;
    auto made = std::make_shared<TestService>();
    made->handle = [](HttpRequest request, HttpService::Reply reply) {
      HttpAnswer answer;
      answer.body = request.path + request.body;
      for (const auto& [key, value] : request.query) answer.body += key + value;
      reply(std::move(answer));
    };
    made->plan = [](const HttpRequest& head) {
      return HttpService::BodyPlan{1000, head.path == "/file" ? folder / "body" : ""};
    };
    return made;
  }();
  fuzz::Serve(service, fuzz::Text(data, size));
  return 0;
}
