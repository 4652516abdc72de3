#include "oaslam/service/localization_service.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <utility>

#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/net/gzipped.h"
#include "oaslam/net/request_check.h"
#include "oaslam/service/documents.h"
#include "oaslam/service/localize.h"
#include "oaslam/service/route.h"
#include "oaslam/service/service_state.h"
#include "oaslam/service/stream_session.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using boost::beast::http::field;
using boost::beast::http::status;
using boost::beast::http::verb;

// A problem with a request, and its status.
struct Refusal {
  status code;
  std::string message;
};

HttpAnswer Answer(const Json& json, status code = status::ok) {
  return {.status = code, .body = JsonText(json) + "\n"};
}

HttpAnswer Refuse(status code, const std::string& message) {
  HttpAnswer answer = Answer(JsonOfError(message), code);
  if (code == status::service_unavailable) answer.fields.emplace_back("Retry-After", "1");
  return answer;
}

Json JsonOfStored(const StoredMap& map) {
  return {
      {"name", map.name}, {"digest", map.digest}, {"bytes", map.bytes}, {"changed", map.changed}};
}

// The corners of the box around the landmarks.
Json BoundsOf(const Map& map) {
  Eigen::Vector3d least = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d most = -least;
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    least = least.cwiseMin(landmark.position);
    most = most.cwiseMax(landmark.position);
  });
  if (map.landmarks.empty()) return nullptr;
  return Json::array({JsonOf(least), JsonOf(most)});
}

AnchorRequest ReadAnchorRequest(const JsonInput& json) {
  json.Only({"name", "model", "pose", "size", "origin", "direction", "object"});
  AnchorRequest request;
  if (const auto name = json.Find("name")) {
    request.name = name->Text();
    if (request.name.empty()) name->Refuse("is empty");
  }
  request.model = json["model"].Text();
  if (const auto size = json.Find("size")) request.size = size->Number(1e-6, 1e6);
  if (const auto object = json.Find("object"))
    request.object = ObjectId(static_cast<uint32_t>(object->Integer(0, INT32_MAX)));
  if (const auto pose = json.Find("pose")) {
    request.pose = pose->Pose();
    return request;
  }
  request.origin = json["origin"].Vector();
  request.direction = json["direction"].Vector();
  return request;
}

AnchorEdit ReadAnchorEdit(const JsonInput& json) {
  json.Only({"name", "model", "size", "turn", "pose"});
  AnchorEdit edit;
  if (const auto name = json.Find("name")) edit.name = name->Text();
  if (const auto model = json.Find("model")) edit.model = model->Text();
  if (const auto size = json.Find("size")) edit.size = size->Number();
  if (const auto turn = json.Find("turn")) edit.turn_rad = turn->Number();
  if (const auto pose = json.Find("pose")) edit.pose = pose->Pose();
  return edit;
}

int64_t SinceOf(const HttpRequest& request) {
  const auto found = request.query.find("since");
  if (found == request.query.end()) return 0;
  const std::optional<double> number = ParseNumber(found->second);
  if (!number || !(*number >= 0 && *number < 9e15))
    throw BadInput("since: \"{}\", expected a version", found->second);
  return static_cast<int64_t>(*number);
}

}  // namespace

LocalizationService::BodyPlan LocalizationService::PlanBody(const HttpRequest& head) {
  // Of JSON with an edit; of 16 images of 4 MB; of a map that just fits into the memory that is
  // allowed by default.
  constexpr uint64_t kSmall = 64 << 10, kImages = 64 << 20, kMap = uint64_t{2} << 30;
  const Route route = TargetOf(head.path).route;
  if (route == Route::kLocalize) return {kImages, ""};
  if (route == Route::kMap && head.method == verb::put)
    return {kMap, state_->files->NewPath().string()};
  // A request that only reads has no body.
  if (head.method == verb::get || head.method == verb::head) return {0, ""};
  return {kSmall, ""};
}

