#include "oaslam/exports/map_export.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "exif_jpeg.h"
#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/camera_file.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/images/image_files.h"
#include "oaslam/trajectory_file.h"
#include "random_map.h"

namespace oaslam {
namespace {

const Camera kCamera{.width = 640, .height = 480, .fx = 520, .fy = 525, .cx = 319, .cy = 240};
const Camera kFisheye = [] {
  Camera camera{.width = 848, .height = 800, .fx = 286, .fy = 287, .cx = 421, .cy = 398};
  camera.model = LensModel::kFisheye;
  return camera;
}();

Camera WithDistortion(Camera camera, const decltype(Camera::distortion)& distortion) {
  camera.distortion = distortion;
  return camera;
}

// Keyframes on a line that see a cloud of points without error, with alternating cameras.
SavedMap ExactMap(const std::vector<Camera>& cameras) {
  Rng rng(3);
  SavedMap saved;
  Map& map = saved.map;
  map.cameras = cameras;
  constexpr int kPoints = 40;
  for (uint32_t k = 0; k < 4; ++k) {
    Keyframe keyframe;
    keyframe.frame_index = static_cast<int>(k);
    keyframe.timestamp = 0.5 * k;
    keyframe.camera = static_cast<int>(k % cameras.size());
    keyframe.cam_from_world = Rigid3(Eigen::Quaterniond(1, 0.02 * k, -0.05 * k, 0.1).normalized(),
                                     Eigen::Vector3d(-0.2 * k, 0.1, 0.3));
    map.keyframes.Insert(KeyframeId(3 * k + 1), std::move(keyframe));
  }
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < kPoints; ++i)
    points.emplace_back(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(3, 5));
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.MutableAt(id);
    auto features = std::make_shared<Features>();
    features->bounds = IdealImageBounds(cameras[static_cast<size_t>(keyframe.camera)]);
    for (const Eigen::Vector3d& x : points)
      features->keypoints.push_back(
          {ProjectIdeal(cameras[static_cast<size_t>(keyframe.camera)], keyframe.cam_from_world * x)
               .cast<float>(),
           0, 0});
    features->descriptors.resize(kPoints);
    features->BuildGrid();
    keyframe.features = std::move(features);
    keyframe.landmarks.resize(kPoints);
  }
  for (uint32_t i = 0; i < kPoints; ++i) {
    const LandmarkId id = map.AddLandmark(points[i], KeyframeId(1));
    for (const KeyframeId keyframe : map.keyframes.Ids()) map.AddObservation(id, keyframe, i);
  }
  return saved;
}

// COLMAP's camera models as its documentation gives them (src/colmap/sensor/models.h of its
// manual): pixels of a point in the camera.
Eigen::Vector2d ColmapProject(const std::string& model, const std::vector<double>& p,
                              const Eigen::Vector3d& x) {
  const double u = x.x() / x.z(), v = x.y() / x.z(), r2 = u * u + v * v;
  double du = 0, dv = 0;
  if (model == "OPENCV" || model == "FULL_OPENCV") {
    const double k3 = model == "FULL_OPENCV" ? p[8] : 0;
    const double radial = p[4] * r2 + p[5] * r2 * r2 + k3 * r2 * r2 * r2;
    du = u * radial + 2 * p[6] * u * v + p[7] * (r2 + 2 * u * u);
    dv = v * radial + 2 * p[7] * u * v + p[6] * (r2 + 2 * v * v);
  } else if (model == "OPENCV_FISHEYE") {
    const double r = std::sqrt(r2), theta = std::atan(r), t2 = theta * theta;
    const double scale = theta * (1 + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7])))) / r;
    du = u * scale - u;
    dv = v * scale - v;
  }
  return {p[0] * (u + du) + p[2], p[1] * (v + dv) + p[3]};
}

std::vector<std::string> ContentLines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    if (!line.starts_with("#")) lines.push_back(line);
  return lines;
}

class ColmapExport : public testing::TestWithParam<std::pair<const char*, Camera>> {};

