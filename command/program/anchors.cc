#include <fmt/format.h>

#include <memory>
#include <optional>

#include "commands.h"
#include "common.h"
#include "map_out.h"
#include "oaslam/anchors/editing.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

struct AnchorsOptions {
  std::string map, out;
  std::vector<std::string> place, rename, size, erase;
  bool quiet = false;
};

constexpr const char* kPlaceForm = "NAME=MODEL@object:ID or NAME=MODEL@keyframe:ID:X,Y";

// The ray through a pixel of a keyframe's image, as the camera gave it.
void SetRay(const Map& map, const std::string& at, const std::string& whole,
            AnchorRequest& request) {
  const auto [id, pixel] = SplitValue(at, ':', whole, kPlaceForm);
  const auto [x, y] = SplitValue(pixel, ',', whole, kPlaceForm);
  const std::optional<double> px = ParseNumber(x), py = ParseNumber(y);
  if (!px || !py) throw BadInput("{}: \"{}\" is not a pixel X,Y", whole, pixel);
  const Keyframe* keyframe = map.keyframes.Find(KeyframeId(ParseId(id, whole, "an id")));
  if (!keyframe) throw BadInput("{}: the map has no keyframe {}", whole, id);
  const Camera& camera = map.cameras[keyframe->camera];
  const Rigid3 world_from_cam = keyframe->cam_from_world.Inverse();
  request.origin = world_from_cam.translation;
  request.direction = world_from_cam.rotation * RayOf(camera, Undistort(camera, {*px, *py}));
}

void Place(const std::string& text, Map& map) {
  const auto [name, what] = SplitValue(text, '=', text, kPlaceForm);
  const auto [model, where] = SplitValue(what, '@', text, kPlaceForm);
  const auto [kind, at] = SplitValue(where, ':', text, kPlaceForm);
  AnchorRequest request;
  request.name = name;
  request.model = model;
  if (kind == "object")
    request.object = ObjectId(ParseId(at, text, "an id"));
  else if (kind == "keyframe")
    SetRay(map, at, text, request);
  else
    throw BadInput("{} is not of the form {}", text, kPlaceForm);
  if (const AnchorReport report = PlaceAnchor(map, request, map.anchors); !report.IsDone())
    throw BadInput("{}: {}", text, report.why_not);
}

void Change(const std::string& whole, const std::string& name, const AnchorEdit& edit, Map& map) {
  if (const AnchorReport report = EditAnchor(map, name, edit, map.anchors); !report.IsDone())
    throw BadInput("{}: {}", whole, report.why_not);
}

void Edit(const AnchorsOptions& options, Map& map) {
  for (const std::string& text : options.place) Place(text, map);
  for (const std::string& text : options.size) {
    const auto [name, size] = SplitValue(text, '=', text, "NAME=SIZE");
    const std::optional<double> value = ParseNumber(size);
    if (!value) throw BadInput("{}: \"{}\" is not a number", text, size);
    Change(text, name, {.size = *value}, map);
  }
  for (const std::string& text : options.rename) {
    const auto [name, other] = SplitValue(text, '=', text, "NAME=OTHER");
    Change(text, name, {.name = other}, map);
  }
  for (const std::string& name : options.erase)
    if (map.anchors.erase(name) == 0)
      throw BadInput("--delete {}: there is no anchor of this name", name);
}

void Print(const Map& map) {
  fmt::print("{:<16} {:<12} {:>8}  {:<26} {}\n", "name", "model", "size", "position", "on");
  for (const AnchorPose& a : PosesOf(map)) {
    const Eigen::Vector3d& x = a.world_from_anchor.translation;
    fmt::print("{:<16} {:<12} {:>8.3f}  {:<26} {}\n", a.name, a.model, a.size,
               fmt::format("{:.4f} {:.4f} {:.4f}", x.x(), x.y(), x.z()),
               a.object ? fmt::format("object {}", a.object->value) : "points");
  }
  fmt::print("lengths in {}\n", map.is_metric ? "m" : "units of the map");
}

void EditAnchors(const AnchorsOptions& options) {
  SavedMap edited;
  const auto edit = [&](SavedMap& saved) {
    Edit(options, saved.map);
    edited = saved;
  };
  const bool is_edited = !options.place.empty() || !options.rename.empty() ||
                         !options.size.empty() || !options.erase.empty();
  EditOrCopy(options.map, options.out, is_edited, edit);
  if (!options.quiet) Print(edited.map);
}

}  // namespace

void AddAnchorsCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "anchors", "List the places of virtual content in a map; place, rename and delete them");
  const auto options = std::make_shared<AnchorsOptions>();
  command->add_option("map", options->map, "map file; edited in place unless --out is given")
      ->required();
  AddRepeatable(*command, "--place", options->place,
                "PLACE is object:ID, on top of an object, or keyframe:ID:X,Y, on the surface "
                "seen at a pixel of a keyframe; may be repeated")
      ->type_name("NAME=MODEL@PLACE");
  AddRepeatable(*command, "--size", options->size,
                "of the content's longest side, in units of the map; may be repeated")
      ->type_name("NAME=SIZE");
  AddRepeatable(*command, "--rename", options->rename, "another name for it; may be repeated")
      ->type_name("NAME=OTHER");
  AddRepeatable(*command, "--delete", options->erase, "forget an anchor; may be repeated")
      ->type_name("NAME");
  command->add_option("--out", options->out, "write the edited map to this file instead");
  command->add_flag("--quiet", options->quiet, "print nothing");
  command->callback([options] { EditAnchors(*options); });
}

}  // namespace oaslam::apps
