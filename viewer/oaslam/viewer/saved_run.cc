#include "oaslam/viewer/saved_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

template <int N>
Eigen::Matrix<double, N, 1> VectorOf(const json& entry, const char* key) {
  const json& values = entry.at(key);
  if (!values.is_array() || values.size() != N)
    throw std::invalid_argument(fmt::format("\"{}\" needs {} numbers", key, N));
  Eigen::Matrix<double, N, 1> v;
  for (int i = 0; i < N; ++i) v[i] = values[i].get<double>();
  if (!v.allFinite()) throw std::invalid_argument(fmt::format("\"{}\" is not finite", key));
  return v;
}

void AddObject(const json& entry, SavedMap& saved) {
  Object object;
  object.category_id = entry.at("category_id").get<int>();
  object.name = entry.value("name", "");
  object.state = ObjectState::kMapped;
  const Eigen::Vector4d rotation = VectorOf<4>(entry, "rotation");
  object.ellipsoid = {VectorOf<3>(entry, "center"), VectorOf<3>(entry, "half_axes"),
                      Eigen::Quaterniond(rotation)};
  if (!(object.ellipsoid.half_axes.minCoeff() > 0))
    throw std::invalid_argument("\"half_axes\" must be above 0");
  if (std::abs(rotation.norm() - 1) > 1e-3)
    throw std::invalid_argument("\"rotation\" is no unit quaternion");
  object.total_observations = entry.value("observations", 0);
  if (entry.contains("covariance_diag"))
    object.covariance.diagonal() = VectorOf<7>(entry, "covariance_diag");
  const ObjectId id(entry.at("id").get<uint32_t>());
  if (!id.IsValid() || id.value > 10'000'000 || saved.map.objects.Contains(id))
    throw std::invalid_argument("\"id\" is out of range or used twice");
  saved.map.objects.Insert(id, object);
  saved.class_names[object.category_id] =
      entry.value("category", NameOf(saved.class_names, object.category_id));
}

void AddObjects(const std::string& path, SavedMap& saved) {
  const json list = json::parse(ReadTextFile(path), nullptr, false);
  if (!list.is_array()) throw BadInput("{}: expected a JSON list of objects", path);
  for (size_t i = 0; i < list.size(); ++i) try {
      AddObject(list[i], saved);
    } catch (const std::exception& error) {
      throw BadInput("{}: object {}: {}", path, i, error.what());
    }
}

// The line of frames.csv with this time stamp, or null.
const FrameNote* NoteAt(const std::vector<FrameNote>& notes, double timestamp) {
  constexpr double kSameTime = 1e-4;  // seconds; files have six digits
  const auto note =
      std::ranges::lower_bound(notes, timestamp - kSameTime, {}, &FrameNote::timestamp);
  return note != notes.end() && note->timestamp < timestamp + kSameTime ? &*note : nullptr;
}

// Adds keyframes that have a pose only.
void AddKeyframes(const std::vector<StampedPose>& poses, const std::vector<FrameNote>& notes,
                  Map& map) {
  for (uint32_t i = 0; i < poses.size(); ++i) {
    const FrameNote* note = NoteAt(notes, poses[i].timestamp);
    Keyframe keyframe;
    keyframe.timestamp = poses[i].timestamp;
    keyframe.frame_index = note ? note->frame : static_cast<int>(i);
    keyframe.cam_from_world = poses[i].world_from_cam.Inverse();
    map.keyframes.Insert(KeyframeId(i), std::move(keyframe));
  }
}

// Makes all poses relative to one keyframe, since nothing moves any more.
void SetTrajectory(const std::vector<StampedPose>& poses, const std::vector<FrameNote>& notes,
                   SavedMap& saved) {
  if (poses.empty()) return;
  if (saved.map.keyframes.empty()) AddKeyframes({poses[0]}, notes, saved.map);
  const KeyframeId carrier = saved.map.keyframes.Ids().front();
  const Rigid3 world_from_carrier = saved.map.keyframes.At(carrier).cam_from_world.Inverse();
  saved.trajectory.clear();
  for (size_t i = 0; i < poses.size(); ++i) {
    const FrameNote* note = NoteAt(notes, poses[i].timestamp);
    saved.trajectory.push_back({note ? note->frame : static_cast<int>(i), poses[i].timestamp,
                                carrier, poses[i].world_from_cam.Inverse() * world_from_carrier,
                                note ? note->state : TrackingState::kTracking});
  }
}

std::optional<TrackingState> StateOf(std::string_view word) {
  using enum TrackingState;
  for (const TrackingState state :
       {kInitializing, kTracking, kRelocalized, kObjects, kLost, kOdometry, kPreliminary})
    if (word == ToString(state)) return state;
  // The words that localize writes.
  if (word == "points" || word == "points+objects") return kRelocalized;
  if (word == "followed") return kOdometry;
  if (word == "failed") return kLost;
  return std::nullopt;
}

