#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <opencv2/imgcodecs.hpp>

#include "oaslam/service/localize.h"
#include "oaslam/util/base64.h"
#include "random_map.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

class GeoPoseSearch : public testing::Test {
 protected:
  GeoPoseSearch() {
    Rng rng(3);
    SaveMap(folder_ / "made", RandomMap({}, rng));
    ServiceOptions options;
    options.store = OpenMapStore(folder_.path());
    options.models = std::make_shared<const ModelLibrary>();
    state_ = std::make_shared<ServiceState>(std::move(options), io_.get_executor());
  }
  void PutAt(const std::string& map, double latitude) {
    const auto point = [&](std::array<double, 3> in_map, double north_deg, double height) {
      return Json{{"map", in_map},
                  {"latitude", latitude + north_deg},
                  {"longitude", 11},
                  {"height", height}};
    };
    state_->shelf.store().Put(map, folder_ / "made");
    state_->shelf.store().SetGeoreference(
        map, Json{{"points",
                   {point({0, 0, 0}, 0, 0), point({9, 0, 0}, 1e-4, 0), point({0, 9, 0}, 0, 9)}}}
                 .dump());
  }
  GeoPoseReply AskAt(double latitude) {
    std::vector<uchar> image;
    cv::imencode(".png", cv::Mat::zeros(480, 640, CV_8UC1), image);
    const Json request{
        {"id", "1"},
        {"sensorReadings",
         {{"cameraReadings",
           {{{"imageBytes",
              EncodeBase64({reinterpret_cast<const char*>(image.data()), image.size()})}}}},
          {"geolocationReadings", {{{"latitude", latitude}, {"longitude", 11}}}}}}};
    return AnswerGeoPose(*state_, request.dump());
  }

  const TempFolder folder_;
  boost::asio::io_context io_{1};
  std::shared_ptr<ServiceState> state_;
};

// Its georeference tells where a map is: maps that are far away are not loaded.
TEST_F(GeoPoseSearch, OnlyMapsNearTheDeviceAreLoaded) {
  PutAt("far", 10);
  PutAt("near", 48);
  PutAt("nearer", 48.001);
  PutAt("farther", -48);
  folder_.Write("broken.map", "no map");
  state_->shelf.store().SetGeoreference("broken", state_->shelf.store().Georeference("near"));
  EXPECT_EQ(AskAt(30).status, 404);
  EXPECT_EQ(state_->shelf.loaded(), 0u);
  const GeoPoseReply reply = AskAt(48.001);
  EXPECT_EQ(reply.status, 404);
  EXPECT_THAT(reply.body, testing::Not(testing::HasSubstr("no map with a georeference")));
  EXPECT_EQ(state_->shelf.loaded(), 2u);
}

}  // namespace
}  // namespace oaslam
