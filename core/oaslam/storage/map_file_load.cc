#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/storage/map_edit.h"
#include "oaslam/storage/map_rows.h"
#include "oaslam/storage/map_schema.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// The name of a part in messages.
std::string NameOf(const MapPart& part) {
  if (part.name == "pieces") return fmt::format("submap {}", part.ids.first);
  std::string name = part.name;
  std::ranges::replace(name, '_', ' ');
  return part.name == "keyframes" || part.name == "landmarks"
             ? fmt::format("{} {} to {}", name, part.ids.first, part.ids.last)
             : name;
}

// Tells whether a part is to be read.
using Choice = std::function<bool(const MapPart&)>;

void CheckKind(SQLite::Database& database) {
  int64_t application = 0;
  try {
    application = database.execAndGet("PRAGMA application_id").getInt64();
  } catch (const SQLite::Exception& error) {
    if (error.getErrorCode() != SQLITE_NOTADB) throw;
  }
  if (application != kMapApplicationId) throw SQLite::Exception("is no map file of oaslam");
  const int64_t version = database.execAndGet("PRAGMA user_version").getInt64();
  if (version < kOldestMapFormatVersion || version > kMapFormatVersion)
    throw SQLite::Exception(
        fmt::format("is a map of format {}, this program reads formats {} to {} only{}", version,
                    kOldestMapFormatVersion, kMapFormatVersion,
                    version > kMapFormatVersion ? ": use a newer oaslam" : ""));
}

// No two submaps may share an id, so that they can be joined.
template <typename Id, typename A, typename B>
bool Overlap(const Table<Id, A>& a, const Table<Id, B>& b) {
  bool overlap = false;
  b.ForEach([&](Id id, const B&) { overlap = overlap || a.Contains(id); });
  return overlap;
}

bool Overlap(const Map& a, const Map& b) {
  return Overlap(a.keyframes, b.keyframes) || Overlap(a.retired, b.retired) ||
         Overlap(a.keyframes, b.retired) || Overlap(a.retired, b.keyframes) ||
         Overlap(a.landmarks, b.landmarks) || Overlap(a.objects, b.objects) ||
         Overlap(a.merged_objects, b.merged_objects);
}

// PyramidScales::zoom is not in the file: it follows from the cameras.
void SetZooms(Map& map) {
  for (const KeyframeId id : map.keyframes.Ids()) {
    const Keyframe& keyframe = map.keyframes.At(id);
    const auto camera = static_cast<size_t>(keyframe.camera);
    if (camera == 0 || !keyframe.features || camera >= map.cameras.size()) continue;
    const auto zoom = ZoomBetween(map.cameras.front(), map.cameras[camera]);
    if (!zoom) continue;
    Features zoomed = *keyframe.features;
    zoomed.pyramid.zoom = *zoom;
    map.keyframes.MutableAt(id).features = std::make_shared<const Features>(std::move(zoomed));
  }
}

void CheckSubmaps(const SavedMap& saved) {
  for (size_t i = 0; i < saved.submaps.size(); ++i) {
    const Map& submap = saved.submaps[i].map;
    if (submap.cameras != saved.map.cameras && !submap.keyframes.empty())
      throw SQLite::Exception(
          fmt::format("is damaged: submap {} has other cameras than the map", i + 1));
    bool overlaps = Overlap(saved.map, submap);
    for (size_t k = 0; k < i; ++k) overlaps = overlaps || Overlap(saved.submaps[k].map, submap);
    if (overlaps)
      throw SQLite::Exception(
          fmt::format("is damaged: submap {} shares ids with another submap", i + 1));
  }
}

SQLite::Database InMemory(std::span<const std::byte> content) {
  SQLite::Database database(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_NOMUTEX);
  auto* copy = static_cast<unsigned char*>(sqlite3_malloc64(content.size()));
  if (!copy) throw SQLite::Exception("is too large for the memory");
  std::memcpy(copy, content.data(), content.size());
  const auto size = static_cast<sqlite3_int64>(content.size());
  const unsigned flags = SQLITE_DESERIALIZE_FREEONCLOSE |
                         SQLITE_DESERIALIZE_READONLY;  // SQLite frees the copy, also if it fails
  database.check(sqlite3_deserialize(database.getHandle(), "main", copy, size, size, flags));
  return database;
}

SavedMap ReadContent(std::span<SQLite::Database> connections, const Choice& is_wanted);

void ReadSubmaps(SQLite::Database& database, Checksum& checksum, IdRange numbers, SavedMap& saved) {
  RowReader rows(database, checksum, "pieces", "number",
                 fmt::format("number BETWEEN {} AND {}", numbers.first, numbers.last));
  while (rows.Next()) {
    rows.Int(1);  // the number
    SQLite::Database content = InMemory(rows.BlobOfAnySize());
    SavedMap submap = ReadContent({&content, 1}, [](const MapPart&) { return true; });
    if (!submap.submaps.empty()) throw SQLite::Exception("is damaged: has submaps itself");
    saved.submaps.push_back({std::move(submap.map), std::move(submap.trajectory)});
  }
}

