#pragma once

#include <memory>
#include <string>

#include "oaslam/detection/network.h"

namespace oaslam {

// The implementations behind LoadNetwork, each in a file of its own. ONNX Runtime's is built where
// CMake finds that library (OASLAM_ONNXRUNTIME).
std::unique_ptr<Network> LoadByOpenCv(const std::string& path);
std::string OpenCvName();
std::unique_ptr<Network> LoadByOnnxRuntime(const std::string& path);
std::string OnnxRuntimeName();

}  // namespace oaslam
