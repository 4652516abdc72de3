#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include "oaslam/formats/unfinished_file.h"
#include "oaslam/map/repair.h"
#include "oaslam/storage/map_edit.h"
#include "oaslam/storage/map_part.h"
#include "oaslam/storage/map_schema.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// How the name of a file ends that is not complete (UnfinishedFile).
constexpr std::string_view kTemporary = ".tmp";

static_assert(std::endian::native == std::endian::little,
              "blobs of the map file are little-endian");

template <typename T>
std::span<const std::byte> BytesOf(const T* data, size_t count) {
  return std::as_bytes(std::span(data, count));
}

void WriteMeta(SQLite::Database& database, Checksum& checksum, const Map& map) {
  RowWriter meta(database, checksum, "meta", 2);
  // In the order of the keys, in which they are read.
  meta.Write("map_version", static_cast<int64_t>(map.version));
  if (!map.classes.movable.empty())
    meta.Write("movable", fmt::format("{}", fmt::join(map.classes.movable, " ")));
  meta.Write("next_landmark", map.next_landmark);
  std::vector<std::string> parts;
  for (const auto& [part, whole] : map.classes.whole_of)
    parts.push_back(fmt::format("{}:{}", part, whole));
  if (!parts.empty()) meta.Write("parts", fmt::format("{}", fmt::join(parts, " ")));
  if (map.is_metric) meta.Write("unit", "metre");
  if (map.is_metric && map.unit_evidence) {
    const UnitEvidence& by = *map.unit_evidence;
    const bool is_by_objects = by.source == UnitSource::kObjects;
    if (is_by_objects) {
      meta.Write("unit_classes", by.classes);
      meta.Write("unit_objects", by.objects);
    } else {
      meta.Write("unit_sensor", by.source == UnitSource::kImu ? "imu" : "depth");
    }
    meta.Write("unit_sigma", by.relative_sigma);
  }
  if (map.up) {
    if (map.up_keyframes > 0) meta.Write("up_keyframes", map.up_keyframes);
    meta.Write("up_x", map.up->x());
    meta.Write("up_y", map.up->y());
    meta.Write("up_z", map.up->z());
  }
}

void WriteCameras(SQLite::Database& database, Checksum& checksum, const Map& map) {
  RowWriter rows(database, checksum, "cameras", 15);
  for (size_t i = 0; i < map.cameras.size(); ++i) {
    const Camera& c = map.cameras[i];
    const auto& k = c.distortion;
    rows.Write(static_cast<int>(i), c.name, ToString(c.model), c.width, c.height, c.fx, c.fy, c.cx,
               c.cy, k[0], k[1], k[2], k[3], k[4], static_cast<int>(c.is_guess));
  }
}

void WriteKeyframes(SQLite::Database& database, Checksum& checksum, std::span<const KeyframeId> ids,
                    const Map& map) {
  RowWriter keyframes(database, checksum, "keyframes", 11);
  for (const KeyframeId id : ids) {
    const Keyframe& k = map.keyframes.At(id);
    keyframes.Write(id, k.frame_index, k.timestamp, k.camera, k.cam_from_world);
  }
  // Before the features, of which they are a part when they are read.
  RowWriter learned(database, checksum, "learned_descriptors", 5);
  for (const KeyframeId id : ids)
    if (const LearnedDescriptors& d = map.keyframes.At(id).features->learned; !d.empty())
      learned.Write(id, static_cast<int>(d.keypoints.size()),
                    BytesOf(d.keypoints.data(), d.keypoints.size()),
                    BytesOf(d.descriptors.data(), d.descriptors.size()),
                    BytesOf(map.keyframes.At(id).learned_depths.data(), d.keypoints.size()));
  RowWriter features(database, checksum, "features", 11);
  for (const KeyframeId id : ids) {
    const Features& f = *map.keyframes.At(id).features;
    std::vector<StoredKeypoint> keypoints;
    keypoints.reserve(f.keypoints.size());
    for (const Keypoint& k : f.keypoints)
      keypoints.push_back({k.px.x(), k.px.y(), k.angle_rad, k.octave});
    features.Write(id, f.size(), f.pyramid.levels, static_cast<double>(f.pyramid.factor),
                   BytesOf(f.pyramid.scale.data(), f.pyramid.levels), f.bounds,
                   BytesOf(keypoints.data(), keypoints.size()),
                   BytesOf(f.descriptors.data(), f.descriptors.size()));
  }
  RowWriter covisibility(database, checksum, "covisibility", 4);
  for (const KeyframeId id : ids) {
    int rank = 0;
    for (const Covisible& c : map.keyframes.At(id).covisible)
      covisibility.Write(id, rank++, c.keyframe, c.shared);
  }
}

