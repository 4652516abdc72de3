#include "oaslam/storage/map_file.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/storage/map_bytes.h"
#include "oaslam/storage/map_rows.h"
#include "oaslam/storage/map_schema.h"
#include "oaslam/util/log.h"
#include "oaslam/util/read_file.h"
#include "random_map.h"

namespace oaslam {
namespace {

SavedMap MakeMap(uint64_t seed = 1) {
  Rng rng(seed);
  return RandomMap({}, rng);
}

void ExpectEqual(const Rigid3& a, const Rigid3& b) {
  EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
  EXPECT_EQ(a.translation, b.translation);
}

struct MapFileTest : FolderTest {
  void Change(const std::string& sql) const {
    SQLite::Database(folder / "a.map", SQLite::OPEN_READWRITE).exec(sql);
  }
  // Why a map is refused whose file was changed after it was saved.
  std::string ErrorAfter(const SavedMap& saved, const std::string& sql) const {
    SaveMap(folder / "a.map", saved);
    Change(sql);
    return InputErrorOf([&] { LoadMap(folder / "a.map"); });
  }
};

TEST_F(MapFileTest, KeepsWhatIsKnownOfTheClasses) {
  SavedMap saved = MakeMap();
  saved.map.classes = {{{100, 101}, {102, 101}}, {0, 56}};
  SaveMap(folder / "a.map", saved);
  const SavedMap loaded = LoadMap(folder / "a.map");
  EXPECT_EQ(loaded.map.classes, saved.map.classes);
  SaveMap(folder / "b.map", loaded);
  EXPECT_EQ(LoadMap(folder / "b.map").map.classes, saved.map.classes);
  saved.map.classes.whole_of[101] = 100;
  SaveMap(folder / "circle.map", saved);
  EXPECT_INPUT_ERROR(LoadMap(folder / "circle.map"), HasSubstr("part of itself"));
}

// A map whose ids are all much larger than those of MakeMap.
Submap SubmapOf(const SavedMap& saved, uint32_t first_id) {
  Submap submap;
  submap.map.cameras = saved.map.cameras;
  submap.map.version = 3;
  submap.map.next_landmark = first_id;
  saved.map.keyframes.ForEach([&](KeyframeId id, Keyframe keyframe) {
    keyframe.covisible.clear();
    std::ranges::fill(keyframe.landmarks, LandmarkId());
    submap.map.keyframes.Insert(KeyframeId(id.value + first_id), std::move(keyframe));
  });
  const std::vector<KeyframeId> ids = submap.map.keyframes.Ids();
  const LandmarkId landmark = submap.map.AddLandmark({1, 2, 3}, ids[0]);
  submap.map.AddObservation(landmark, ids[0], 3);
  submap.map.AddObservation(landmark, ids[1], 5);
  submap.map.UpdateLandmark(landmark);
  submap.trajectory.push_back({700, 23.5, ids[0], {}, TrackingState::kTracking});
  return submap;
}

// A map file as format 8 was: without the table of recordings, and its part in the list.
void SaveFormat8(const std::string& path, const SavedMap& saved) {
  SaveMap(path, saved);
  SQLite::Database file(path, SQLite::OPEN_READWRITE);
  file.exec("DROP TABLE recordings; DELETE FROM parts WHERE name = 'recordings'");
  file.exec("PRAGMA user_version = 8");
  Checksum checksum;
  Map map;
  ReadMeta(file, checksum, map);
  RowReader parts(file, checksum, "parts", "name, first");
  while (parts.Next()) {
    parts.Text();
    parts.Int(0, RowReader::kMaxId);
    parts.Int(0, RowReader::kMaxId);
    parts.Text();
  }
  file.exec("UPDATE meta SET value = '" + checksum.Hex() + "' WHERE key = 'checksum'");
}

TEST_F(MapFileTest, KeepsSubmaps) {
  SavedMap saved = MakeMap();
  saved.submaps = {SubmapOf(saved, 10000), SubmapOf(saved, 20000)};
  SaveMap(folder / "a.map", saved);
  const SavedMap loaded = LoadMap(folder / "a.map");
  ASSERT_EQ(loaded.submaps.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(loaded.submaps[i].map.keyframes.Ids(), saved.submaps[i].map.keyframes.Ids());
    EXPECT_EQ(loaded.submaps[i].map.landmarks.Ids(), saved.submaps[i].map.landmarks.Ids());
    EXPECT_EQ(loaded.submaps[i].map.cameras, saved.map.cameras);
    EXPECT_EQ(loaded.submaps[i].trajectory.front().frame_index, 700);
  }
  SaveMap(folder / "b.map", loaded);
  EXPECT_TRUE(folder.Read("a.map") == folder.Read("b.map"));

  const SavedMap second = LoadSubmap(folder / "a.map", 2);
  EXPECT_EQ(second.map.keyframes.Ids(), saved.submaps[1].map.keyframes.Ids());
  EXPECT_EQ(second.class_names, saved.class_names);
  EXPECT_THAT(second.submaps, IsEmpty());
  EXPECT_INPUT_ERROR(LoadSubmap(folder / "a.map", 3), HasSubstrs("a.map", "no submap 3", "0 to 2"));

  Change("UPDATE pieces SET map = zeroblob(100) WHERE number = 2");
  EXPECT_INPUT_ERROR(LoadMap(folder / "a.map"), HasSubstr("submap 2"));
}

TEST_F(MapFileTest, RefusesSubmapsThatShareIds) {
  SavedMap saved = MakeMap();
  saved.submaps = {SubmapOf(saved, 10000), SubmapOf(saved, 10000)};
  SaveMap(folder / "a.map", saved);
  EXPECT_INPUT_ERROR(LoadMap(folder / "a.map"), HasSubstrs("a.map", "submap 2 shares ids"));
}

TEST_F(MapFileTest, KeepsAnchors) {
  SavedMap saved = MakeMap();
  const Rigid3 pose(Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), {1, 2, 3});
  saved.map.anchors["a flag"] = {"flag", 0.25, saved.map.keyframes.Ids().front(),
                                 pose,   {},   Eigen::Vector3d::Zero()};
  saved.map.anchors["on it"] = {
      "my lamp", 0.5, saved.map.keyframes.Ids().back(), pose, saved.map.objects.Ids().front(),
      {0, -1, 0}};
  SaveMap(folder / "a.map", saved);
  const SavedMap loaded = LoadMap(folder / "a.map");
  EXPECT_EQ(loaded.map.anchors, saved.map.anchors);
  saved.map.anchors["a flag"].keyframe = KeyframeId(12345);
  EXPECT_THAT(saved.map.CheckInvariants(),
              testing::Contains(HasSubstr("anchor \"a flag\": keyframe 12345 leads nowhere")));
  Change("UPDATE anchors SET size = 0.1");
  EXPECT_INPUT_ERROR(LoadMap(folder / "a.map"), HasSubstr("damaged"));
}

TEST_F(MapFileTest, GoesThroughBytes) {
  const SavedMap saved = MakeMap();
  const std::string bytes = BytesOf(saved);
  SaveMap(folder / "a.map", saved);
  EXPECT_EQ(bytes, ReadFile(folder / "a.map", bytes.size()));
  EXPECT_EQ(BytesOf(MapOfBytes(bytes)), bytes);
  for (const std::string& damaged : {std::string(), std::string("noise"), bytes.substr(0, 5000)}) {
    const std::string problem = InputErrorOf([&] { MapOfBytes(damaged); });
    EXPECT_THAT(problem, testing::StartsWith("map: "));
    EXPECT_THAT(problem, Not(HasSubstr("/")));
  }
}

// Nothing that an application can bring into a map makes its file unreadable.
TEST_F(MapFileTest, ReadsWhateverItHasWritten) {
  SetLogSink([](LogLevel, const std::string&) {});  // what is left out is said
  const Rigid3 sound(Eigen::Quaterniond::Identity(), {1, 2, 3});
  std::vector<Rigid3> poses(6, sound);
  poses[1].rotation.coeffs().setZero();
  poses[2].rotation.coeffs() *= 3;
  poses[3].rotation.coeffs()[0] = NAN;
  poses[4].translation.y() = INFINITY;
  poses[5].rotation.coeffs()[3] = 1e-200;
  for (const Rigid3& pose : poses)
    for (const int place : {0, 1, 2, 3}) {
      SavedMap saved = MakeMap();
      const KeyframeId keyframe = saved.map.keyframes.Ids().front();
      if (place == 0) saved.map.anchors["it"] = {"flag", 1, keyframe, pose, {}, {0, 0, 0}};
      if (place == 1) saved.map.keyframes.MutableAt(keyframe).cam_from_world = pose;
      if (place == 2) saved.trajectory.front().cam_from_reference = pose;
      if (place == 3)
        saved.map.objects.MutableAt(saved.map.objects.Ids().front()).ellipsoid.rotation =
            pose.rotation;
      SaveMap(folder / "a.map", saved);
      const SavedMap loaded = LoadMap(folder / "a.map");
      EXPECT_THAT(loaded.map.CheckInvariants(), IsEmpty());
      EXPECT_EQ(loaded.map.anchors.size(), place == 0 && pose.IsValid() ? 1U : 0U);
    }
  SetLogSink(nullptr);
}

TEST_F(MapFileTest, KeepsRecordings) {
  SavedMap saved = MakeMap();
  saved.submaps = {SubmapOf(saved, 10000)};
  saved.recordings = {{"walk", "/films/walk.mp4", 0}, {"", "", 3}};
  SaveMap(folder / "a.map", saved);
  EXPECT_EQ(LoadMap(folder / "a.map").recordings, saved.recordings);
  EXPECT_EQ(LoadSubmap(folder / "a.map", 1).recordings, saved.recordings);
  const auto refusal = [&](const std::string& change) {
    return ErrorAfter(saved, "UPDATE recordings SET " + change);
  };
  EXPECT_THAT(refusal("first_frame = 3"), HasSubstrs("a.map", "do not ascend"));
  EXPECT_THAT(refusal("number = 5 WHERE number = 2"), HasSubstr("recordings"));
  EXPECT_THAT(refusal("name = 'x' WHERE number = 1"), HasSubstr("checksum"));
}

TEST_F(MapFileTest, KeepsWhatTheMetreFollowsFrom) {
  SavedMap saved = MakeMap();
  saved.map.unit_evidence = {.relative_sigma = 0.0625, .objects = 11, .classes = 7};
  SaveMap(folder / "a.map", saved);
  EXPECT_FALSE(LoadMap(folder / "a.map").map.unit_evidence) << "its unit is arbitrary";
  saved.map.is_metric = true;
  SaveMap(folder / "a.map", saved);
  const SavedMap loaded = LoadMap(folder / "a.map");
  EXPECT_TRUE(loaded.map.is_metric);
  EXPECT_EQ(loaded.map.unit_evidence, saved.map.unit_evidence);
  for (const char* change : {"DELETE FROM meta WHERE key = 'unit'",
                             "UPDATE meta SET value = -1 WHERE key = 'unit_sigma'",
                             "UPDATE meta SET value = 0 WHERE key = 'unit_objects'"})
    EXPECT_THAT(ErrorAfter(saved, change), HasSubstrs("a.map", "meta")) << change;
}

TEST_F(MapFileTest, KeepsTheSensorThatTellsTheMetre) {
  SavedMap saved = MakeMap();
  saved.map.is_metric = true;
  for (const UnitSource source : {UnitSource::kImu, UnitSource::kDepth}) {
    saved.map.unit_evidence = {.relative_sigma = 0.0125, .source = source};
    SaveMap(folder / "a.map", saved);
    EXPECT_EQ(LoadMap(folder / "a.map").map.unit_evidence, saved.map.unit_evidence);
  }
  EXPECT_THAT(ErrorAfter(saved, "UPDATE meta SET value = 'nose' WHERE key = 'unit_sensor'"),
              HasSubstrs("a.map", "meta", "nose", "imu, depth"));
}

// Format 9 did not say what the metre follows from: it had been given.
TEST_F(MapFileTest, ReadsFormat9) {
  SavedMap saved = MakeMap();
  saved.map.is_metric = true;
  SaveMap(folder / "a.map", saved);
  Change("PRAGMA user_version = 9");
  const SavedMap loaded = LoadMap(folder / "a.map");
  EXPECT_TRUE(loaded.map.is_metric);
  EXPECT_FALSE(loaded.map.unit_evidence);
}

// A map whose times are those of one film.
SavedMap MapOfOneFilm() {
  SavedMap saved = MakeMap();
  for (const KeyframeId id : saved.map.keyframes.Ids()) {
    Keyframe& keyframe = saved.map.keyframes.MutableAt(id);
    keyframe.timestamp = keyframe.frame_index / 30.0;
  }
  for (FramePose& pose : saved.trajectory) pose.timestamp = pose.frame_index / 30.0;
  return saved;
}

// Format 8 had no recordings: they are told by time, which goes back where a run was continued with
// another film.
TEST_F(MapFileTest, ReadsFormat8) {
  SavedMap saved = MapOfOneFilm();
  const int frames = FramesOf(saved);
  const KeyframeId last = saved.map.keyframes.Ids().back();
  saved.map.keyframes.MutableAt(last).frame_index = frames;
  saved.map.keyframes.MutableAt(last).timestamp = -1;
  saved.trajectory.push_back({frames + 1, -0.5, last, {}, TrackingState::kTracking});
  SaveFormat8(folder / "old.map", saved);
  const SavedMap loaded = LoadMap(folder / "old.map");
  EXPECT_EQ(loaded.map.keyframes.Ids(), saved.map.keyframes.Ids());
  ASSERT_EQ(loaded.recordings.size(), 2U);
  EXPECT_EQ(loaded.recordings[1], (MapRecording{"", "", frames}));
  SaveMap(folder / "new.map", loaded);
  EXPECT_EQ(LoadMap(folder / "new.map").recordings, loaded.recordings);
}

TEST_F(MapFileTest, ReadsFormat8OfOneRun) {
  SaveFormat8(folder / "old.map", MapOfOneFilm());
  EXPECT_EQ(LoadMap(folder / "old.map").recordings.size(), 1U);
}

TEST_F(MapFileTest, LoadsWhatWasSaved) {
  const SavedMap saved = MakeMap();
  SaveMap(folder / "a.map", saved);
  const SavedMap loaded = LoadMap(folder / "a.map");
  EXPECT_THAT(loaded.map.CheckInvariants(), IsEmpty());
  EXPECT_EQ(loaded.map.cameras, saved.map.cameras);
  EXPECT_EQ(*loaded.map.up, *saved.map.up);
  EXPECT_EQ(loaded.map.up_keyframes, saved.map.up_keyframes);
  EXPECT_EQ(loaded.map.next_landmark, saved.map.next_landmark);
  EXPECT_EQ(loaded.map.version, 41u);
  EXPECT_EQ(loaded.class_names, saved.class_names);
  ASSERT_EQ(loaded.map.keyframes.Ids(), saved.map.keyframes.Ids());
  saved.map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
    const Keyframe& l = loaded.map.keyframes.At(id);
    ExpectEqual(l.cam_from_world, k.cam_from_world);
    EXPECT_EQ(l.landmarks, k.landmarks);
    EXPECT_EQ(l.covisible, k.covisible);
    EXPECT_EQ(l.features->descriptors, k.features->descriptors);
    EXPECT_EQ(l.features->pyramid.scale, k.features->pyramid.scale);
    EXPECT_EQ(l.features->keypoints[7].px, k.features->keypoints[7].px);
    EXPECT_EQ(l.features->learned.keypoints, k.features->learned.keypoints);
    EXPECT_EQ(l.features->learned.descriptors, k.features->learned.descriptors);
    EXPECT_EQ(l.learned_depths, k.learned_depths);
    int near = 0, near_loaded = 0;
    k.features->VisitNear({320, 240}, 50, [&](int i) { near += i; });
    l.features->VisitNear({320, 240}, 50, [&](int i) { near_loaded += i; });
    EXPECT_GT(near, 0);
    EXPECT_EQ(near_loaded, near);
  });
  ASSERT_EQ(loaded.map.retired.Ids(), saved.map.retired.Ids());
  ASSERT_EQ(loaded.map.retired.size(), 1u);
  ExpectEqual(loaded.map.retired.At(KeyframeId(4)).cam_from_parent,
              saved.map.retired.At(KeyframeId(4)).cam_from_parent);
  ASSERT_EQ(loaded.map.landmarks.Ids(), saved.map.landmarks.Ids());
  saved.map.landmarks.ForEach([&](LandmarkId id, const Landmark& l) {
    EXPECT_EQ(loaded.map.landmarks.At(id).observations, l.observations);
    EXPECT_EQ(loaded.map.landmarks.At(id).position, l.position);
    EXPECT_EQ(loaded.map.landmarks.At(id).max_distance, l.max_distance);
  });
  ASSERT_EQ(loaded.map.objects.Ids(), saved.map.objects.Ids());
  saved.map.objects.ForEach([&](ObjectId id, const Object& o) {
    const Object& l = loaded.map.objects.At(id);
    EXPECT_EQ(l.state, o.state);
    EXPECT_EQ(l.category_id, o.category_id);
    EXPECT_EQ(l.shares, o.shares);
    EXPECT_EQ(l.covariance, o.covariance);
    EXPECT_EQ(l.landmarks, o.landmarks);
    EXPECT_EQ(l.landmark_votes, o.landmark_votes);
    ASSERT_EQ(l.observations.size(), o.observations.size());
    EXPECT_EQ(l.observations[4].box, o.observations[4].box);
    EXPECT_EQ(l.observations[4].reference, o.observations[4].reference);
  });
  EXPECT_EQ(loaded.map.ResolveObject(ObjectId(0)), ObjectId(1));
  ASSERT_EQ(loaded.trajectory.size(), saved.trajectory.size());
  EXPECT_EQ(loaded.trajectory[3].state, saved.trajectory[3].state);
  ExpectEqual(loaded.trajectory[3].cam_from_reference, saved.trajectory[3].cam_from_reference);
}