// Answers that need neither the store nor a worker.
HttpAnswer LocalizationService::AnswerAtOnce(const Target& target, const HttpRequest& request) {
  switch (target.route) {
    case Route::kHealth:
      return TextAnswer(status::ok, "ok\n");
    case Route::kMetrics:
      return {.content_type = "text/plain; version=0.0.4; charset=utf-8",
              .body = state_->metrics.Text(
                  {{"oaslam_maps_loaded", static_cast<double>(state_->shelf.loaded())},
                   {"oaslam_maps_bytes", static_cast<double>(state_->shelf.bytes())},
                   {"oaslam_waiting_requests", static_cast<double>(state_->workers.waiting())},
                   {"oaslam_workers", static_cast<double>(state_->workers.size())}})};
    case Route::kOpenApi:
      return GzippedAnswer(request, OpenApi(), "application/json");
    case Route::kCamera:
      return GzippedAnswer(request, CameraPage(), "text/html; charset=utf-8");
    case Route::kOdometry:
      return GzippedAnswer(request, OdometryModule(), "application/wasm");
    case Route::kModel:
      return AnswerModel(target.rest);
    default:
      return Refuse(status::not_found, "there is nothing at this path");
  }
}

HttpAnswer LocalizationService::AnswerModel(const std::string& path) {
  const auto found = state_->options.models->Find(path);
  if (!found) return Refuse(status::not_found, "there is no such model");
  return {
      .content_type = found->content_type, .body = std::string(found->bytes), .file = found->path};
}

std::shared_ptr<const ServedMap> LocalizationService::MapOf(const Target& target) {
  auto map = state_->shelf.Get(target.map);
  if (!map) throw Refusal{status::not_found, fmt::format("there is no map \"{}\"", target.map)};
  return map;
}

HttpAnswer LocalizationService::DescribeMap(const ServedMap& map) {
  const Map& content = map.saved().map;
  const auto edits = state_->shelf.Edits(map.stored.name);
  Json json = JsonOfStored(map.stored);
  json["keyframes"] = content.keyframes.size();
  json["landmarks"] = content.landmarks.size();
  json["objects"] = JsonOfObjects(map.saved());
  json["anchors"] = JsonOfAnchors(map, *edits, 0)["anchors"];
  json["bounds"] = BoundsOf(content);
  json["up"] = content.up ? JsonOf(*content.up) : Json();
  json["is_metric"] = content.is_metric;
  json["unit_sigma"] = map.localizer.map().unit_sigma();
  return Answer(json);
}

HttpAnswer LocalizationService::PutMap(const std::string& name, const std::string& file) {
  state_->shelf.store().CheckNew(name);
  if (fs::file_size(file) == 0) throw InputError("body: is empty");
  try {
    const size_t bytes = BytesInMemory(LoadMap(file)), most = state_->shelf.memory_bytes();
    if (bytes > most)
      throw Refusal{status::payload_too_large,
                    fmt::format("the map takes {} MB of memory, allowed by --memory: {}",
                                bytes >> 20, most >> 20)};
  } catch (const InputError& error) {
    std::string message = error.what();  // without the path, which is of no use to the client
    if (message.starts_with(file)) message = "body" + message.substr(file.size());
    throw InputError(message);
  }
  const bool is_new = !state_->shelf.store().Find(name);
  const StoredMap stored = state_->shelf.store().Put(name, file);
  state_->shelf.Refresh(name);
  return Answer(JsonOfStored(stored), is_new ? status::created : status::ok);
}

HttpAnswer LocalizationService::AnswerAnchor(const ServedMap& map, const AnchorOutcome& outcome) {
  const auto code = static_cast<status>(outcome.status);
  if (!outcome.problem.empty()) return Refuse(code, outcome.problem);
  const Json all = JsonOfAnchors(map, *state_->shelf.Edits(map.stored.name), 0);
  for (const Json& anchor : all["anchors"])
    if (anchor["name"] == outcome.name) return Answer(anchor, code);
  return Answer({{"name", outcome.name}}, code);  // it was removed, perhaps by another meanwhile
}