void WriteRetiredKeyframes(SQLite::Database& database, Checksum& checksum, const Map& map) {
  RowWriter retired(database, checksum, "retired_keyframes", 9);
  map.retired.ForEach([&](KeyframeId id, const RetiredKeyframe& r) {
    retired.Write(id, r.parent, r.cam_from_parent);
  });
}

void WriteLandmarks(SQLite::Database& database, Checksum& checksum, std::span<const LandmarkId> ids,
                    const Map& map) {
  RowWriter landmarks(database, checksum, "landmarks", 13);
  for (const LandmarkId id : ids) {
    const Landmark& l = map.landmarks.At(id);
    landmarks.Write(id, l.position, l.normal, static_cast<double>(l.min_distance),
                    static_cast<double>(l.max_distance), l.first_keyframe, l.visible, l.found,
                    BytesOf(l.descriptor.data(), l.descriptor.size()));
  }
  RowWriter observations(database, checksum, "observations", 3);
  for (const LandmarkId id : ids)
    for (const Observation& o : map.landmarks.At(id).observations)
      observations.Write(id, o.keyframe, o.keypoint);
}

void WriteObjects(SQLite::Database& database, Checksum& checksum, const Map& map) {
  RowWriter objects(database, checksum, "objects", 19);
  map.objects.ForEach([&](ObjectId id, const Object& o) {
    objects.Write(id, o.category_id, ToString(o.state), o.ellipsoid.center, o.ellipsoid.half_axes,
                  o.ellipsoid.rotation,
                  BytesOf(o.covariance.data(), static_cast<size_t>(o.covariance.size())),
                  o.detection_rate, o.mean_iou, o.total_observations, o.last_seen_frame,
                  std::string_view(o.name));
  });
  RowWriter labels(database, checksum, "object_labels", 3);
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    for (const LabelShare& label : object.shares) labels.Write(id, label.category_id, label.share);
  });
  RowWriter observations(database, checksum, "object_observations", 18);
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    int rank = 0;
    for (const ObjectObservation& o : object.observations)
      observations.Write(id, rank++, o.frame_index, o.reference, o.cam_from_reference, o.camera,
                         o.box, o.score, static_cast<int>(o.truncated));
  });
  RowWriter landmarks(database, checksum, "object_landmarks", 3);
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    for (size_t i = 0; i < object.landmarks.size(); ++i)
      landmarks.Write(id, object.landmarks[i], static_cast<int>(object.landmark_votes[i]));
  });
  RowWriter merged(database, checksum, "merged_objects", 2);
  map.merged_objects.ForEach([&](ObjectId id, const ObjectId& into) { merged.Write(id, into); });
}

void WriteAnchors(SQLite::Database& database, Checksum& checksum, const Map& map) {
  RowWriter rows(database, checksum, "anchors", 15);
  for (const auto& [name, a] : map.anchors)
    rows.Write(std::string_view(name), std::string_view(a.model), a.size, a.keyframe,
               a.cam_from_anchor, a.object, a.offset);
}

void WriteTrajectory(SQLite::Database& database, Checksum& checksum,
                     const std::vector<FramePose>& trajectory) {
  RowWriter rows(database, checksum, "trajectory", 12);
  int rank = 0;
  for (const FramePose& p : trajectory)
    rows.Write(rank++, p.frame_index, p.timestamp, p.reference, p.cam_from_reference,
               ToString(p.state));
}

void WriteRecordings(SQLite::Database& database, Checksum& checksum,
                     const MapRecordings& recordings) {
  RowWriter rows(database, checksum, "recordings", 4);
  int number = 0;
  for (const MapRecording& r : recordings)
    rows.Write(++number, std::string_view(r.name), std::string_view(r.images), r.first_frame);
}

void WriteClassNames(SQLite::Database& database, Checksum& checksum, const ClassNames& names) {
  RowWriter rows(database, checksum, "class_names", 2);
  for (const auto& [id, name] : names) rows.Write(id, name);
}

void WriteContent(const SavedMap& saved, SQLite::Database& database);