TEST_P(ColmapExport, ObservationsAreInThePixelsOfTheCameraModel) {
  const auto& [model, camera] = GetParam();
  const SavedMap saved = ExactMap({camera});
  const TempFolder folder;
  ExportColmap(folder.path(), saved, ImagesByTime(saved));

  std::istringstream fields(ContentLines(folder.Read("cameras.txt")).at(0));
  std::string id, written_model, width, height;
  fields >> id >> written_model >> width >> height;
  EXPECT_EQ(written_model, model);
  const std::vector<double> parameters{std::istream_iterator<double>(fields), {}};
  const auto lines = ContentLines(folder.Read("images.txt"));
  ASSERT_EQ(lines.size(), 8U);
  for (size_t i = 0; i < 4; ++i) {
    std::istringstream head(lines[2 * i]), points(lines[2 * i + 1]);
    double image = 0, qw = 0, qx = 0, qy = 0, qz = 0, tx = 0, ty = 0, tz = 0;
    head >> image >> qw >> qx >> qy >> qz >> tx >> ty >> tz;
    const Rigid3 cam_from_world(Eigen::Quaterniond(qw, qx, qy, qz), Eigen::Vector3d(tx, ty, tz));
    double u = 0, v = 0;
    int64_t point = 0;
    int seen = 0;
    while (points >> u >> v >> point) {
      const Landmark& landmark =
          saved.map.landmarks.At(LandmarkId(static_cast<uint32_t>(point - 1)));
      const Eigen::Vector2d projected =
          ColmapProject(model, parameters, cam_from_world * landmark.position);
      EXPECT_LT((projected - Eigen::Vector2d(u, v)).norm(), 2e-3);
      ++seen;
    }
    EXPECT_EQ(seen, 40);
  }
  // Our reader reads the file, and subtracts the half pixel of the principal point again.
  const Camera read = LoadCamera(folder / "cameras.txt", {camera.width, camera.height});
  EXPECT_DOUBLE_EQ(read.cx, camera.cx);
  EXPECT_EQ(read.model, camera.model);
  EXPECT_EQ(read.distortion, camera.distortion);
}

INSTANTIATE_TEST_SUITE_P(
    Models, ColmapExport,
    testing::Values(
        std::pair{"PINHOLE", kCamera},
        std::pair{"OPENCV", WithDistortion(kCamera, {-0.2, 0.05, 0.001, -0.002, 0})},
        std::pair{"FULL_OPENCV", WithDistortion(kCamera, {-0.2, 0.05, 0.001, -0.002, 0.01})},
        std::pair{"OPENCV_FISHEYE", WithDistortion(kFisheye, {0.01, -0.02, 0.003, 0.001, 0})}));

struct MapExport : FolderTest {};

TEST_F(MapExport, NerfstudioHasIntrinsicsAFrameForSeveralCameras) {
  const Camera b =
      WithDistortion({.width = 320, .height = 240, .fx = 260, .fy = 262, .cx = 160, .cy = 120},
                     {-0.2, 0.05, 0.001, -0.002, 0.01});
  const SavedMap saved = ExactMap({kCamera, b});
  ExportNerfstudio(folder.path(), saved, ImagesByTime(saved));
  const auto json = nlohmann::json::parse(folder.Read("transforms.json"));
  EXPECT_FALSE(json.contains("fl_x"));
  ASSERT_EQ(json["frames"].size(), 4U);
  EXPECT_EQ(json["frames"][0]["cx"], 319.5);
  EXPECT_EQ(json["frames"][1]["w"], 320);
  EXPECT_EQ(json["frames"][1]["k3"], 0.01);
  EXPECT_EQ(json["frames"][1]["p2"], -0.002);

  const SavedMap mixed = ExactMap({kCamera, kFisheye});
  EXPECT_INPUT_ERROR(ExportNerfstudio(folder.path(), mixed, ImagesByTime(mixed)),
                     HasSubstr("fisheye"));
}

