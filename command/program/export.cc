#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>

#include "commands.h"
#include "common.h"
#include "oaslam/error.h"
#include "oaslam/exports/map_export.h"
#include "recording_choice.h"

namespace oaslam::apps {
namespace {

struct ExportOptions {
  CommonOptions common;
  std::string map, format, out, recording;
  std::vector<std::string> images;
  bool ellipsoids = false;
  int submap = 0;
};

bool IsFolderFormat(const std::string& format) {
  return format == "colmap" || format == "nerfstudio";
}

// Readers recognise a format by the extension.
void CheckExtension(const ExportOptions& options) {
  const std::string extension = std::filesystem::path(options.out).extension().string();
  if (options.format == "gltf" && extension != ".gltf" && extension != ".glb")
    throw InputError(options.out + ": --format gltf asks for a file .gltf (text) or .glb (binary)");
  if (options.format == "ply" && extension != ".ply")
    throw InputError(options.out + ": --format ply asks for a file .ply");
}

// Whether each recording gets a file of its own.
bool IsFolderOfFiles(const ExportOptions& options, const SavedMap& saved) {
  return options.format == "tum" && saved.recordings.size() > 1 &&
         (std::filesystem::is_directory(options.out) ||
          !std::filesystem::path(options.out).has_extension());
}

OutputFolder Check(const ExportOptions& options, const SavedMap& saved) {
  if (!options.images.empty() && !IsFolderFormat(options.format))
    throw InputError("--images is for --format colmap and nerfstudio");
  if (options.ellipsoids && options.format != "ply")
    throw InputError("--ellipsoids is for --format ply; gltf always has them");
  if (IsFolderFormat(options.format) || IsFolderOfFiles(options, saved))
    return OutputFolder(options.out);
  return FolderOfOutputFile(options.out);
}

void Export(const ExportOptions& options) {
  SavedMap saved = LoadSubmap(options.map, options.submap);
  if (saved.map.keyframes.empty()) throw InputError(options.map + ": the map is empty");
  if (const auto chosen = ChosenRecording(options.recording, options.images, saved.recordings))
    saved = OfRecording(saved, *chosen);
  const OutputFolder folder = Check(options, saved);
  CheckExtension(options);
  if (IsFolderFormat(options.format)) {
    ImageSourceOptions range = FrameRange(options.common);
    range.color = true;
    const KeyframeImages images =
        options.images.empty()
            ? ImagesByTime(saved)
            : FindImages(saved, SourcesOf(options.images, saved.recordings), range, options.out);
    if (options.format == "colmap") ExportColmap(options.out, saved, images);
    if (options.format == "nerfstudio") ExportNerfstudio(options.out, saved, images);
  }
  if (options.format == "ply") ExportPly(options.out, saved, options.ellipsoids);
  if (options.format == "gltf") ExportGltf(options.out, saved);
  if (options.format == "tum" && IsFolderOfFiles(options, saved))
    ExportTumFiles(options.out, saved);
  else if (options.format == "tum")
    ExportTum(options.out, saved);
  spdlog::info("{} -> {}", options.map, options.out);
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  auto* command = app.add_subcommand("export", "Write a map for other tools");
  const auto options = std::make_shared<ExportOptions>();
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