// A submap is stored as a map file of its own.
void WriteSubmap(SQLite::Database& database, Checksum& checksum, uint32_t number,
                 const Submap& submap) {
  SQLite::Database in_memory(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_NOMUTEX);
  WriteContent({submap.map, submap.trajectory, {}}, in_memory);
  sqlite3_int64 size = 0;
  const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> content(
      sqlite3_serialize(in_memory.getHandle(), "main", &size, 0), &sqlite3_free);
  if (!content) throw SQLite::Exception("a submap is too large for the memory");
  RowWriter rows(database, checksum, "pieces", 2);
  rows.Write(number, BytesOf(content.get(), static_cast<size_t>(size)));
}

std::vector<MapPart> WriteParts(const SavedMap& saved, SQLite::Database& database) {
  const Map& map = saved.map;
  std::vector<MapPart> parts;
  // Calls write(checksum), which writes the rows of a part.
  const auto add = [&](const char* name, IdRange ids, auto&& write) {
    Checksum checksum;
    write(checksum);
    parts.push_back({name, ids, checksum.Hex()});
  };
  // Calls write(checksum, ids) for each `count` of the ids in turn.
  const auto add_blocks = [&](const char* name, const auto& all, size_t count, auto&& write) {
    for (size_t begin = 0; begin < all.size(); begin += count) {
      const auto ids = std::span(all).subspan(begin, std::min(count, all.size() - begin));
      add(name, {ids.front().value, ids.back().value},
          [&](Checksum& checksum) { write(checksum, ids); });
    }
  };
  add("cameras", {}, [&](Checksum& checksum) { WriteCameras(database, checksum, map); });
  add_blocks("keyframes", map.keyframes.Ids(), kKeyframesOfAPart,
             [&](Checksum& checksum, std::span<const KeyframeId> ids) {
               WriteKeyframes(database, checksum, ids, map);
             });
  add("retired_keyframes", {},
      [&](Checksum& checksum) { WriteRetiredKeyframes(database, checksum, map); });
  add_blocks("landmarks", map.landmarks.Ids(), kLandmarksOfAPart,
             [&](Checksum& checksum, std::span<const LandmarkId> ids) {
               WriteLandmarks(database, checksum, ids, map);
             });
  add("objects", {}, [&](Checksum& checksum) { WriteObjects(database, checksum, map); });
  add("trajectory", {},
      [&](Checksum& checksum) { WriteTrajectory(database, checksum, saved.trajectory); });
  add("recordings", {},
      [&](Checksum& checksum) { WriteRecordings(database, checksum, saved.recordings); });
  add("class_names", {},
      [&](Checksum& checksum) { WriteClassNames(database, checksum, saved.class_names); });
  add("anchors", {}, [&](Checksum& checksum) { WriteAnchors(database, checksum, map); });
  for (uint32_t number = 1; number <= saved.submaps.size(); ++number)
    add("pieces", {number, number}, [&](Checksum& checksum) {
      WriteSubmap(database, checksum, number, saved.submaps[number - 1]);
    });
  return parts;
}

// Writes the settings and the list of parts, with the checksum of both.
void WriteHead(SQLite::Database& database, const Map& map, std::vector<MapPart> parts) {
  Checksum checksum;
  WriteMeta(database, checksum, map);
  // In the order in which they are read.
  std::ranges::sort(parts, {}, [](const MapPart& p) { return std::tie(p.name, p.ids.first); });
  RowWriter rows(database, checksum, "parts", 4);
  for (const MapPart& part : parts)
    rows.Write(std::string_view(part.name), part.ids.first, part.ids.last,
               std::string_view(part.checksum));
  database.exec(fmt::format("INSERT INTO meta VALUES('checksum', '{}')", checksum.Hex()));
}

void WriteContent(const SavedMap& saved, SQLite::Database& database) {
  // The file is synced and renamed when complete, so that it needs no journal.
  database.exec(
      fmt::format("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA application_id={}; "
                  "PRAGMA user_version={};",
                  kMapApplicationId, kMapFormatVersion));
  database.exec("BEGIN");
  database.exec(kMapSchema);
  WriteHead(database, saved.map, WriteParts(saved, database));
  database.exec("COMMIT");
}

void SyncToDisk(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = file >= 0 && fsync(file) == 0;
  if (file >= 0) close(file);
  if (!synced) throw BadInput("{}: cannot be written to disk", path);
}

bool HasPose(const FramePose& frame) { return frame.cam_from_reference.IsValid(); }

