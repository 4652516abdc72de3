#include "oaslam/storage/map_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "oaslam/class_names.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/detection_check.h"
#include "oaslam/storage/map_schema.h"

namespace oaslam {
namespace {

// A year of 30 images a second. The sum of two fits an int (runs are numbered one after another).
constexpr int kMaxFrame = 1 << 30;

template <typename T>
std::vector<T> CopyOf(std::span<const std::byte> bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

// Condition for a column.
std::string IsIn(const char* column, IdRange range) {
  return fmt::format("{} BETWEEN {} AND {}", column, range.first, range.last);
}

template <typename Id, typename T>
void InsertNew(Id id, T value, const RowReader& row, Table<Id, T>& table) {
  if (table.Contains(id)) row.Refuse(fmt::format("{} occurs twice", id.value));
  table.Insert(id, std::move(value));
}

// Reads the name of one of `known`.
template <typename Enum, size_t N>
Enum ReadWord(RowReader& row, const Enum (&known)[N]) {
  const std::string text = row.Text();
  for (const Enum value : known)
    if (text == ToString(value)) return value;
  row.Refuse(fmt::format("\"{}\" is not known", text));
}

constexpr LensModel kLensModels[] = {LensModel::kPinhole, LensModel::kFisheye};
constexpr ObjectState kObjectStates[] = {ObjectState::kTentative, ObjectState::kInitialized,
                                         ObjectState::kMapped};
constexpr TrackingState kTrackingStates[] = {TrackingState::kInitializing, TrackingState::kTracking,
                                             TrackingState::kRelocalized,  TrackingState::kObjects,
                                             TrackingState::kLost,         TrackingState::kOdometry,
                                             TrackingState::kPreliminary};

int CategoryOf(std::string_view text, const RowReader& row) {
  const std::optional<double> value = ParseNumber(text);
  if (!value || *value != std::floor(*value) || *value < INT32_MIN || *value > INT32_MAX)
    row.Refuse(fmt::format("\"{}\" is not a category", text));
  return static_cast<int>(*value);
}

std::set<int> ReadMovable(RowReader& row) {
  std::set<int> movable;
  const std::string text = row.Text();
  for (const std::string_view category : SplitFields(text))
    movable.insert(CategoryOf(category, row));
  return movable;
}

std::map<int, int> ReadParts(RowReader& row) {
  std::map<int, int> whole_of;
  const std::string text = row.Text();
  for (const std::string_view pair : SplitFields(text)) {
    const size_t colon = pair.find(':');
    if (colon == std::string_view::npos)
      row.Refuse(fmt::format("\"{}\" is not of the form part:whole", pair));
    whole_of.emplace(CategoryOf(pair.substr(0, colon), row),
                     CategoryOf(pair.substr(colon + 1), row));
  }
  if (const auto part = PartOfItself(whole_of))
    row.Refuse(fmt::format("category {} is a part of itself", *part));
  return whole_of;
}

struct DescribedPoints {
  LearnedDescriptors learned;
  std::vector<float> depths;
};

DescribedPoints ReadLearned(RowReader& row) {
  LearnedDescriptors learned;
  const auto count = static_cast<size_t>(row.Int(1, Features::kMaxKeypoints));
  learned.keypoints = CopyOf<uint16_t>(row.Blob(count * sizeof(uint16_t)));
  if (std::ranges::adjacent_find(learned.keypoints, std::ranges::greater_equal{}) !=
      learned.keypoints.end())
    row.Refuse("key points are not ascending");
  learned.descriptors = CopyOf<Descriptor>(row.Blob(count * sizeof(Descriptor)));
  std::vector<float> depths = CopyOf<float>(row.Blob(count * sizeof(float)));
  if (!std::ranges::all_of(depths, [](float z) { return std::isfinite(z) && z >= 0; }))
    row.Refuse("a depth that is not finite, or negative");
  return {std::move(learned), std::move(depths)};
}

std::shared_ptr<const Features> ReadFeatures(RowReader& row, LearnedDescriptors learned) {
  auto features = std::make_shared<Features>();
  const auto count = static_cast<size_t>(row.Int(0, Features::kMaxKeypoints));
  PyramidScales& pyramid = features->pyramid;
  pyramid.levels = row.Int(1, PyramidScales::kMaxLevels);
  pyramid.factor = row.Float();
  pyramid.scale = {};
  const auto scales = CopyOf<float>(row.Blob(pyramid.levels * sizeof(float)));
  std::ranges::copy(scales, pyramid.scale.begin());
  features->bounds = row.ReadBox();
  if (!(features->bounds.Area() > 0)) row.Refuse("empty bounds");
  features->keypoints.reserve(count);
  for (const StoredKeypoint& k : CopyOf<StoredKeypoint>(row.Blob(count * sizeof(StoredKeypoint)))) {
    if (!std::isfinite(k.x) || !std::isfinite(k.y) || k.octave < 0 || k.octave >= pyramid.levels)
      row.Refuse("a key point out of range");
    features->keypoints.push_back({{k.x, k.y}, k.angle_rad, static_cast<uint8_t>(k.octave)});
  }
  features->descriptors = CopyOf<Descriptor>(row.Blob(count * sizeof(Descriptor)));
  if (!learned.empty() && learned.keypoints.back() >= count)
    row.Refuse("fewer key points than learned descriptors name");
  features->learned = std::move(learned);
  features->BuildGrid();
  return features;
}

void ReadUnitEvidence(const std::string& key, RowReader& rows, UnitEvidence& unit) {
  if (key == "unit_classes") {
    unit.classes = rows.Int(1);
  } else if (key == "unit_objects") {
    unit.objects = rows.Int(1);
  } else if (key == "unit_sensor") {
    const std::string sensor = rows.Text();
    if (sensor != "imu" && sensor != "depth")
      rows.Refuse(fmt::format("sensor \"{}\", allowed: imu, depth", sensor));
    unit.source = sensor == "imu" ? UnitSource::kImu : UnitSource::kDepth;
  } else if (key == "unit_sigma") {
    unit.relative_sigma = rows.Real();
    if (unit.relative_sigma < 0) rows.Refuse("a standard deviation below 0");
  } else {
    rows.Refuse(fmt::format("key \"{}\" is not known", key));
  }
}

}  // namespace

void ReadMeta(SQLite::Database& database, Checksum& checksum, Map& map) {
  RowReader rows(database, checksum, "meta", "key", "key <> 'checksum'");
  while (rows.Next()) {
    const std::string key = rows.Text();
    if (key == "map_version")
      map.version = static_cast<uint64_t>(rows.Integer(INT64_MIN, INT64_MAX));
    else if (key == "next_landmark")
      map.next_landmark = static_cast<uint32_t>(rows.Integer(0, UINT32_MAX));
    else if (key == "up_x" || key == "up_y" || key == "up_z") {
      if (!map.up) map.up = Eigen::Vector3d::Zero();
      (*map.up)[key[3] - 'x'] = rows.Real();
    } else if (key == "up_keyframes") {
      map.up_keyframes = static_cast<int>(rows.Integer(1, INT32_MAX));
    } else if (key == "unit") {
      if (const std::string unit = rows.Text(); unit != "metre")
        rows.Refuse(fmt::format("unit \"{}\", allowed: metre", unit));
      map.is_metric = true;
    } else if (map.is_metric && key.starts_with("unit_")) {
      if (!map.unit_evidence) map.unit_evidence.emplace();
      ReadUnitEvidence(key, rows, *map.unit_evidence);
    } else if (key == "movable") {
      map.classes.movable = ReadMovable(rows);
    } else if (key == "parts") {
      map.classes.whole_of = ReadParts(rows);
    } else
      rows.Refuse(fmt::format("key \"{}\" is not known", key));
  }
}

void ReadCameras(SQLite::Database& database, Checksum& checksum, Map& map) {
  RowReader rows(database, checksum, "cameras", "id");
  while (rows.Next()) {
    rows.Int(static_cast<int>(map.cameras.size()), static_cast<int>(map.cameras.size()));
    Camera camera;
    camera.name = rows.Text();
    camera.model = ReadWord(rows, kLensModels);
    camera.width = rows.Int(0);
    camera.height = rows.Int(0);
    for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value = rows.Real();
    for (double& k : camera.distortion) k = rows.Real();
    camera.is_guess = rows.Int(0, 1) != 0;
    map.cameras.push_back(std::move(camera));
  }
}

void ReadKeyframes(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map) {
  RowReader rows(database, checksum, "keyframes", "id", IsIn("id", range));
  while (rows.Next()) {
    const auto id = rows.RequiredId<KeyframeId>();
    Keyframe keyframe;
    keyframe.frame_index = rows.Int(INT32_MIN, kMaxFrame);
    keyframe.timestamp = rows.Real();
    keyframe.camera = rows.Int();
    keyframe.cam_from_world = rows.Pose();
    InsertNew(id, std::move(keyframe), rows, map.keyframes);
  }
}

void ReadRetiredKeyframes(SQLite::Database& database, Checksum& checksum, Map& map) {
  RowReader rows(database, checksum, "retired_keyframes", "id");
  while (rows.Next()) {
    const auto id = rows.RequiredId<KeyframeId>();
    const auto parent = rows.RequiredId<KeyframeId>();
    InsertNew(id, RetiredKeyframe{parent, rows.Pose()}, rows, map.retired);
  }
}

void ReadFeatures(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map) {
  std::map<KeyframeId, DescribedPoints> learned;
  RowReader described(database, checksum, "learned_descriptors", "keyframe",
                      IsIn("keyframe", range));
  while (described.Next()) {
    const auto id = described.RequiredId<KeyframeId>();
    if (!map.keyframes.Contains(id)) described.Refuse("no such keyframe");
    learned.emplace(id, ReadLearned(described));
  }
  RowReader rows(database, checksum, "features", "keyframe", IsIn("keyframe", range));
  while (rows.Next()) {
    const auto id = rows.RequiredId<KeyframeId>();
    Keyframe* keyframe = map.keyframes.Mutable(id);
    if (!keyframe) rows.Refuse("no such keyframe");
    auto points = learned.extract(id);
    keyframe->features =
        ReadFeatures(rows, points ? std::move(points.mapped().learned) : LearnedDescriptors());
    if (points) keyframe->learned_depths = std::move(points.mapped().depths);
    keyframe->landmarks.resize(keyframe->features->keypoints.size());
  }
}

void ReadCovisibility(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map) {
  RowReader rows(database, checksum, "covisibility", "keyframe, rank", IsIn("keyframe", range));
  while (rows.Next()) {
    Keyframe* keyframe = map.keyframes.Mutable(rows.RequiredId<KeyframeId>());
    if (!keyframe) rows.Refuse("no such keyframe");
    rows.Int();
    const auto neighbour = rows.RequiredId<KeyframeId>();
    keyframe->covisible.push_back({neighbour, rows.Int(0)});
  }
}

void ReadLandmarks(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map) {
  RowReader rows(database, checksum, "landmarks", "id", IsIn("id", range));
  while (rows.Next()) {
    const auto id = rows.RequiredId<LandmarkId>();
    Landmark landmark;
    landmark.position = rows.Vector();
    landmark.normal = rows.Vector();
    landmark.min_distance = rows.Float();
    landmark.max_distance = rows.Float();
    landmark.first_keyframe = rows.OptionalId<KeyframeId>();
    landmark.visible = rows.Int();
    landmark.found = rows.Int();
    const auto descriptor = rows.Blob(sizeof(Descriptor));
    std::memcpy(landmark.descriptor.data(), descriptor.data(), sizeof(Descriptor));
    InsertNew(id, std::move(landmark), rows, map.landmarks);
  }
}

void ReadObservations(SQLite::Database& database, Checksum& checksum, IdRange range, Map& map) {
  RowReader rows(database, checksum, "observations", "landmark, keyframe", IsIn("landmark", range));
  while (rows.Next()) {
    Landmark* landmark = map.landmarks.Mutable(rows.RequiredId<LandmarkId>());
    if (!landmark) rows.Refuse("no such landmark");
    const auto keyframe = rows.RequiredId<KeyframeId>();
    landmark->observations.push_back({keyframe, static_cast<uint32_t>(rows.Int(0))});
  }
}

void LinkKeyframes(Map& map) {
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    for (const Observation& o : landmark.observations) {
      Keyframe* keyframe = map.keyframes.Mutable(o.keyframe);
      if (!keyframe || o.keypoint >= keyframe->landmarks.size())
        throw SQLite::Exception(fmt::format(
            "is damaged: landmark {} is seen by keyframe {}, key point {}, which does not exist",
            id.value, o.keyframe.value, o.keypoint));
      keyframe->landmarks[o.keypoint] = id;
    }
  });
}

