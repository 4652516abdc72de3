#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "oaslam/detector.h"

namespace oaslam {

// What a library says of a network that it cannot run; begins with the library's name and version.
class NetworkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A neural network with one input, an image, run on the CPU: by ONNX Runtime on the thread of the
// caller, by OpenCV on as many as cv::setNumThreads allows. Not thread-safe.
class Network {
 public:
  virtual ~Network() = default;
  // `image`: floats, 1 x 3 x rows x columns. Returns all outputs, in the order of the file; one
  // that holds no floats is empty. Throws NetworkError.
  virtual std::vector<cv::Mat> Run(const cv::Mat& image) = 0;
};

// Loads a network in an ONNX file. Throws NetworkError where the library cannot load it or is not
// built in.
std::unique_ptr<Network> LoadNetwork(const std::string& path, NetworkBackend backend);

bool IsBuiltIn(NetworkBackend backend);
// Name and version of each library that is built in, e.g. "OpenCV 4.6.0"; that of kAuto first.
std::vector<std::string> NetworkBackends();

}  // namespace oaslam