void AddProblems(const Map& map, const std::vector<FramePose>& trajectory,
                 std::vector<std::string>& problems) {
  for (std::string& problem : map.CheckInvariants()) problems.push_back(std::move(problem));
  for (const FramePose& frame : trajectory)
    if (!HasPose(frame))
      problems.push_back(fmt::format(
          "frame {}: pose not finite, or its rotation no unit quaternion", frame.frame_index));
}

std::vector<std::string> ProblemsOf(const SavedMap& saved) {
  std::vector<std::string> problems;
  AddProblems(saved.map, saved.trajectory, problems);
  for (const Submap& submap : saved.submaps) AddProblems(submap.map, submap.trajectory, problems);
  return problems;
}

void Repair(Map& map, std::vector<FramePose>& trajectory) {
  map = Repaired(map);
  std::erase_if(trajectory, std::not_fn(HasPose));
}

SavedMap WithoutProblems(SavedMap saved) {
  Repair(saved.map, saved.trajectory);
  for (Submap& submap : saved.submaps) Repair(submap.map, submap.trajectory);
  return saved;
}

// Removes what writers have left that were killed. Who has the folder's lock is the only one that
// writes.
void RemoveLeftoversBeside(const MapLock& lock) {
  namespace fs = std::filesystem;
  if (!lock.IsHeld()) return;
  std::error_code error;
  const fs::path file = fs::absolute(lock.file(), error);
  const std::string before = file.filename().string() + ".";
  for (fs::directory_iterator entry(file.parent_path(), error);
       !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::string_view numbers = name;
    if (!numbers.starts_with(before)) continue;
    numbers.remove_prefix(before.size());
    if (!numbers.ends_with(kTemporary)) continue;
    numbers.remove_suffix(kTemporary.size());
    if (!numbers.empty() && numbers.find_first_not_of("0123456789-") == std::string_view::npos)
      unlink(entry->path().c_str());
  }
}

void CheckIsPlainFile(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path folder = fs::absolute(path, error).parent_path();
  if (path.empty() || error) throw BadInput("\"{}\": is no path of a file", path);
  if (!fs::is_directory(folder, error))
    throw BadInput("{}: there is no folder {}", path, folder.string());
  // A device would be replaced.
  const fs::file_status present = fs::status(path, error);
  if (fs::exists(present) && !fs::is_regular_file(present))
    throw BadInput("{}: cannot be written: is no regular file", path);
}

void WriteFile(const SavedMap& saved, const MapLock& lock,
               const std::optional<MapState>& replaces) {
  const std::string &path = lock.path(), &file = lock.file();
  RemoveLeftoversBeside(lock);
  const UnfinishedFile unfinished(file, std::string(kTemporary));
  try {
    {
      SQLite::Database database = CreateWithoutLocks(unfinished.name());
      WriteContent(saved, database);
    }
    SyncToDisk(unfinished.name());
    if (replaces && StateOfMap(file) != replaces)
      throw BadInput("{}: is not changed: another program has written it meanwhile", path);
    if (const std::error_code error = unfinished.Rename())
      throw BadInput("{}: cannot be written: {}", path, error.message());
    lock.Sync();
  } catch (const SQLite::Exception& problem) {
    throw BadInput("{}: {}", path, problem.what());
  }
}

}  // namespace

void SaveMap(const SavedMap& given, const MapLock& lock, const std::optional<MapState>& replaces) {
  SavedMap saved = given;  // shares its tables
  if (saved.recordings.empty()) saved.recordings = RecordingsByTime(saved);
  if (const std::vector<std::string> problems = ProblemsOf(saved); !problems.empty()) {
    Log(LogLevel::kWarning,
        "{}: the map is not consistent, by a defect of this program; it is saved without "
        "what is concerned ({} problems, first: {})",
        lock.path(), problems.size(), problems.front());
    saved = WithoutProblems(std::move(saved));
  }
  WriteFile(saved, lock, replaces);
}

void SaveMap(const std::string& path, const SavedMap& saved) {
  CheckIsPlainFile(path);
  SaveMap(saved, MapLock(path));
}

void EditMap(const std::string& path, const std::function<void(SavedMap&)>& edit) {
  const MapLock lock(MapFileAt(path));
  const std::optional<MapState> before = StateOfMap(lock.file());
  SavedMap saved = LoadMap(lock.path());
  edit(saved);
  SaveMap(saved, lock, before);
}

}  // namespace oaslam