TEST_F(MapExport, ImagesByTimeAreUnique) {
  SavedMap saved = ExactMap({kCamera});
  saved.map.keyframes.MutableAt(KeyframeId(4)).timestamp = 0;  // another run that began at 0, too
  std::vector<std::string> names;
  for (const auto& [id, image] : ImagesByTime(saved)) names.push_back(image.name);
  EXPECT_THAT(names, ElementsAre("0.000000.png", "0.000000_4.png", "1.000000.png", "1.500000.png"));
  const std::string list = folder.Write("rgb.txt", "0.0 a.png\n");
  EXPECT_INPUT_ERROR(FindImages(saved, {list}, {}, folder.path()), HasSubstr("two runs"));
}

// Two films that both begin at 0 s.
TEST_F(MapExport, RecordingsAreNotMixed) {
  SavedMap saved = ExactMap({kCamera});
  saved.recordings = {{"a", "", 0}, {"b", "", 2}};
  for (const uint32_t id : {7U, 10U}) saved.map.keyframes.MutableAt(KeyframeId(id)).timestamp -= 1;
  const std::string a = folder.Write("a/rgb.txt", "0.0 rgb/a0.png\n0.5 rgb/a1.png\n"),
                    b = folder.Write("b/rgb.txt", "0.0 b0.png\n0.5 b1.png\n");
  std::vector<std::string> names;
  for (const auto& [id, image] : FindImages(saved, {a, b}, {}, folder / "out"))
    names.push_back(image.name + " " + image.path);
  EXPECT_THAT(names, ElementsAre("1-a/rgb/a0.png ../a/rgb/a0.png", "1-a/rgb/a1.png ../a/rgb/a1.png",
                                 "2-b/b0.png ../b/b0.png", "2-b/b1.png ../b/b1.png"));
  EXPECT_TRUE(std::filesystem::equivalent(folder / "out/images/1-a", folder / "a"));
  FindImages(saved, {b, a}, {}, folder / "out");  // the links are replaced
  EXPECT_TRUE(std::filesystem::equivalent(folder / "out/images/1-a", folder / "b"));
  EXPECT_EQ(ImagesByTime(saved).at(KeyframeId(7)).name, "2-b/0.000000.png");
  EXPECT_INPUT_ERROR(ExportTum(folder / "ab.txt", saved),
                     HasSubstr("2 recordings whose times overlap: 1 (a), 2 (b)"));
  ExportTumFiles(folder.path(), saved);
  EXPECT_EQ(LoadTrajectory(folder / "1-a.txt").size(), 2U);
  EXPECT_NEAR(LoadTrajectory(folder / "2-b.txt").at(1).world_from_cam.translation.x(),
              saved.map.keyframes.At(KeyframeId(10)).cam_from_world.Inverse().translation.x(),
              1e-8);
  ExportTum(folder / "b.txt", OfRecording(saved, 1));
  EXPECT_EQ(folder.Read("b.txt"), folder.Read("2-b.txt"));
}

TEST_F(MapExport, ImagesOfAListAreFoundByTime) {
  const SavedMap saved = ExactMap({kCamera});
  const std::string list = folder.Write(
      "seq/rgb.txt", "0.0 rgb/a.png\n0.4 rgb/b.png\n0.50001 rgb/c.png\n1.0 rgb/d.png\n");
  const KeyframeImages images = FindImages(saved, {list}, {}, folder / "out");
  ASSERT_EQ(images.size(), 3U);  // nothing at 1.5 s
  EXPECT_EQ(images.at(KeyframeId(4)).name, "rgb/c.png");
  EXPECT_EQ(images.at(KeyframeId(4)).path, "../seq/rgb/c.png");
  EXPECT_INPUT_ERROR(
      FindImages(saved, {folder.Write("other.txt", "7.0 a.png\n")}, {}, folder.path()),
      HasSubstr("another rate of images"));
}

TEST_F(MapExport, ImagesOfAListWithAbsolutePathsAndALinkedFolder) {
  const SavedMap saved = ExactMap({kCamera});
  folder.Write("seq/rgb/c.png", "c");
  folder.Write("deep/er/out/x", "");
  std::filesystem::create_symlink(folder / "deep/er/out", folder / "link");
  const std::string list = folder.Write("seq/rgb.txt", "0.5 " + (folder / "seq/rgb/c.png") + "\n");
  const std::string relative_list = std::filesystem::relative(list).string();
  const KeyframeImage image =
      FindImages(saved, {relative_list}, {}, folder / "link").at(KeyframeId(4));
  EXPECT_EQ(image.name, "rgb/c.png");
  EXPECT_EQ(folder.Read("link/" + image.path), "c");  // leads to the image
}