HttpAnswer LocalizationService::Do(const Target& target, HttpRequest& request) {
  ServiceState& state = *state_;
  switch (target.route) {
    case Route::kMaps: {
      Json maps = Json::array();
      for (const StoredMap& map : state.shelf.store().Maps()) maps.push_back(JsonOfStored(map));
      return Answer({{"maps", std::move(maps)}});
    }
    case Route::kMap:
      if (request.method == verb::put) return PutMap(target.map, request.body_file);
      if (request.method == verb::delete_) {
        if (!state.shelf.store().Remove(target.map)) MapOf(target);
        state.shelf.Refresh(target.map);
        return Answer({{"removed", true}});
      }
      return DescribeMap(*MapOf(target));
    case Route::kLocalize: {
      const auto map = MapOf(target);
      const LocalizeRequest read = ReadLocalizeRequest(std::move(request));
      return Answer(AnswerLocalize(state, *map, read.images, read.mode));
    }
    case Route::kAnchors: {
      const auto map = MapOf(target);
      if (request.method != verb::post)
        return Answer(JsonOfAnchors(*map, *state.shelf.Edits(target.map), SinceOf(request)));
      const nlohmann::json body = ParseJson(request.body, "body");
      return AnswerAnchor(*map,
                          PlaceAnchor(state, *map, ReadAnchorRequest(JsonInput(body, "body"))));
    }
    case Route::kAnchor: {
      const auto map = MapOf(target);
      if (request.method == verb::delete_)
        return AnswerAnchor(*map, RemoveAnchor(state, *map, target.rest));
      const nlohmann::json body = ParseJson(request.body, "body");
      return AnswerAnchor(
          *map, ChangeAnchor(state, *map, target.rest, ReadAnchorEdit(JsonInput(body, "body"))));
    }
    case Route::kTrack:
    case Route::kRecord:
      return Refuse(status::upgrade_required, "this path is of a WebSocket");
    default:
      return AnswerAtOnce(target, request);
  }
}

// On a worker: every problem becomes an answer.
HttpAnswer LocalizationService::Work(const Target& target, HttpRequest& request) {
  try {
    return Do(target, request);
  } catch (const Refusal& refusal) {
    return Refuse(refusal.code, refusal.message);
  } catch (const BrokenMap& error) {
    return Refuse(status::internal_server_error, error.what());
  } catch (const InputError& error) {
    return Refuse(status::bad_request, error.what());
  } catch (const StoreUnavailable& error) {
    return Refuse(status::service_unavailable, error.what());
  } catch (const std::bad_alloc&) {
    return Refuse(status::service_unavailable, "out of memory");
  } catch (const std::exception& error) {
    Log(LogLevel::kWarning, "{}: {}", request.path, error.what());
    return Refuse(status::internal_server_error, "internal error");
  }
}

void LocalizationService::Handle(HttpRequest request, Reply reply) {
  const Target target = TargetOf(request.path);
  const auto finish = [state = state_, target](const Reply& to, HttpAnswer answer) {
    state->metrics.Count("oaslam_requests_total",
                         {{"route", NameOf(target.route)},
                          {"status", std::to_string(static_cast<int>(answer.status))}});
    to(std::move(answer));
  };
  if (target.route != Route::kNowhere && !Allows(target.route, request.method)) {
    HttpAnswer answer = Refuse(status::method_not_allowed, "allowed: " + MethodsOf(target.route));
    answer.fields.emplace_back("Allow", MethodsOf(target.route));
    return finish(reply, std::move(answer));
  }
  if (target.map.empty() && target.route != Route::kMaps)
    return finish(reply, AnswerAtOnce(target, request));
  const auto kept = std::make_shared<HttpRequest>(std::move(request));
  const auto remove_body = [kept] {
    std::error_code ignored;
    if (!kept->body_file.empty()) fs::remove(kept->body_file, ignored);
  };
  const bool is_added = state_->workers.TryAdd([this, target, kept, remove_body, reply, finish] {
    HttpAnswer answer = Work(target, *kept);
    remove_body();
    finish(reply, std::move(answer));
  });
  if (is_added) return;
  remove_body();
  finish(reply, Refuse(status::service_unavailable, "too many requests wait"));
}

std::shared_ptr<WebSocketHandler> LocalizationService::Upgrade(const HttpRequest& request) {
  const Target target = TargetOf(request.path);
  const bool may_write = request.caller.access == Access::kWrite;
  if (target.route == Route::kTrack)
    return std::make_shared<StreamSession>(state_, target.map,
                                           TrackWork(state_, target.map, may_write));
  if (target.route == Route::kRecord)
    return std::make_shared<StreamSession>(state_, target.map, RecordWork(state_, target.map));
  return nullptr;
}

LocalizationService::LocalizationService(ServiceOptions options,
                                         boost::asio::any_io_executor executor)
    : state_(std::make_shared<ServiceState>(std::move(options), std::move(executor))) {}

void LocalizationService::Finish() { state_->workers.Finish(); }

Access LocalizationService::AccessFor(const HttpRequest& head) const {
  return AccessOf(TargetOf(head.path).route, head.method);
}

}  // namespace oaslam
