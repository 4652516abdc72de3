#include <boost/asio/io_context.hpp>
#include <future>

#include "fuzz.h"
#include "oaslam/net/http_service.h"
#include "oaslam/service/localization_service.h"
#include "random_map.h"

namespace oaslam {
namespace {

struct Service {
  TempFolder folder;
  boost::asio::io_context io{1};
  std::shared_ptr<LocalizationService> service;

  Service() {
    Rng rng(3);
    SaveMap(folder / "desk.map", RandomMap({}, rng));
    ServiceOptions options;
    options.store = OpenMapStore(folder.path());
    options.models = std::make_shared<const ModelLibrary>();
    service = std::make_shared<LocalizationService>(std::move(options), io.get_executor());
  }
};

}  // namespace
}  // namespace oaslam

// A request to the service: the first line is the method, the path and the content type, separated
// by blanks; the body follows. Maps are not replaced: their reader has a target of its own.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  static Service& service = *new Service();
  const std::string_view text = fuzz::Text(data, size);
  const std::string_view line = text.substr(0, text.find('\n'));
  if (line.size() == text.size()) return -1;
  const size_t a = line.find(' ');
  const size_t b = a == line.npos ? a : line.find(' ', a + 1);
  if (b == line.npos) return -1;

  HttpRequest request;
  request.method = boost::beast::http::string_to_verb(std::string(line.substr(0, a)));
  const std::string_view target = line.substr(a + 1, b - a - 1);
  request.path = target.substr(0, target.find('?'));
  if (const size_t query = target.find("?since="); query != target.npos)
    request.query["since"] = target.substr(query + 7);
  try {
    request.fields.set(boost::beast::http::field::content_type, std::string(line.substr(b + 1)));
  } catch (const std::exception&) {
    return -1;  // no value of a field
  }
  request.body = text.substr(line.size() + 1);
  request.caller = {"127.0.0.1", true, Access::kWrite, false};
  const HttpService::BodyPlan plan = service.service->PlanBody(request);
  if (!plan.file.empty() || request.body.size() > plan.limit) return -1;
  const bool removes_map = request.method == boost::beast::http::verb::delete_ &&
                           request.path.find("/desk/") == std::string::npos;
  if (removes_map) return -1;

  std::promise<HttpAnswer> answered;
  service.service->Handle(std::move(request),
                          [&](HttpAnswer answer) { answered.set_value(std::move(answer)); });
  const HttpAnswer answer = answered.get_future().get();
  service.io.poll();
  // A defect inside is answered by 500.
  if (answer.status == boost::beast::http::status::internal_server_error) __builtin_trap();
  return 0;
}