TEST_F(MapExport, TurnedImagesAreWritten) {
  const SavedMap saved = ExactMap({kCamera});
  const cv::Mat image(48, 64, CV_8UC3, cv::Scalar::all(90));
  folder.Write("seq/a.jpg", JpegWithExif(image, {.orientation = 6}));
  const std::string list = folder.Write("seq/rgb.txt", "0.0 no.jpg\n0.5 a.jpg\n");
  const KeyframeImages images =
      FindImages(saved, {list}, {.orientation = Orientation::kUpright}, folder / "out");
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images.at(KeyframeId(4)).path, "images/000001.png");
  EXPECT_EQ(ReadImage(folder / "out/images/000001.png", true).size(), cv::Size(48, 64));
}

TEST_F(MapExport, ColmapHasNoNamesWithBlanks) {
  const SavedMap saved = ExactMap({kCamera});
  KeyframeImages images = ImagesByTime(saved);
  images.at(KeyframeId(4)).name = "rgb/a b.png";
  EXPECT_INPUT_ERROR(ExportColmap(folder.path(), saved, images), HasSubstr("rgb/a b.png"));
  EXPECT_FALSE(std::filesystem::exists(folder / "images.txt"));
}

TEST_F(MapExport, NamesThatAreNotUtf8AreReplaced) {
  SavedMap saved = ExactMap({kCamera});
  Object object;
  object.name = "caf\xE9";
  object.state = ObjectState::kMapped;
  object.ellipsoid.half_axes = Eigen::Vector3d::Ones();
  saved.map.objects.Insert(ObjectId(1), object);
  KeyframeImages images = ImagesByTime(saved);
  images.at(KeyframeId(4)).path = "caf\xE9.png";
  ExportNerfstudio(folder.path(), saved, images);
  ExportGltf(folder / "a.gltf", saved);
  ExportGltf(folder / "a.glb", saved);
  for (const char* name : {"transforms.json", "a.gltf"})
    EXPECT_THAT(nlohmann::json::parse(folder.Read(name)).dump(), HasSubstr("caf\uFFFD")) << name;
}

TEST_F(MapExport, ColorsAreThoseOfThePixels) {
  const SavedMap saved = ExactMap(
      {WithDistortion({.width = 640, .height = 480, .fx = 220, .fy = 220, .cx = 319, .cy = 240},
                      {-0.05, 0.01, 0, 0, 0})});
  KeyframeImages images = ImagesByTime(saved);
  // Left of the middle red, right of it blue, in binary PPM.
  std::string ppm = "P6\n640 480\n255\n";
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x)
      ppm += x < 320 ? std::string("\xC8\0\0", 3) : std::string("\0\0\xC8", 3);
  images.at(KeyframeId(1)).path = "a.ppm";
  folder.Write("a.ppm", ppm);
  const auto colors = ColorsOfLandmarks(saved.map, images, folder.path());
  ASSERT_EQ(colors.size(), saved.map.landmarks.size());
  const Keyframe& keyframe = saved.map.keyframes.At(KeyframeId(1));
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const float x = keyframe.features->keypoints[i].px.x();
    if (std::abs(x - 319) < 3) continue;
    EXPECT_EQ(colors.at(keyframe.landmarks[i]), x < 319 ? (Rgb{200, 0, 0}) : (Rgb{0, 0, 200})) << x;
  }
  EXPECT_EQ(ColorsOfLandmarks(saved.map, ImagesByTime(saved), folder.path()).begin()->second,
            kLandmarkColor);
}