Object& ObjectOf(RowReader& row, Map& map) {
  Object* object = map.objects.Mutable(row.RequiredId<ObjectId>());
  if (!object) row.Refuse("no such object");
  return *object;
}

void ReadLabels(SQLite::Database& database, Checksum& checksum, Map& map) {
  RowReader labels(database, checksum, "object_labels", "object, category_id");
  while (labels.Next()) {
    Object& object = ObjectOf(labels, map);
    const int category = labels.Int(0, kMaxCategory);
    const double share = labels.Real();
    if (!(share >= 0 && share <= 1)) labels.Refuse("a share is from 0 to 1");
    object.shares.push_back({category, share});
  }
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (!AreConsistent(LabelsOf(object)))
      throw SQLite::Exception(fmt::format(
          "object_labels: those of object {} do not sum to 1, or lack its category", id.value));
  });
}

void ReadObjectObservations(SQLite::Database& database, Checksum& checksum, Map& map) {
  RowReader observations(database, checksum, "object_observations", "object, rank");
  while (observations.Next()) {
    Object& object = ObjectOf(observations, map);
    observations.Int();
    ObjectObservation o;
    o.frame_index = observations.Int(INT32_MIN, kMaxFrame);
    o.reference = observations.RequiredId<KeyframeId>();
    o.cam_from_reference = observations.Pose();
    o.camera = observations.Int();
    o.box = observations.ReadBox();
    o.score = observations.Real();
    o.truncated = static_cast<unsigned char>(observations.Int(0, 255));
    object.observations.push_back(o);
  }
}