TEST_F(MapFileTest, SavingAgainGivesTheSameBytes) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SaveMap(folder / "a.map", MakeMap(seed));
    SaveMap(folder / "b.map", LoadMap(folder / "a.map"));
    EXPECT_TRUE(folder.Read("a.map") == folder.Read("b.map")) << "seed " << seed;
  }
  SaveMap(folder / "other.map", MakeMap(6));
  EXPECT_FALSE(folder.Read("a.map") == folder.Read("other.map"));
}

TEST_F(MapFileTest, AnEmptyMap) {
  SaveMap(folder / "empty.map", {});
  EXPECT_TRUE(LoadMap(folder / "empty.map").map.keyframes.empty());
}

TEST_F(MapFileTest, SavingReplacesTheOldOneAndLeavesNothingBeside) {
  folder.Write("a.map", "something old");
  SaveMap(folder / "a.map", MakeMap());
  EXPECT_NO_THROW(LoadMap(folder / "a.map"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()),
                          std::filesystem::directory_iterator()),
            1);
  EXPECT_INPUT_ERROR(SaveMap(folder / "no/such/folder.map", MakeMap()), HasSubstr("no folder"));
}

TEST_F(MapFileTest, AFolderIsTheMapInIt) {
  EXPECT_INPUT_ERROR(LoadMap(folder.path()), HasSubstr("is not a file"));
  EXPECT_EQ(MapFileAt(folder.path()), folder.path());
  SaveMap(folder / "map.oaslam", MakeMap());
  EXPECT_EQ(MapFileAt(folder.path()), folder / "map.oaslam");
  EXPECT_FALSE(LoadMap(folder.path()).map.keyframes.empty());
  EXPECT_FALSE(LoadSubmap(folder.path(), 0).map.keyframes.empty());
  EXPECT_EQ(MapFileAt(folder / "map.oaslam"), folder / "map.oaslam");
}

