#include <fmt/format.h>

#include <memory>

#include "commands.h"
#include "common.h"
#include "map_out.h"
#include "metric_scale.h"
#include "oaslam/system/map_merging.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

struct MergeOptions {
  CommonOptions common;
  std::string first, second, out, relocalization = "points+objects";
};

void Merge(const MergeOptions& options) {
  const SlamConfig config = LoadConfiguration(options.common);
  const OutputFolder folder = FolderOfMapFile(options.out, "--out");
  MapOut map_out(options.out);
  const SavedMap first = LoadMap(options.first), second = LoadMap(options.second);
  map_out.BeginsWith(options.first, first.map);
  MapMerging merging =
      MergeMaps(first, second, RelocalizationModeOf(options.relocalization), config);
  if (!merging.merged)
    throw BadInput("{} and {} are not merged: {}", options.first, options.second, merging.evidence);
  map_out.TakeOverEdits(config.objects, merging.merged->map);
  map_out.Save(*merging.merged);
  if (options.common.quiet) return;
  const Map& map = merging.merged->map;
  fmt::print("{}\n{}: {} keyframes, {} landmarks, unit: {}\n", merging.evidence, options.out,
             map.keyframes.size(), map.landmarks.size(), DescribeUnit(map));
}

}  // namespace

void AddMergeCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "merge", "Join two maps made apart into one, where a part of them shows the same place");
  const auto options = std::make_shared<MergeOptions>();
  command
      ->add_option(
          "first", options->first,
          "map file; the result has its frame, and its unit unless only the other is in metres")
      ->required();
  command->add_option("second", options->second, "map file")->required();
  command->add_option("--out", options->out, "map file to write")->required();
  AddRelocalizationOption(*command, options->relocalization,
                          "by what keyframes are found in the other map");
  AddQuietOption(*command, options->common);
  AddConfigOptions(*command, options->common);
  command->callback([options] { Merge(*options); });
}

}  // namespace oaslam::apps