void ReadObjects(SQLite::Database& database, Checksum& checksum, Map& map) {
  RowReader rows(database, checksum, "objects", "id");
  while (rows.Next()) {
    const auto id = rows.RequiredId<ObjectId>();
    Object object;
    object.category_id = rows.Int();
    object.state = ReadWord(rows, kObjectStates);
    object.ellipsoid.center = rows.Vector();
    object.ellipsoid.half_axes = rows.Vector();
    object.ellipsoid.rotation = rows.Rotation();
    const auto covariance =
        rows.Blob(sizeof(double) * static_cast<size_t>(object.covariance.size()));
    std::memcpy(object.covariance.data(), covariance.data(), covariance.size());
    object.detection_rate = rows.Real();
    object.mean_iou = rows.Real();
    object.total_observations = rows.Int(0);
    object.evidence = object.total_observations;
    object.last_seen_frame = rows.Int(INT32_MIN, kMaxFrame);
    object.name = rows.Text();
    InsertNew(id, std::move(object), rows, map.objects);
  }
  ReadLabels(database, checksum, map);
  ReadObjectObservations(database, checksum, map);
  RowReader landmarks(database, checksum, "object_landmarks", "object, landmark");
  while (landmarks.Next()) {
    Object& object = ObjectOf(landmarks, map);
    object.landmarks.push_back(landmarks.RequiredId<LandmarkId>());
    object.landmark_votes.push_back(static_cast<uint16_t>(landmarks.Int(0, UINT16_MAX)));
  }
  RowReader merged(database, checksum, "merged_objects", "id");
  while (merged.Next()) {
    const auto id = merged.RequiredId<ObjectId>();
    InsertNew(id, merged.OptionalId<ObjectId>(), merged, map.merged_objects);
  }
}