// frames.csv of run or localize.
std::vector<FrameNote> LoadNotes(const std::string& path) {
  const std::string text = ReadTextFile(path);
  const std::vector<std::string_view> lines = SplitLines(text);
  const std::string_view header = lines.empty() ? std::string_view() : lines[0];
  const std::array places{ColumnOf(header, {"frame"}, path), ColumnOf(header, {"timestamp"}, path),
                          ColumnOf(header, {"inliers", "inlier_points"}, path),
                          ColumnOf(header, {"ms_total", "ms"}, path)};
  constexpr size_t kInliers = 2;  // empty where no landmarks were looked for
  const size_t state_place = ColumnOf(header, {"state", "status"}, path),
               columns = SplitCommas(header).size();
  std::optional<size_t> uncertain;  // not in files of localize and of earlier versions
  if (header.find("uncertain") != header.npos) uncertain = ColumnOf(header, {"uncertain"}, path);
  std::vector<FrameNote> notes;
  for (size_t i = 1; i < lines.size(); ++i) {
    if (Trim(lines[i]).empty()) continue;
    const std::vector<std::string_view> fields = SplitCommas(lines[i]);
    std::array<double, 4> values{};
    for (size_t k = 0; k < places.size(); ++k) {
      const bool is_empty = places[k] < fields.size() && fields[places[k]].empty();
      values[k] = k == kInliers && is_empty ? 0 : NumberAt(fields, places[k], path, i + 1);
    }
    const std::optional<TrackingState> state =
        state_place < fields.size() ? StateOf(fields[state_place]) : std::nullopt;
    const auto is_huge = [](double value) { return std::abs(value) > 1e15; };
    if (fields.size() != columns || !state || values[0] < 0 || values[0] > 1e9 ||
        std::ranges::any_of(values, is_huge))
      throw BadInput("{}:{}: \"{}\" does not fit the columns", path, i + 1, lines[i]);
    notes.push_back({static_cast<int>(values[0]), values[1], *state,
                     static_cast<int>(std::clamp(values[2], 0.0, 1e6)), values[3],
                     uncertain && NumberAt(fields, *uncertain, path, i + 1) != 0});
  }
  return notes;
}

std::string MapFileIn(const std::string& folder) {
  std::vector<std::string> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path extension = entry.path().extension();
    if ((extension == ".map" || extension == ".oaslam") && entry.is_regular_file())
      found.push_back(entry.path().string());
  }
  if (found.size() > 1) {
    std::ranges::sort(found);
    throw BadInput("{}: has {} map files; choose one with --map", folder, found.size());
  }
  return found.empty() ? "" : found[0];
}

// "images" of summary.json; empty where there is none, or nothing is there any more.
std::string ImagesIn(const std::string& summary) {
  std::error_code error;
  const json content = json::parse(ReadTextFile(summary), nullptr, false);
  if (!content.is_object() || !content.contains("images") || !content["images"].is_string())
    return "";
  const std::string images = content["images"].get<std::string>();
  return fs::exists(images, error) ? images : "";
}

}  // namespace

SavedRun LoadSavedRun(const std::string& path, const std::string& map_path, int submap) {
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  const std::string file = !map_path.empty() ? MapFileAt(map_path)
                           : is_folder       ? MapFileIn(path)
                                             : path;
  const auto in_folder = [&](const char* name) {
    return is_folder && fs::exists(fs::path(path) / name) ? (fs::path(path) / name).string() : "";
  };
  SavedRun run;
  if (const std::string summary = in_folder("summary.json"); !summary.empty())
    run.images = ImagesIn(summary);
  if (const std::string notes = in_folder("frames.csv"); !notes.empty())
    run.notes = LoadNotes(notes);
  // The map counts the images that were processed, frames.csv those of the source.
  for (size_t i = 0; i < run.notes.size(); ++i) run.notes[i].frame = static_cast<int>(i);
  std::ranges::stable_sort(run.notes, {}, &FrameNote::timestamp);
  // Written by localize: poses in the map that are not part of it.
  const std::string poses = in_folder("poses.txt");
  const std::string trajectory = poses.empty() ? in_folder("trajectory.txt") : poses;
  run.map_file = file;
  if (!file.empty()) {
    run.saved = LoadSubmap(file, submap);
    // The folder of a run has the notes of its own recording.
    if (poses.empty() && run.saved.recordings.size() > 1)
      for (FrameNote& note : run.notes) note.frame += run.saved.recordings.back().first_frame;
  } else {
    const std::string objects = in_folder("objects.json"), keyframes = in_folder("keyframes.txt");
    if (objects.empty() && trajectory.empty() && keyframes.empty())
      throw BadInput(
          "{}: neither a map file nor objects.json, keyframes.txt, trajectory.txt or "
          "poses.txt lies in it",
          path);
    run.saved.class_names = CocoClassNames();
    Camera camera{.width = 640, .height = 480, .fx = 540, .fy = 540, .cx = 319.5, .cy = 239.5};
    camera.is_guess = true;
    run.saved.map.cameras.push_back(camera);
    if (!objects.empty()) AddObjects(objects, run.saved);
    if (!keyframes.empty()) AddKeyframes(LoadTrajectory(keyframes), run.notes, run.saved.map);
  }
  if (!poses.empty() || (file.empty() && !trajectory.empty()))
    SetTrajectory(LoadTrajectory(trajectory), run.notes, run.saved);
  if (run.notes.empty())
    for (const FramePose& pose : run.saved.trajectory)
      run.notes.push_back({pose.frame_index, pose.timestamp, pose.state, 0, 0});
  std::ranges::stable_sort(run.notes, {}, &FrameNote::frame);
  return run;
}

}  // namespace oaslam
