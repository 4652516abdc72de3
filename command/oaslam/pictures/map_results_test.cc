#include "oaslam/pictures/map_results.h"

#include <nlohmann/json.hpp>

#include "expect_input_error.h"
#include "oaslam/pictures/top_view.h"
#include "random_map.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

Map MapWithObjects() {
  Rng rng(5);
  Map map = RandomMap({.objects = 3}, rng).map;
  map.objects.MutableAt(ObjectId(1)).state = ObjectState::kMapped;
  map.objects.MutableAt(ObjectId(2)).state = ObjectState::kInitialized;
  Object& cup = map.objects.MutableAt(ObjectId(3));
  cup.state = ObjectState::kMapped;
  cup.category_id = 41;
  cup.ellipsoid = {{1.5, -2, 0.25}, {0.1, 0.2, 0.3}, Eigen::Quaterniond(-1, 0, 0, 0)};
  cup.total_observations = 77;
  for (ObjectObservation& o : cup.observations) o.score = 0.5;
  return map;
}

TEST(ObjectsJson, MappedObjectsWithKeysInOrder) {
  const TempFolder folder;
  Map map = MapWithObjects();
  for (const ObjectId id : map.objects.Ids()) map.objects.MutableAt(id).name.clear();
  SaveObjectsJson(folder / "o.json", map, {{41, "a \"cup\""}});
  const auto json = nlohmann::ordered_json::parse(folder.Read("o.json"));
  ASSERT_EQ(json.size(), 2u);
  std::vector<std::string> keys;
  for (const auto& [key, value] : json[1].items()) keys.push_back(key);
  EXPECT_THAT(keys, ElementsAre("id", "category_id", "category", "center", "half_axes", "rotation",
                                "observations", "score", "covariance_diag"));
  EXPECT_EQ(json[1]["id"], 3);
  EXPECT_EQ(json[1]["category"], "a \"cup\"");
  EXPECT_EQ(json[1]["center"], nlohmann::json::parse("[1.5, -2, 0.25]"));
  EXPECT_EQ(json[1]["rotation"], nlohmann::json::parse("[0, 0, 0, 1]"));
  EXPECT_EQ(json[1]["observations"], 77);
  EXPECT_EQ(json[1]["score"], 0.5);
  EXPECT_EQ(json[1]["covariance_diag"].size(), 7u);
  EXPECT_THAT(folder.Read("o.json"), Not(HasSubstr("-0,")));
  map.objects.MutableAt(ObjectId(3)).name = "the \"best\"";
  SaveObjectsJson(folder / "named.json", map, {});
  EXPECT_EQ(nlohmann::json::parse(folder.Read("named.json"))[1]["name"], "the \"best\"");
  SaveObjectsJson(folder / "none.json", Map(), {});
  EXPECT_TRUE(nlohmann::json::parse(folder.Read("none.json")).empty());
  EXPECT_INPUT_ERROR(SaveObjectsJson(folder / "no/o.json", Map(), {}),
                     HasSubstr("cannot be written"));
}

TEST(MapSvg, ShowsWhatIsThere) {
  const TempFolder folder;
  const Map map = MapWithObjects();
  MapPlot plot{.map = &map, .names = {{41, "cup"}}, .title = "Desk <1> & more"};
  for (int i = 0; i < 30; ++i)
    plot.trajectory.push_back(
        {i / 30.0, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1 * i, 0, 0))});
  SaveMapSvg(folder / "m.svg", plot);
  const std::string svg = folder.Read("m.svg");
  EXPECT_THAT(svg,
              HasSubstrs("Desk &lt;1&gt; &amp; more", ">cup</text>", "map unit", "trajectory"));
  EXPECT_THAT(svg, AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf")),
                         Not(HasSubstr("ground truth")), Not(HasSubstr("localized"))));
  plot.groundtruth = plot.localized = plot.trajectory;
  SaveMapSvg(folder / "m.svg", plot);
  EXPECT_THAT(folder.Read("m.svg"), HasSubstrs("ground truth", "30 localized"));
}

TEST(MapSvg, DegenerateMaps) {
  const TempFolder folder;
  Map map;
  SaveMapSvg(folder / "m.svg", {.map = &map});
  EXPECT_THAT(folder.Read("m.svg"), Not(HasSubstr("nan")));
  SaveMapSvg(folder / "m.svg", {.map = &map, .trajectory = {{1, {}}}});
  EXPECT_THAT(folder.Read("m.svg"), AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
}

TEST(TopView, FirstCameraLooksUpThePage) {
  const Rigid3 camera(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX())),
                      Eigen::Vector3d::Zero());  // tilted
  const TopAxes axes = FindTopAxes({camera}, Eigen::Vector3d(0, -2, 0));
  EXPECT_NEAR(axes(camera.rotation * Eigen::Vector3d::UnitZ()).x(), 0, 1e-12);
  EXPECT_GT(axes(camera.rotation * Eigen::Vector3d::UnitZ()).y(), 0.5);
  EXPECT_GT(axes.right.cross(axes.forward).dot(-Eigen::Vector3d::UnitY()), 0.999);
}

TEST(TopView, FarPointsDoNotMoveTheQuantiles) {
  Points2 points;
  for (int i = 0; i < 100; ++i) points.push_back({i, -i});
  points.push_back({1e6, 1e6});
  const Extent extent = QuantileExtent(points, 0.05);
  EXPECT_NEAR(extent.low.x(), 5, 1);
  EXPECT_NEAR(extent.high.x(), 95, 1);
}

}  // namespace
}  // namespace oaslam
