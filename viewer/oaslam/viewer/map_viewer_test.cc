#include "oaslam/map_viewer.h"

#include <opencv2/imgcodecs.hpp>

#include "desk_clip.h"
#include "expect_input_error.h"
#include "page_client.h"

namespace oaslam {
namespace {

using MapViewerTest = SlamWithMap;

TEST_F(MapViewerTest, ShowsImagesAndTheMapToAPage) {
  Slam slam = MakeSlam();
  slam.SetClassNames({{42, "teapot"}});
  MapViewer viewer(slam, {.port = 0, .title = "the desk"});
  EXPECT_THAT(AnswerTo(viewer.url(), "GET / HTTP/1.0\r\nHost: localhost\r\n\r\n"),
              HasSubstr("</html>"));
  // The application may use its buffer again.
  cv::Mat buffer;
  TrackingResult result;
  for (size_t i = 0; i < 60; ++i) {
    ImageInput input = WithDetections(i);
    input.image.copyTo(buffer);
    input.image = buffer;
    result = slam.Process(input);
    viewer.Show(slam, input, result);
    buffer.setTo(0);
  }
  ASSERT_EQ(result.state, TrackingState::kTracking);
  PageClient page(viewer.url());
  const auto read_until = [&](const auto& is_there) {
    DecodedMessage news = page.ReadUntil("update");
    while (!is_there(news.header)) news = page.ReadUntil("update");
    return news;
  };
  const DecodedMessage news = read_until([&](const nlohmann::json& header) {
    return header.contains("frame") && header["frame"]["frame"] == result.frame;
  });
  const cv::Mat picture = cv::imdecode(news.Array<uint8_t>("jpeg"), cv::IMREAD_GRAYSCALE);
  EXPECT_GT(cv::mean(picture)[0], 10);  // not that which the buffer shows now

  slam.Load(Path());
  viewer.ShowMap(slam);
  read_until([](const nlohmann::json& header) {
    return header.contains("status") && header["status"]["live"] == false;
  });
}

TEST_F(MapViewerTest, APortThatIsTakenIsNamed) {
  const Slam slam = MakeSlam();
  const MapViewer viewer(slam, {.port = 0});
  const int port = PortOf(viewer.url());
  EXPECT_INPUT_ERROR(MapViewer(slam, {.port = port}), HasSubstr(std::to_string(port)));
  EXPECT_INPUT_ERROR(MapViewer(slam, {.port = 70000}), HasSubstr("65535"));
}

}  // namespace
}  // namespace oaslam