std::string LoadError(const TempFolder& folder, const std::string& content) {
  const std::string error = InputErrorOf([&] { LoadMap(folder.Write("bad.map", content)); });
  EXPECT_THAT(error, AllOf(HasSubstr("bad.map"), Not(HasSubstr("\n"))));
  return error;
}

TEST_F(MapFileTest, IsWrittenToFilesOnly) {
  const SavedMap saved;
  EXPECT_INPUT_ERROR(SaveMap("", saved), HasSubstr("no path of a file"));
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_INPUT_ERROR(SaveMap(folder / "pipe", saved), HasSubstr("is no regular file"));
  EXPECT_TRUE(std::filesystem::is_fifo(folder / "pipe"));
}

TEST_F(MapFileTest, RefusesTruncatedForeignAndOtherFormats) {
  SaveMap(folder / "a.map", MakeMap());
  const std::string good = folder.Read("a.map");
  for (const double share : {0.0, 0.001, 0.1, 0.5, 0.9, 0.9999})
    LoadError(folder,
              good.substr(0, static_cast<size_t>(share * static_cast<double>(good.size()))));
  EXPECT_THAT(LoadError(folder,
                        "# a text file, long enough to hold a header of a database, which is 100 "
                        "bytes at least ........"),
              HasSubstr("bad.map: is no map file"));
  {
    SQLite::Database other(folder / "other.db", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    other.exec("CREATE TABLE t(a); INSERT INTO t VALUES (1)");
  }
  EXPECT_THAT(LoadError(folder, folder.Read("other.db")), HasSubstr("is no map file"));
  EXPECT_THAT(LoadError(folder, ""), HasSubstr("is no map file"));
  for (const auto& [format, advice] : {std::pair(kOldestMapFormatVersion - 1, ""),
                                       {kMapFormatVersion + 1, ": use a newer oaslam"}}) {
    Change(fmt::format("PRAGMA user_version={}", format));
    EXPECT_THAT(LoadError(folder, folder.Read("a.map")),
                EndsWith(fmt::format("bad.map: is a map of format {}, this program reads formats "
                                     "{} to {} only{}",
                                     format, kOldestMapFormatVersion, kMapFormatVersion, advice)));
  }
  EXPECT_INPUT_ERROR(LoadMap(folder / "missing.map"), HasSubstr("no such file"));
  EXPECT_INPUT_ERROR(LoadMap(folder.path()), HasSubstr("not a file"));
}

TEST_F(MapFileTest, RefusesChangedContent) {
  for (const char* change :
       {"UPDATE landmarks SET x = x + 1e-9 WHERE id = 3", "DELETE FROM trajectory WHERE rank = 4",
        "UPDATE cameras SET name = 'b'", "UPDATE object_landmarks SET votes = votes + 1",
        "UPDATE meta SET value = 42 WHERE key = 'map_version'",
        "UPDATE keyframes SET timestamp = NULL", "DROP TABLE merged_objects",
        "UPDATE objects SET state = 'gone'", "UPDATE object_labels SET share = 1.5",
        "UPDATE object_labels SET share = 0", "UPDATE objects SET category_id = 7 WHERE id = 1"})
    EXPECT_THAT(ErrorAfter(MakeMap(), change), HasSubstr("a.map")) << change;
}

// tools/fuzz map: the number became infinite, and the map could not be saved again.
TEST_F(MapFileTest, RefusesNumbersThatAFloatCannotHold) {
  EXPECT_THAT(ErrorAfter(MakeMap(), "UPDATE landmarks SET max_distance = -1e300 WHERE id = 3"),
              HasSubstrs("max_distance", "too large"));
}

TEST_F(MapFileTest, RefusesLearnedDescriptorsThatCannotBe) {
  const auto refusal = [&](const std::string& change) {
    return ErrorAfter(MakeMap(),
                      "UPDATE learned_descriptors SET " + change + " WHERE keyframe = 2");
  };
  EXPECT_THAT(refusal("count = 19"), HasSubstrs("a.map", "learned_descriptors"));
  EXPECT_THAT(refusal("count = 0"), HasSubstr("learned_descriptors"));
  EXPECT_THAT(refusal("count = 1, keypoints = x'3c00', descriptors = zeroblob(32), "
                      "depths = zeroblob(4)"),
              HasSubstr("fewer key points"));
  EXPECT_THAT(refusal("count = 2, keypoints = x'02000200', descriptors = zeroblob(64), "
                      "depths = zeroblob(8)"),
              HasSubstr("ascending"));
  EXPECT_THAT(refusal("count = 1, keypoints = x'0200', descriptors = zeroblob(32), "
                      "depths = x'000080bf'"),
              HasSubstr("negative"));
  EXPECT_THAT(refusal("keyframe = 3"), HasSubstr("no such keyframe"));
}

// Any flipped byte is detected, or is at a place where it changes nothing (free space, the file's
// change counter).
TEST_F(MapFileTest, FlippedBytesNeverChangeTheMap) {
  SaveMap(folder / "a.map", MakeMap());
  const std::string good = folder.Read("a.map");
  SaveMap(folder / "again.map", LoadMap(folder / "a.map"));
  const std::string reference = folder.Read("again.map");
  Rng rng(3);
  int refused = 0;
  constexpr int kTrials = 80;
  for (int i = 0; i < kTrials; ++i) {
    std::string bad = good;
    bad[static_cast<size_t>(rng.Index(static_cast<int>(good.size())))] ^=
        static_cast<char>(1 << rng.Index(8));
    folder.Write("bad.map", bad);
    try {
      SaveMap(folder / "again.map", LoadMap(folder / "bad.map"));
      EXPECT_TRUE(folder.Read("again.map") == reference);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, kTrials / 4);
}

// A defect of the program must not cost the user's map.
TEST_F(MapFileTest, SavesWhatIsSoundOfABrokenMap) {
  SavedMap saved = MakeMap();
  saved.submaps = {SubmapOf(saved, 10000)};
  const size_t landmarks = saved.map.landmarks.size(), poses = saved.trajectory.size();
  const LandmarkId broken = saved.map.landmarks.Ids().front();
  saved.map.landmarks.MutableAt(broken).observations.resize(1);
  Map& submap = saved.submaps[0].map;
  submap.keyframes.MutableAt(submap.keyframes.Ids().back()).cam_from_world.translation.x() =
      std::numeric_limits<double>::quiet_NaN();
  saved.trajectory[3].cam_from_reference.rotation.w() = std::numeric_limits<double>::infinity();
  std::vector<std::string> told;
  SetLogSink([&](LogLevel, const std::string& message) { told.push_back(message); });
  SaveMap(folder / "a.map", saved);
  SetLogSink(nullptr);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0], HasSubstrs("a.map", "not consistent", std::to_string(broken.value)));
  const SavedMap loaded = LoadMap(folder / "a.map");
  EXPECT_EQ(loaded.map.keyframes.Ids(), saved.map.keyframes.Ids());
  EXPECT_EQ(loaded.map.landmarks.size(), landmarks - 1);
  EXPECT_EQ(loaded.trajectory.size(), poses - 1);
  ASSERT_EQ(loaded.submaps.size(), 1U);
  EXPECT_EQ(loaded.submaps[0].map.keyframes.size(), submap.keyframes.size() - 1);
}

}  // namespace
}  // namespace oaslam