// A fuzzer would not get past a checksum: its builds accept any (tests/fuzz/map_fuzz.cc).
void CheckSum([[maybe_unused]] const Checksum& checksum,
              [[maybe_unused]] const std::string& stored) {
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
  if (checksum.Hex() != stored) throw SQLite::Exception("the checksum does not match");
#endif
}

// The checksum of the settings and of the list of parts.
std::string StoredChecksum(SQLite::Database& database) {
  // max(): NULL where there is no such row.
  return database.execAndGet("SELECT max(value) FROM meta WHERE key = 'checksum'").getString();
}

// Reads the settings of the map and the list of its parts.
std::vector<MapPart> ReadHead(SQLite::Database& database, Map& map) {
  Checksum checksum;
  ReadMeta(database, checksum, map);
  std::vector<MapPart> parts;
  RowReader rows(database, checksum, "parts", "name, first");
  while (rows.Next()) {
    MapPart part{rows.Text(), {}, {}};
    part.ids.first = static_cast<uint32_t>(rows.Int(0, RowReader::kMaxId));
    part.ids.last = static_cast<uint32_t>(rows.Int(0, RowReader::kMaxId));
    part.checksum = rows.Text();
    if (!parts.empty() && parts.back().name == part.name && parts.back().ids.last >= part.ids.first)
      rows.Refuse("overlaps the part before");
    parts.push_back(std::move(part));
  }
  CheckSum(checksum, StoredChecksum(database));
  return parts;
}

void ReadPart(SQLite::Database& database, const MapPart& part, SavedMap& saved) {
  Checksum checksum;
  if (part.name == "cameras") {
    ReadCameras(database, checksum, saved.map);
  } else if (part.name == "keyframes") {
    ReadKeyframes(database, checksum, part.ids, saved.map);
    ReadFeatures(database, checksum, part.ids, saved.map);
    ReadCovisibility(database, checksum, part.ids, saved.map);
  } else if (part.name == "retired_keyframes") {
    ReadRetiredKeyframes(database, checksum, saved.map);
  } else if (part.name == "landmarks") {
    ReadLandmarks(database, checksum, part.ids, saved.map);
    ReadObservations(database, checksum, part.ids, saved.map);
  } else if (part.name == "objects") {
    ReadObjects(database, checksum, saved.map);
  } else if (part.name == "trajectory") {
    ReadTrajectory(database, checksum, saved);
  } else if (part.name == "recordings") {
    ReadRecordings(database, checksum, saved);
  } else if (part.name == "class_names") {
    ReadClassNames(database, checksum, saved);
  } else if (part.name == "anchors") {
    ReadAnchors(database, checksum, saved.map);
  } else if (part.name == "pieces") {
    ReadSubmaps(database, checksum, part.ids, saved);
  } else {
    throw SQLite::Exception("is not known");
  }
  CheckSum(checksum, part.checksum);
}

// Moves what a part holds to the rest of the map, except for submaps.
void Add(SavedMap&& part, SavedMap& saved) {
  saved.map.keyframes.Take(std::move(part.map.keyframes));
  saved.map.retired.Take(std::move(part.map.retired));
  saved.map.landmarks.Take(std::move(part.map.landmarks));
  saved.map.objects.Take(std::move(part.map.objects));
  saved.map.merged_objects.Take(std::move(part.map.merged_objects));
  saved.map.anchors.merge(std::move(part.map.anchors));
  saved.class_names.merge(std::move(part.class_names));
  if (!part.map.cameras.empty()) saved.map.cameras = std::move(part.map.cameras);
  if (!part.recordings.empty()) saved.recordings = std::move(part.recordings);
  if (!part.trajectory.empty()) saved.trajectory = std::move(part.trajectory);
}

