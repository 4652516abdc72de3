#include <fmt/format.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/dnn.hpp>

#include "oaslam/detection/network_backends.h"
#include "oaslam/images/quiet_opencv.h"

namespace oaslam {
namespace {

NetworkError ErrorOf(const cv::Exception& error) {
  return NetworkError(fmt::format("{} cannot run this network: {}", OpenCvName(), error.err));
}

class OpenCvNetwork : public Network {
 public:
  explicit OpenCvNetwork(const std::string& path)
      : net_(cv::dnn::readNetFromONNX(path)), output_names_(net_.getUnconnectedOutLayersNames()) {
    net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  }

  std::vector<cv::Mat> Run(const cv::Mat& image) override {
    std::vector<cv::Mat> outputs;
    try {
      net_.setInput(image);
      net_.forward(outputs, output_names_);
    } catch (const cv::Exception& error) {
      throw ErrorOf(error);
    }
    for (cv::Mat& output : outputs)
      if (output.depth() != CV_32F) output.release();
    return outputs;
  }

 private:
  cv::dnn::Net net_;
  std::vector<cv::String> output_names_;
};

}  // namespace

std::string OpenCvName() { return "OpenCV " + cv::getVersionString(); }

std::unique_ptr<Network> LoadByOpenCv(const std::string& path) {
  const QuietOpenCv quiet;
  try {
    return std::make_unique<OpenCvNetwork>(path);
  } catch (const cv::Exception& error) {
    throw ErrorOf(error);
  }
}

}  // namespace oaslam