Anchor ReadAnchor(RowReader& row) {
  Anchor anchor;
  anchor.model = row.Text();
  anchor.size = row.Real();
  anchor.keyframe = row.RequiredId<KeyframeId>();
  anchor.cam_from_anchor = row.Pose();
  anchor.object = row.OptionalId<ObjectId>();
  anchor.offset = row.Vector();
  return anchor;
}

void ReadAnchors(SQLite::Database& database, Checksum& checksum, Map& map) {
  RowReader rows(database, checksum, "anchors", "name");
  while (rows.Next()) {
    std::string name = rows.Text();
    map.anchors.emplace(std::move(name), ReadAnchor(rows));
  }
}

void ReadTrajectory(SQLite::Database& database, Checksum& checksum, SavedMap& saved) {
  RowReader rows(database, checksum, "trajectory", "rank");
  while (rows.Next()) {
    rows.Int();
    FramePose pose;
    pose.frame_index = rows.Int(INT32_MIN, kMaxFrame);
    pose.timestamp = rows.Real();
    pose.reference = rows.OptionalId<KeyframeId>();
    pose.cam_from_reference = rows.Pose();
    pose.state = ReadWord(rows, kTrackingStates);
    saved.trajectory.push_back(pose);
  }
}

void ReadRecordings(SQLite::Database& database, Checksum& checksum, SavedMap& saved) {
  RowReader rows(database, checksum, "recordings", "number");
  while (rows.Next()) {
    const int number = static_cast<int>(saved.recordings.size()) + 1;
    rows.Int(number, number);
    MapRecording recording;
    recording.name = rows.Text();
    recording.images = rows.Text();
    recording.first_frame = rows.Int(INT32_MIN, kMaxFrame);
    if (!saved.recordings.empty() && recording.first_frame <= saved.recordings.back().first_frame)
      rows.Refuse("first frames do not ascend");
    saved.recordings.push_back(std::move(recording));
  }
}

void ReadClassNames(SQLite::Database& database, Checksum& checksum, SavedMap& saved) {
  RowReader names(database, checksum, "class_names", "category_id");
  while (names.Next()) {
    const int id = names.Int();
    saved.class_names[id] = names.Text();
  }
}

}  // namespace oaslam