// Calls visit(connection, index) for all indices below `count`, on a thread for each connection.
void ForEachIndex(std::span<SQLite::Database> connections, size_t count,
                  const std::function<void(SQLite::Database&, size_t)>& visit) {
  std::atomic<size_t> next = 0;
  std::exception_ptr failure;
  std::mutex mutex;
  const auto work = [&](SQLite::Database& connection) {
    try {
      for (size_t i = next++; i < count; i = next++) visit(connection, i);
    } catch (...) {
      const std::scoped_lock lock(mutex);
      failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> threads;
    for (SQLite::Database& connection : connections.subspan(1))
      threads.emplace_back([&] { work(connection); });
    work(connections.front());
  }
  if (failure) std::rethrow_exception(failure);
}

// Reads the parts on several threads. Damaged parts are all named in one message.
SavedMap ReadParts(std::span<SQLite::Database> connections, const Choice& is_wanted) {
  SavedMap saved;
  std::vector<MapPart> parts;
  try {
    parts = ReadHead(connections.front(), saved.map);
  } catch (const SQLite::Exception& error) {
    throw SQLite::Exception(std::string("is damaged: the list of its parts: ") + error.what());
  }
  std::erase_if(parts,
                [&](const MapPart& part) { return !is_wanted(part) && part.name != "pieces"; });
  std::vector<std::string> problems(parts.size());
  std::map<uint32_t, Submap> submaps;  // empty where not wanted
  std::mutex mutex;
  ForEachIndex(connections, parts.size(), [&](SQLite::Database& connection, size_t i) {
    const MapPart& part = parts[i];
    SavedMap content;
    try {
      if (is_wanted(part)) ReadPart(connection, part, content);
    } catch (const SQLite::Exception& error) {
      problems[i] = fmt::format("{}: {}", NameOf(part), error.what());
      return;
    }
    const std::scoped_lock lock(mutex);
    if (part.name == "pieces")
      submaps[part.ids.first] =
          content.submaps.empty() ? Submap() : std::move(content.submaps.front());
    Add(std::move(content), saved);
  });
  std::erase(problems, std::string());
  constexpr size_t kTold = 5;  // parts that fit into one line of a message
  const size_t damaged = problems.size();
  if (damaged > kTold) {
    problems.resize(kTold);
    problems.push_back(fmt::format("and {} more", damaged - kTold));
  }
  if (damaged > 0)
    throw SQLite::Exception(fmt::format("is damaged in {} of its {} parts: {}", damaged,
                                        parts.size(), fmt::join(problems, "; ")));
  for (auto& [number, submap] : submaps) saved.submaps.push_back(std::move(submap));
  return saved;
}

// The connections are to one database.
SavedMap ReadContent(std::span<SQLite::Database> connections, const Choice& is_wanted) {
  SQLite::Database& database = connections.front();
  CheckKind(database);
  SavedMap saved = ReadParts(connections, is_wanted);
  LinkKeyframes(saved.map);
  CheckSubmaps(saved);
  if (const auto problems = saved.map.CheckInvariants(); !problems.empty())
    throw SQLite::Exception("is damaged: " + problems.front());
  SetZooms(saved.map);
  for (Submap& submap : saved.submaps) SetZooms(submap.map);
  return saved;
}

SavedMap Load(const std::string& given, const Choice& is_wanted) {
  const std::string path = MapFileAt(given);
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw BadInput("{}: there is no such file", path);
  if (!std::filesystem::is_regular_file(path, error))
    throw BadInput("{}: is not a file, and has no map.oaslam in it", path);
  constexpr unsigned kMostThreads = 8;  // each has a connection with a page cache of its own
  const unsigned threads = std::clamp(std::thread::hardware_concurrency(), 1U, kMostThreads);
  try {
    std::vector<SQLite::Database> connections;
    for (unsigned i = 0; i < threads; ++i) connections.push_back(OpenToRead(path));
    SavedMap saved = ReadContent(connections, is_wanted);
    if (saved.recordings.empty()) saved.recordings = RecordingsByTime(saved);
    return saved;
  } catch (const SQLite::Exception& problem) {
    throw BadInput("{}: {}", path, problem.what());
  }
}

}  // namespace

std::string MapFileAt(const std::string& path) {
  const std::filesystem::path inside = std::filesystem::path(path) / "map.oaslam";
  std::error_code error;
  return std::filesystem::is_regular_file(inside, error) ? inside.string() : path;
}

bool IsMapFile(const std::string& path) {
  constexpr std::string_view kBeginning = "SQLite format 3";
  std::string beginning(kBeginning.size(), ' ');
  return std::ifstream(MapFileAt(path)).read(beginning.data(), std::ssize(beginning)) &&
         beginning == kBeginning;
}

std::optional<MapState> StateOfMap(const std::string& path) try {
  SQLite::Database database = OpenToRead(MapFileAt(path));
  CheckKind(database);
  Map settings;
  Checksum scene;
  for (const MapPart& part : ReadHead(database, settings)) {
    const std::string text = NameOf(part) + part.checksum;
    if (part.name != "objects" && part.name != "anchors") scene.Add(std::as_bytes(std::span(text)));
  }
  return MapState{StoredChecksum(database), scene.Hex()};
} catch (const SQLite::Exception&) {
  return std::nullopt;
}

SavedMap LoadMap(const std::string& path) {
  return Load(path, [](const MapPart&) { return true; });
}

SavedMap LoadSubmap(const std::string& path, int submap) {
  SavedMap saved = Load(path, [&](const MapPart& part) {
    if (part.name == "pieces") return static_cast<int>(part.ids.first) == submap;
    return submap == 0 || part.name == "cameras" || part.name == "class_names" ||
           part.name == "recordings";
  });
  LeadWithSubmap(path, submap, saved);
  saved.submaps.clear();
  return saved;
}

}  // namespace oaslam
