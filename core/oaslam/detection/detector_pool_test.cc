#include "oaslam/detection/detector_pool.h"

#include <gtest/gtest.h>

#include <chrono>
#include <semaphore>
#include <stdexcept>

namespace oaslam {
namespace {

std::vector<Detection> TellValue(const cv::Mat& image) {
  return {{.category_id = image.at<int>(0), .score = 0.9, .box = {0, 0, 1, 1}}};
}

cv::Mat Image(int value) { return cv::Mat(1, 1, CV_32S, cv::Scalar(value)); }

TEST(DetectorPool, EachFutureHasTheDetectionsOfItsImage) {
  DetectorPool pool({TellValue, TellValue, TellValue});
  std::vector<std::future<std::vector<Detection>>> found;
  for (int i = 0; i < 100; ++i) found.push_back(pool.Add(Image(i)));
  for (int i = 0; i < 100; ++i) EXPECT_EQ(found[static_cast<size_t>(i)].get()[0].category_id, i);
  EXPECT_EQ(pool.images(), 100);
}

TEST(DetectorPool, WorksOnAsManyImagesAsThereAreThreads) {
  std::counting_semaphore<2> begun(0), go_on(0);
  const auto wait = [&](const cv::Mat& image) {
    begun.release();
    go_on.acquire();
    return TellValue(image);
  };
  DetectorPool pool({wait, wait});
  auto first = pool.Add(Image(1)), second = pool.Add(Image(2));
  begun.acquire();
  begun.acquire();  // both, before either has ended
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  go_on.release(2);
  EXPECT_EQ(first.get()[0].category_id, 1);
  EXPECT_EQ(second.get()[0].category_id, 2);
  EXPECT_GE(pool.busy_ms(), 2 * 5);  // of both threads
}

TEST(DetectorPool, LargeImagesAreFewAhead) {
  const DetectorPool pool({TellValue, TellValue, TellValue, TellValue});
  EXPECT_EQ(pool.MostAhead(cv::Mat(480, 640, CV_8UC3)), 16U);
  const cv::Mat of_4k(2160, 3840, CV_8UC3);
  EXPECT_EQ(pool.MostAhead(of_4k), 10U);
  EXPECT_LT(10 * of_4k.total() * of_4k.elemSize(), size_t{256} << 20);
  EXPECT_EQ(pool.MostAhead(cv::Mat(20000, 20000, CV_8UC3)), 1U);
}

TEST(DetectorPool, RethrowsAndGoesOn) {
  DetectorPool pool({[](const cv::Mat& image) {
    if (image.at<int>(0) == 1) throw std::runtime_error("no");
    return TellValue(image);
  }});
  auto bad = pool.Add(Image(1)), good = pool.Add(Image(2));
  EXPECT_THROW(bad.get(), std::runtime_error);
  EXPECT_EQ(good.get()[0].category_id, 2);
}

TEST(DetectorPool, EndsWithImagesThatWait) {
  std::counting_semaphore<100> go_on(0);
  std::vector<std::future<std::vector<Detection>>> found;
  {
    DetectorPool pool({[&](const cv::Mat& image) {
      go_on.acquire();
      return TellValue(image);
    }});
    for (int i = 0; i < 10; ++i) found.push_back(pool.Add(Image(i)));
    go_on.release(100);
  }
  for (auto& future : found)
    EXPECT_EQ(future.wait_for(std::chrono::seconds(0)), std::future_status::ready);
}

}  // namespace
}  // namespace oaslam
