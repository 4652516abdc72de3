#include "view.h"

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "common.h"
#include "dataset_choice.h"
#include "live_view.h"
#include "oaslam/anchors/editing.h"
#include "oaslam/image_source.h"
#include "oaslam/storage/map_edit.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/viewer/saved_run.h"
#include "oaslam/viewer/viewer.h"
#include "recording_choice.h"
#include "server_options.h"

namespace oaslam::apps {
namespace {

struct ViewOptions {
  CommonOptions common;
  std::string path, map, groundtruth;
  std::vector<std::string> images;
  std::vector<std::string> models;
  ServerOptions server{};
  int submap = 0;
};

// The frames of a recording whose pictures are shown, by time in microseconds.
std::map<int64_t, int> FramesWithPictures(const SavedMap& saved, size_t recording) {
  std::set<int> wanted;
  saved.map.keyframes.ForEach(
      [&](KeyframeId, const Keyframe& keyframe) { wanted.insert(keyframe.frame_index); });
  saved.map.objects.ForEach([&](ObjectId, const Object& object) {
    for (const ObjectObservation& o : object.observations) wanted.insert(o.frame_index);
  });
  std::map<int64_t, int> frames;
  const auto add = [&](double timestamp, int frame) {
    if (wanted.contains(frame) && RecordingOf(saved.recordings, frame) == recording)
      frames[std::llround(timestamp * 1e6)] = frame;
  };
  for (const FramePose& pose : saved.trajectory) add(pose.timestamp, pose.frame_index);
  saved.map.keyframes.ForEach(
      [&](KeyframeId, const Keyframe& keyframe) { add(keyframe.timestamp, keyframe.frame_index); });
  return frames;
}

// Reads the images that the map was made of, for the pictures of keyframes and objects.
void ReadPictures(ImageSource& images, const std::map<int64_t, int>& frames, Viewer& viewer,
                  const std::stop_token& stop) {
  constexpr int64_t kSameTime = 100;  // microseconds; files have six digits
  while (!stop.stop_requested()) {
    const std::optional<InputImage> image = images.Next();
    if (!image) return;
    const int64_t time = std::llround(image->timestamp * 1e6);
    const auto frame = frames.lower_bound(time - kSameTime);
    if (frame != frames.end() && frame->first <= time + kSameTime && !image->image.empty())
      viewer.ShowPicture(frame->second, image->image);
  }
}

// Waits for Ctrl-C, TERM or HUP, which are blocked in all threads started
// after the construction.
class EndSignal {
 public:
  EndSignal() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    if (HearsHangUp()) sigaddset(&signals_, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }
  void Wait() const {
    int which = 0;
    sigwait(&signals_, &which);
    pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);  // a second one does not wait
  }

 private:
  sigset_t signals_{};
};

// The map file whose anchors are edited. All its other content is kept.
class AnchorFile {
 public:
  // The file must hold the map that is shown now.
  AnchorFile(std::string path, int submap)
      : path_(std::move(path)), submap_(submap), shown_(StateOfMap(path_)) {}

  // Whether another program has written it since it was read or written here.
  bool HasChanged() const { return stamp_ != StampOfFile(); }

  // Calls `edit` with the anchors of the file as it is now, and with its map, while other programs
  // that edit it wait. Saves the anchors if they have changed; the file is replaced as a whole, so
  // that it is never half new. Returns the map with its anchors. Throws InputError if the file no
  // longer contains the map that is shown, since another program has written it.
  Map Edit(const std::function<void(const Map&, Anchors&)>& edit) {
    constexpr std::chrono::seconds kPatience{10};  // that a viewer has with another program
    const MapLock lock(path_, kPatience);
    stamp_ = StampOfFile();
    const std::optional<MapState> state = StateOfMap(path_);
    if (!state || !shown_ || state->scene != shown_->scene)
      throw BadInput("{}: has changed since it was opened", path_);
    if (!saved_ || state != state_) saved_ = LoadMap(path_);
    state_ = state;
    SavedMap edited = *saved_;  // shares its tables
    LeadWithSubmap(path_, submap_, edited);
    Anchors anchors = edited.map.anchors;
    edit(edited.map, anchors);
    if (anchors == edited.map.anchors) return edited.map;
    edited.map.anchors = std::move(anchors);
    Map shown = edited.map;
    LeadWithSubmap(path_, submap_, edited);
    SaveMap(edited, lock, state);
    saved_ = std::move(edited);
    state_ = StateOfMap(path_);
    if (submap_ != 0) shown_ = state_;  // the anchors are in the part of the submap
    stamp_ = StampOfFile();
    return shown;
  }

 private:
  using Stamp = std::pair<std::filesystem::file_time_type, std::uintmax_t>;

  Stamp StampOfFile() const {
    std::error_code error;
    return {std::filesystem::last_write_time(path_, error),
            std::filesystem::file_size(path_, error)};
  }

