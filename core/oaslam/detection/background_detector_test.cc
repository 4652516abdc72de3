#include "oaslam/background_detector.h"

#include <atomic>
#include <chrono>
#include <semaphore>
#include <thread>

#include "expect_input_error.h"
#include "forked.h"

namespace oaslam {
namespace {

using testing::AnyOf;

std::vector<int> Frames(const std::vector<BackgroundDetector::Result>& results) {
  std::vector<int> frames;
  for (const auto& r : results) frames.push_back(r.frame);
  return frames;
}

TEST(BackgroundDetector, TakesTheNewestImageWheneverItIsFree) {
  std::binary_semaphore begun(0), go_on(0);
  BackgroundDetector detector([&](const cv::Mat& image) {
    begun.release();
    go_on.acquire();
    return std::vector<Detection>{
        {.category_id = image.at<int>(0), .score = 0.9, .box = {0, 0, 1, 1}}};
  });
  const auto offer = [&](int frame) {
    detector.Offer(frame, cv::Mat(1, 1, CV_32S, cv::Scalar(10 * frame)));
  };
  offer(0);
  begun.acquire();
  EXPECT_TRUE(detector.Take().empty());  // nothing waits for it
  for (int i = 1; i < 8; ++i) offer(i);
  go_on.release();
  begun.acquire();  // of the images 1 to 7 it took 7
  go_on.release();
  detector.Wait();
  const auto results = detector.Take();
  EXPECT_THAT(Frames(results), ElementsAre(0, 7));
  EXPECT_EQ(results[1].detections.at(0).category_id, 70);
  EXPECT_TRUE(detector.Take().empty());
  EXPECT_EQ(detector.images(), 2);
  EXPECT_GT(detector.busy_ms(), 0);
}

// Frames begin anew after a reset: nothing of before must be taken for one of them.
TEST(BackgroundDetector, ForgetsWhatIsUnderWay) {
  std::binary_semaphore begun(0), go_on(0);
  BackgroundDetector detector([&](const cv::Mat&) {
    begun.release();
    go_on.acquire();
    return std::vector<Detection>();
  });
  const cv::Mat image(1, 1, CV_32S);
  detector.Offer(7, image);
  begun.acquire();
  detector.Offer(8, image);
  detector.Clear();
  go_on.release();
  detector.Wait();
  EXPECT_TRUE(detector.Take().empty());
  EXPECT_EQ(detector.images(), 1);
  detector.Offer(0, image);
  begun.acquire();
  go_on.release();
  detector.Wait();
  EXPECT_THAT(Frames(detector.Take()), ElementsAre(0));
}

TEST(BackgroundDetector, RefusesToRunNothing) {
  EXPECT_INPUT_ERROR(BackgroundDetector{nullptr}, HasSubstr("no function"));
}

TEST(BackgroundDetector, TheCallerMayReuseTheImage) {
  std::binary_semaphore go_on(0);
  BackgroundDetector detector([&](const cv::Mat& image) {
    go_on.acquire();
    return std::vector<Detection>{
        {.category_id = image.at<int>(0), .score = 0.9, .box = {0, 0, 1, 1}}};
  });
  cv::Mat image(1, 1, CV_32S, cv::Scalar(5));
  detector.Offer(0, image);
  image = 6;
  go_on.release();
  detector.Wait();
  EXPECT_EQ(detector.Take().at(0).detections.at(0).category_id, 5);
}

TEST(BackgroundDetector, FailuresComeOutOnTheCallersThread) {
  BackgroundDetector detector(
      [](const cv::Mat&) -> std::vector<Detection> { throw InputError("broken network"); });
  detector.Offer(3, cv::Mat(1, 1, CV_8U));
  detector.Wait();
  EXPECT_THROW(detector.Take(), InputError);
  EXPECT_TRUE(detector.Take().empty());
}

TEST(BackgroundDetector, MayEndAtAnyTime) {
  for (int offers = 0; offers < 4; ++offers) {
    std::atomic<int> begun = 0, ended = 0;
    {
      BackgroundDetector detector([&](const cv::Mat&) {
        ++begun;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        ++ended;
        return std::vector<Detection>{};
      });
      for (int i = 0; i < offers; ++i) detector.Offer(i, cv::Mat(1, 1, CV_8U));
    }
    EXPECT_LE(begun, offers);
    EXPECT_EQ(begun, ended);  // the destructor waited for the present image
  }
}

TEST(BackgroundDetector, OfWhatWaitsAtTheEndTheNewestAtMostIsLookedAt) {
  std::counting_semaphore<> begun(0), go_on(0);
  std::vector<int> seen;
  {
    BackgroundDetector detector([&](const cv::Mat& image) {
      seen.push_back(image.at<int>(0));
      begun.release();
      go_on.acquire();
      return std::vector<Detection>{};
    });
    const auto offer = [&](int frame) {
      detector.Offer(frame, cv::Mat(1, 1, CV_32S, cv::Scalar(frame)));
    };
    offer(0);
    begun.acquire();
    for (int i = 1; i < 6; ++i) offer(i);
    go_on.release(6);
  }
  EXPECT_THAT(seen, AnyOf(ElementsAre(0), ElementsAre(0, 5)));
}

TEST(BackgroundDetector, IsLeftAloneByAForkedChild) {
  std::binary_semaphore begun(0), go_on(0);
  auto detector = std::make_unique<BackgroundDetector>([&](const cv::Mat&) {
    begun.release();
    go_on.acquire();
    return std::vector<Detection>{};
  });
  detector->Offer(0, cv::Mat(1, 1, CV_8U));
  begun.acquire();
  EXPECT_TRUE(HoldsInChild([&] {
    EXPECT_THROW(detector->Wait(), ForkError);
    detector.reset();
    return !testing::Test::HasFailure();
  }));
  go_on.release();
  detector->Wait();
  EXPECT_EQ(detector->images(), 1);
}

}  // namespace
}  // namespace oaslam
