#include <fmt/format.h>

#include <memory>

#include "commands.h"
#include "common.h"
#include "map_out.h"
#include "oaslam/error.h"
#include "oaslam/objects/object_edit.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

struct ObjectsOptions {
  CommonOptions common;
  std::string map, out;
  std::vector<std::string> rename, erase, merge;
};

ObjectId ParseObject(const std::string& text, const std::string& option) {
  return ObjectId(ParseId(text, option, "the id of an object; oaslam objects MAP lists them"));
}

void Edit(const ObjectsOptions& options, const ObjectsConfig& config, Map& map) {
  const auto edit = [&](const std::string& option, const std::string& id,
                        const ObjectEdit& change) {
    try {
      EditObject(map, ParseObject(id, option), change, config);
    } catch (const InputError& error) {
      throw BadInput("{}: {}", option, error.what());
    }
  };
  for (const std::string& text : options.rename) {
    const auto [id, name] = SplitValue(text, '=', text, "--rename ID=NAME");
    edit("--rename " + text, id, {.name = name});
  }
  for (const std::string& text : options.merge) {
    const auto [first, second] = SplitValue(text, ',', text, "--merge ID,ID");
    edit("--merge " + text, first, {.same_as = ParseObject(second, "--merge " + text)});
  }
  for (const std::string& text : options.erase) edit("--delete " + text, text, {.remove = true});
}

void Print(const SavedMap& saved) {
  const char* unit = saved.map.is_metric ? "m" : "units of the map";
  fmt::print("{:>4}  {:<16} {:<16} {:<26} {:<22} {:>6} {:>5}\n", "id", "name", "class", "center",
             "size", "boxes", "IoU");
  saved.map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const std::string category = NameOf(saved.class_names, object.category_id);
    const Eigen::Vector3d c = object.ellipsoid.center, s = 2 * object.ellipsoid.half_axes;
    fmt::print("{:>4}  {:<16} {:<16} {:<26} {:<22} {:>6} {:>5.2f}\n", id.value,
               object.name.empty() ? category : object.name, category,
               fmt::format("{:.3f} {:.3f} {:.3f}", c.x(), c.y(), c.z()),
               fmt::format("{:.3f} {:.3f} {:.3f}", s.x(), s.y(), s.z()), object.total_observations,
               object.mean_iou);
  });
  fmt::print("lengths in {}\n", unit);
}

void Objects(const ObjectsOptions& options) {
  const SlamConfig config = LoadConfiguration(options.common);
  SavedMap edited;
  const auto edit = [&](SavedMap& saved) {
    Edit(options, config.objects, saved.map);
    edited = saved;
  };
  const bool is_edited =
      !options.rename.empty() || !options.erase.empty() || !options.merge.empty();
  EditOrCopy(options.map, options.out, is_edited, edit);
  if (!options.common.quiet) Print(edited);
}

}  // namespace

void AddObjectsCommand(CLI::App& app) {
  auto* command =
      app.add_subcommand("objects", "List the objects of a map; rename, merge and delete them");
  const auto options = std::make_shared<ObjectsOptions>();
  command->add_option("map", options->map, "map file; edited in place unless --out is given")
      ->required();
  AddRepeatable(*command, "--rename", options->rename, "a name of its own; may be repeated")
      ->type_name("ID=NAME");
  AddRepeatable(*command, "--merge", options->merge,
                "one object was mapped twice; the first stays. May be repeated")
      ->type_name("ID,ID");
  AddRepeatable(*command, "--delete", options->erase,
                "forget an object; may be repeated. After renaming and merging")
      ->type_name("ID");
  command->add_option("--out", options->out, "write the edited map to this file instead");
  AddCommonOptions(*command, options->common);
  command->callback([options] { Objects(*options); });
}

}  // namespace oaslam::apps
