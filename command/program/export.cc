#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
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

constexpr MapFormat kFormats[] = {MapFormat::kPly, MapFormat::kGltf, MapFormat::kColmap,
                                  MapFormat::kNerfstudio, MapFormat::kTum};

MapFormat FormatOf(const ExportArguments& options) {
  return *std::ranges::find_if(
      kFormats, [&](MapFormat format) { return ToString(format) == options.format; });
}

bool IsFolderFormat(const std::string& format) {
  return format == "colmap" || format == "nerfstudio";
}

// Whether each recording gets a file of its own.
bool IsFolderOfFiles(const ExportArguments& options, const SavedMap& saved) {
  return options.format == "tum" && saved.recordings.size() > 1 &&
         (std::filesystem::is_directory(options.out) ||
          !std::filesystem::path(options.out).has_extension());
}

OutputFolder Check(const ExportArguments& options, const SavedMap& saved) {
  if (!options.images.empty() && !IsFolderFormat(options.format))
    throw InputError("--images is for --format colmap and nerfstudio");
  if (options.ellipsoids && options.format != "ply")
    throw InputError("--ellipsoids is for --format ply; gltf always has them");
  if (IsFolderFormat(options.format) || IsFolderOfFiles(options, saved))
    return OutputFolder(options.out);
  return FolderOfOutputFile(options.out);
}

void Export(const ExportArguments& options) {
  SavedMap saved = LoadSubmap(options.map, options.submap);
  if (saved.map.keyframes.empty()) throw InputError(options.map + ": the map is empty");
  if (const auto chosen = ChosenRecording(options.recording, options.images, saved.recordings))
    saved = OfRecording(saved, *chosen);
  const OutputFolder folder = Check(options, saved);
  ExportMap(
      saved, FormatOf(options), options.out,
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
  command->add_option("--format", options->format, "ply, gltf, colmap, nerfstudio or tum")
      ->required()
      ->check(CLI::IsMember({"ply", "gltf", "colmap", "nerfstudio", "tum"}));
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