  std::string path_;
  int submap_;
  std::optional<MapState> shown_, state_;  // of the file when it was opened, and of `saved_`
  std::optional<SavedMap> saved_;
  Stamp stamp_ = StampOfFile();
};

// Returns why the command cannot be carried out, or an empty text.
std::string CarryOut(const ViewerCommand& command, const Map& map, Anchors& anchors) {
  using Kind = ViewerCommand::Kind;
  if (command.kind == Kind::kPlaceAnchor) return PlaceAnchor(map, command.place, anchors).why_not;
  if (command.kind == Kind::kEditAnchor)
    return EditAnchor(map, command.anchor, command.edit, anchors).why_not;
  return RemoveAnchor(command.anchor, anchors).why_not;
}

// Carries out commands of viewers until it is stopped; commands that come together are written at
// once. What other programs edit in the file is shown, too.
void Obey(AnchorFile file, Viewer& viewer, const std::stop_token& stop) {
  constexpr int kWaitMs = 100, kNoFrame = -1;  // milliseconds between checks for the end
  while (!stop.stop_requested()) {
    const std::vector<ViewerCommand> commands = viewer.TakeCommands(kWaitMs);
    if (commands.empty() && !file.HasChanged()) continue;
    try {
      viewer.UpdateMap(std::make_shared<const Map>(file.Edit([&](const Map& map, Anchors& anchors) {
        for (const ViewerCommand& command : commands)
          if (const std::string problem = CarryOut(command, map, anchors); !problem.empty())
            viewer.ShowEvent(kNoFrame, "anchor", problem);
      })));
    } catch (const std::exception& error) {
      viewer.ShowEvent(kNoFrame, "anchor", error.what());
    }
  }
}

// The images of each recording, null where there are none: those that are given, else where they
// were (`of_run`: those of the last, as its folder names them). They may have changed since: then
// the map is shown without them.
std::vector<std::unique_ptr<ImageSource>> OpenPictures(const ViewOptions& options,
                                                       const MapRecordings& recordings,
                                                       const std::string& of_run,
                                                       const ImageSourceOptions& range) {
  std::vector<std::string> sources(std::max<size_t>(1, recordings.size()));
  const auto chosen = ChosenRecording("", options.images, recordings);
  if (chosen)
    sources[*chosen] = options.images.front();
  else if (!options.images.empty())
    sources = SourcesOf(options.images, recordings);
  else if (recordings.size() > 1)
    for (size_t i = 0; i < sources.size(); ++i) sources[i] = recordings[i].images;
  if (sources.back().empty() && options.images.empty()) sources.back() = of_run;
  std::vector<std::unique_ptr<ImageSource>> images;
  for (const std::string& source : sources) {
    images.emplace_back();
    if (source.empty()) continue;
    try {
      images.back() = OpenImages(source, range);
    } catch (const InputError& problem) {
      if (!options.images.empty()) throw;
      spdlog::warn("{}: shown without pictures", problem.what());
    }
  }
  return images;
}

// The images whose trajectory a ground truth is of; empty: not known.
std::string ImagesOf(const ViewOptions& options, const SavedRun& run) {
  if (!options.images.empty()) return options.images.back();
  if (!run.images.empty() || run.saved.recordings.empty()) return run.images;
  const std::string& images = run.saved.recordings.back().images;
  std::error_code error;
  return std::filesystem::exists(images, error) ? images : "";
}

void View(const ViewOptions& options) {
  std::error_code error;
  if (!std::filesystem::exists(options.path, error))
    throw BadInput("{}: there is no such file or folder", options.path);
  const SavedRun run = LoadSavedRun(options.path, options.map, options.submap);
  const std::vector<StampedPose> groundtruth =
      options.groundtruth.empty()
          ? std::vector<StampedPose>{}
          : LoadGroundtruth(options.groundtruth, options.common, ImagesOf(options, run));
  ImageSourceOptions range = FrameRange(options.common);
  range.color = true;
  const std::vector<std::unique_ptr<ImageSource>> images =
      OpenPictures(options, run.saved.recordings, run.images, range);
  const EndSignal end;
  cv::setNumThreads(1);

  ViewerOptions viewer_options{.server = options.server,
                               .accepts_anchors = !run.map_file.empty(),
                               .models = std::make_shared<const ModelLibrary>(options.models),
                               .names = run.saved.class_names,
                               .align_groundtruth = AlignerOf(groundtruth)};
  Viewer viewer(std::move(viewer_options));
  viewer.ShowMap(std::make_shared<const Map>(run.saved.map), run.saved.trajectory);
  viewer.ShowNotes(run.notes);
  viewer.ShowStatus({.mapping = false, .title = options.path, .recordings = run.saved.recordings});
  if (run.map_file.empty())
    spdlog::warn("{}: no map file in it (--map), so no landmarks", options.path);
  std::jthread reader([&](const std::stop_token& stop) {
    for (size_t i = 0; i < images.size(); ++i)
      if (images[i]) ReadPictures(*images[i], FramesWithPictures(run.saved, i), viewer, stop);
  });
  std::jthread editor;
  if (!run.map_file.empty())
    editor = std::jthread([&](const std::stop_token& stop) {
      Obey(AnchorFile(run.map_file, options.submap), viewer, stop);
    });
  fmt::print("{}\n", viewer.url());
  std::fflush(stdout);
  spdlog::info("open it in a browser; Ctrl-C ends");
  end.Wait();
  reader.request_stop();
  editor.request_stop();
  viewer.Shutdown();
}

}  // namespace

void AddViewCommand(CLI::App& app) {
  auto* command =
      app.add_subcommand("view", "Show a saved map, or the folder of a run, in the browser");
  const auto options = std::make_shared<ViewOptions>();
  command
      ->add_option("path", options->path,
                   "map file, or folder that run, localize or map-objects wrote")
      ->required();
  command->add_option("--map", options->map, "map file that belongs to the folder");
  AddSubmapOption(*command, options->submap);
  AddRepeatable(*command, "--images", options->images,
                "images the map was made of: colours, pictures of keyframes and objects; "
                "repeated for a map of several recordings");
  command->add_option("--groundtruth", options->groundtruth,
                      "TUM trajectory, or the folder of a dataset, to compare with");
  AddModelOption(*command, options->models);
  AddPortOption(*command, options->server);
  AddServerOptions(*command, options->server);
  AddFrameOptions(*command, options->common);
  AddImageOptions(*command, options->common);
  AddQuietOption(*command, options->common);
  command->callback([options] { View(*options); });
}

}  // namespace oaslam::apps