TEST_F(MapExport, EveryMapCanBeWritten) {
  Rng rng(5);
  for (const bool empty : {false, true}) {
    SavedMap saved = RandomMap(
        empty ? RandomMapOptions{.keyframes = 3, .landmarks = 0, .objects = 0} : RandomMapOptions{},
        rng);
    if (empty) saved.trajectory.clear();
    ExportPly(folder / "a.ply", saved, true);
    ExportGltf(folder / "a.gltf", saved);
    ExportGltf(folder / "a.glb", saved);
    ExportTum(folder / "a.txt", saved);
    ExportColmap(folder.path(), saved, ImagesByTime(saved));
    const auto gltf = nlohmann::json::parse(folder.Read("a.gltf"));
    EXPECT_EQ(gltf["asset"]["version"], "2.0");
    EXPECT_EQ(LoadTrajectory(folder / "a.txt").size(),
              empty ? saved.map.keyframes.size() : FinalTrajectories(saved)[0].size());
  }
  EXPECT_INPUT_ERROR(ExportPly(folder / "no/a.ply", SavedMap(), false),
                     HasSubstr("cannot be written"));
}

// A camera follows the trajectory of each recording; poses at one time, as floats, are one.
TEST_F(MapExport, TheCameraIsAnimated) {
  SavedMap saved = ExactMap({kCamera});
  saved.trajectory.clear();
  ExportGltf(folder / "a.gltf", saved);
  const auto gltf = nlohmann::json::parse(folder.Read("a.gltf"));
  const auto poses = FinalTrajectories(saved).at(0);
  ASSERT_EQ(gltf["animations"].size(), 1U);
  const auto& animation = gltf["animations"][0];
  const auto& times = gltf["accessors"][animation["samplers"][0]["input"].get<size_t>()];
  EXPECT_EQ(times["count"], poses.size());
  EXPECT_EQ(times["min"][0], 0);
  EXPECT_NEAR(times["max"][0], poses.back().timestamp - poses.front().timestamp, 1e-4);
  const auto& node = gltf["nodes"][animation["channels"][1]["target"]["node"].get<size_t>()];
  EXPECT_EQ(node["name"], "camera");
  EXPECT_TRUE(node.contains("camera"));
  // Nothing of an animation is bound by a renderer.
  for (const auto& sampler : animation["samplers"])
    for (const char* key : {"input", "output"}) {
      const auto& accessor = gltf["accessors"][sampler[key].get<size_t>()];
      EXPECT_FALSE(gltf["bufferViews"][accessor["bufferView"].get<size_t>()].contains("target"));
    }
}

TEST(MapScene, TheSphereIsClosedAndFacesOutwards) {
  const TriangleMesh sphere = UnitSphere();
  EXPECT_EQ(sphere.vertices.size() - 3 * sphere.triangles.size() / 2 + sphere.triangles.size(),
            2U);  // Euler
  for (const auto& [a, b, c] : sphere.triangles) {
    const Eigen::Vector3d &p = sphere.vertices[a], &q = sphere.vertices[b], &r = sphere.vertices[c];
    EXPECT_GT((q - p).cross(r - p).dot(p + q + r), 0);
    EXPECT_NEAR(p.norm(), 1, 1e-12);
  }
}

TEST(MapScene, UpIsUp) {
  const SavedMap saved = ExactMap({kCamera});
  for (const std::optional<Eigen::Vector3d>& up :
       {std::optional<Eigen::Vector3d>(),
        std::optional(Eigen::Vector3d(0.1, -0.9, 0.3).normalized())}) {
    Map map = saved.map;
    map.up = up;
    const Eigen::Matrix3d y_up = YUpFromWorld(map), z_up = ZUpFromWorld(map);
    EXPECT_NEAR(y_up.determinant(), 1, 1e-12);
    EXPECT_NEAR(z_up.determinant(), 1, 1e-12);
    if (up) {
      EXPECT_LT((y_up * *up - Eigen::Vector3d::UnitY()).norm(), 1e-12);
      EXPECT_LT((z_up * *up - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
    } else {
      EXPECT_GT((y_up * -Eigen::Vector3d::UnitY()).y(), 0.9);  // the up direction of the cameras
    }
  }
}

}  // namespace
}  // namespace oaslam
