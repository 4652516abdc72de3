#include "oaslam/service/localize.h"

#include <algorithm>
#include <utility>

#include "oaslam/formats/text.h"
#include "oaslam/service/received_image.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

// A request takes at most as long as this many images, so that it does not keep a worker from
// others for long.
constexpr size_t kMostImages = 16;

Localized Find(const ServedMap& map, const ImageInput& input, const ImageRequest& request,
               RelocalizationMode mode) {
  const cv::Size size = input.image.empty()
                            ? cv::Size(request.camera.camera.width, request.camera.camera.height)
                            : input.image.size();
  const std::optional<Camera> camera = CameraFor(request.camera, size);
  RelocalizationResult found =
      map.localizer.Relocalize(input, {.mode = mode, .prior = request.prior, .camera = camera});
  const std::optional<Camera> of_image = camera ? camera : found.camera;
  return {std::move(found), of_image};
}

std::string TextOf(const HttpRequest& request, const std::string& key) {
  const auto found = request.query.find(key);
  return found == request.query.end() ? "" : found->second;
}

// "x,y,z"
nlohmann::json NumbersOf(const std::string& text) {
  nlohmann::json numbers = nlohmann::json::array();
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const auto number = ParseNumber(std::string_view(text).substr(begin, end - begin));
    if (!number) throw InputError("gravity: \"" + text + "\", expected x,y,z");
    numbers.push_back(*number);
    begin = end + 1;
  }
  return numbers;
}

// What the query of a request with a bare image says, as the JSON of an image.
nlohmann::json ImageOfQuery(const HttpRequest& request) {
  nlohmann::json image = nlohmann::json::object();
  for (const auto& [key, value] : request.query) {
    if (key == "mode") continue;
    if (key == "gravity")
      image[key] = NumbersOf(value);
    else if (key == "camera" && !value.starts_with('{'))
      image[key] = value;
    else if (key == "camera" || key == "detections" || key == "prior")
      image[key] = ParseJson(value, key);
    else
      throw BadInput("query: unknown key \"{}\", known: camera, detections, gravity, mode, prior",
                     key);
  }
  return image;
}

ImageRequest ReadPostedImage(const JsonInput& json) {
  json.Only({"image", "camera", "detections", "gravity", "prior", "time"});
  ImageRequest request = ReadImageRequest(json);
  if (const auto image = json.Find("image"))
    request.bytes = BytesOfImageText(image->Text(), image->place());
  if (request.bytes.empty() && !request.detections)
    json.Refuse("has neither an image nor detections");
  if (request.bytes.empty() && request.camera.camera.width == 0)
    json.Refuse("without an image the camera must be given, with its size");
  return request;
}

}  // namespace

Localized Localize(ServiceState& state, const ServedMap& map, const ImageRequest& request,
                   RelocalizationMode mode) {
  KeepImage(state, map.stored.name, request.bytes);
  ImageInput input = ImageInputOf(request);
  if (!request.bytes.empty()) input.image = DecodeReceivedImage(request.bytes, ImageColor::kGrey);
  Localized found = Find(map, input, request, mode);
  const bool may_detect = !request.detections && !input.image.empty() &&
                          mode != RelocalizationMode::kPoints && !state.detectors.empty();
  if (found.result.world_from_cam || !may_detect) return found;
  input.detections = state.detectors.Detect(DecodeReceivedImage(request.bytes, ImageColor::kBgr));
  if (input.detections.empty()) return found;
  return Find(map, input, request, mode);
}

Json AnswerLocalize(ServiceState& state, const ServedMap& map,
                    const std::vector<ImageRequest>& images, RelocalizationMode mode) {
  const std::shared_ptr<const MapEdits> edits = state.shelf.Edits(map.stored.name);
  Json results = Json::array();
  for (const ImageRequest& image : images) {
    const Stopwatch watch;
    const Localized found = Localize(state, map, image, mode);
    Json json = JsonOf(found.result, found.camera);
    if (found.result.world_from_cam && found.camera)
      json["objects"] =
          JsonOfObjectsInView(map.saved(), *found.camera, *found.result.world_from_cam);
    json["ms"] = watch.WallMs();
    state.metrics.Observe("oaslam_localize_seconds", watch.WallMs() / 1000);
    state.metrics.Count("oaslam_localized_total", {{"evidence", ToString(found.result.evidence)}});
    results.push_back(std::move(json));
  }
  Json anchors = JsonOfAnchors(map, *edits, 0);
  return {{"map", map.stored.name},
          {"digest", map.stored.digest},
          {"results", std::move(results)},
          {"anchors", std::move(anchors["anchors"])}};
}

LocalizeRequest ReadLocalizeRequest(HttpRequest request) {
  LocalizeRequest read;
  const std::string type =
      Lower(std::string(request.fields[boost::beast::http::field::content_type]));
  std::string mode = TextOf(request, "mode");
  // A page that sends what a canvas gives as a text says no more of it.
  const bool is_text_of_image = IsDataUrl(request.body);
  if (type.starts_with("image/jpeg") || type.starts_with("image/png") ||
      (type.starts_with("text/plain") && is_text_of_image)) {
    if (request.body.empty()) throw InputError("body: is empty");
    const nlohmann::json json = ImageOfQuery(request);
    read.images.push_back(ReadImageRequest(JsonInput(json, "query")));
    read.images.back().bytes =
        is_text_of_image ? BytesOfImageText(request.body, "body") : std::move(request.body);
  } else if (type.starts_with("application/json")) {
    const nlohmann::json body = ParseJson(request.body, "body");
    const JsonInput json(body, "body");
    json.Only({"images", "mode"});
    for (const JsonInput& image : json["images"].Items(1, kMostImages))
      read.images.push_back(ReadPostedImage(image));
    if (const auto given = json.Find("mode")) mode = given->Text();
  } else {
    throw BadInput(
        "Content-Type: \"{}\", allowed: image/jpeg, image/png, application/json, and text/plain of "
        "a data: URL",
        type);
  }
  if (!mode.empty()) read.mode = RelocalizationModeOf(mode);
  return read;
}

}  // namespace oaslam
