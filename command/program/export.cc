#include <spdlog/spdlog.h>

#include <memory>

#include "commands.h"
#include "common.h"
#include "oaslam/error.h"
#include "oaslam/exports/map_export.h"
#include "recording_choice.h"

namespace oaslam::apps {
namespace {

struct ExportArguments {
  CommonOptions common;
  std::string map, format, out, recording;
  std::vector<std::string> images;
  bool ellipsoids = false;
  int submap = 0;
};

OutputFolder Check(const ExportArguments& options, MapFormat format, const SavedMap& saved) {
  const bool has_images = format == MapFormat::kColmap || format == MapFormat::kNerfstudio;
  if (!options.images.empty() && !has_images)
    throw InputError("--images is for --format colmap and nerfstudio");
  if (options.ellipsoids && format != MapFormat::kPly)
    throw InputError("--ellipsoids is for --format ply; gltf always has them");
  return IsFolder(saved, format, options.out) ? OutputFolder(options.out)
                                              : FolderOfOutputFile(options.out);
}

void Export(const ExportArguments& options) {
  SavedMap saved = LoadSubmap(options.map, options.submap);
  if (saved.map.keyframes.empty()) throw InputError(options.map + ": the map is empty");
  if (const auto chosen = ChosenRecording(options.recording, options.images, saved.recordings))
    saved = OfRecording(saved, *chosen);
  const MapFormat format = MapFormatOf(options.format);
  const OutputFolder folder = Check(options, format, saved);
  ExportMap(
      saved, format, options.out,
      {options.ellipsoids, options.images.empty() ? std::vector<std::string>()
                                                  : SourcesOf(options.images, saved.recordings)},
      FrameRange(options.common));
  spdlog::info("{} -> {}", options.map, options.out);
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  auto* command = app.add_subcommand("export", "Write a map for other tools");
  const auto options = std::make_shared<ExportArguments>();
  command->add_option("--map", options->map, "map file")->required();
  AddSubmapOption(*command, options->submap);
  command->add_option("--format", options->format, "ply, gltf, colmap, nerfstudio, tum or mcap")
      ->required()
      ->check(CLI::IsMember({"ply", "gltf", "colmap", "nerfstudio", "tum", "mcap"}));
  command
      ->add_option("--out", options->out,
                   "file; a folder for colmap and nerfstudio. gltf: .gltf (text) or .glb (binary)")
      ->required();
  AddRepeatable(
      *command, "--images", options->images,
      "colmap, nerfstudio: the images of the run (folder, list file, video), found "
      "by time; a video's frames are written to images/. auto: where they were. Repeated for a "
      "map of several recordings, in their order. Without: names are time stamps");
  AddRecordingOption(*command, options->recording);
  command->add_flag("--ellipsoids", options->ellipsoids, "ply: the objects as meshes, too");
  AddFrameOptions(*command, options->common);
  AddImageOptions(*command, options->common);
  AddQuietOption(*command, options->common);
  command->callback([options] { Export(*options); });
}

}  // namespace oaslam::apps
