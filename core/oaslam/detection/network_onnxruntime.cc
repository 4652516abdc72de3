#include <fmt/format.h>
#include <onnxruntime_cxx_api.h>

#include <algorithm>

#include "oaslam/detection/network_backends.h"

namespace oaslam {
namespace {

NetworkError ErrorOf(const Ort::Exception& error) {
  return NetworkError(
      fmt::format("{} cannot run this network: {}", OnnxRuntimeName(), error.what()));
}

const Ort::Env& Environment() {
  static const Ort::Env environment(ORT_LOGGING_LEVEL_FATAL, "oaslam");
  return environment;
}

Ort::SessionOptions Options() {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(1);
  return options;
}

// A copy of a tensor of floats; empty for other values.
cv::Mat ToMat(const Ort::Value& value) {
  if (!value.HasValue() || !value.IsTensor()) return {};
  const Ort::TensorTypeAndShapeInfo info = value.GetTensorTypeAndShapeInfo();
  const std::vector<int64_t> shape = info.GetShape();
  if (info.GetElementType() != ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT || shape.empty() ||
      shape.size() > CV_MAX_DIM)
    return {};
  cv::Mat tensor(std::vector<int>(shape.begin(), shape.end()), CV_32F);
  std::copy_n(value.GetTensorData<float>(), info.GetElementCount(),
              reinterpret_cast<float*>(tensor.data));
  return tensor;
}

class OnnxRuntimeNetwork : public Network {
 public:
  explicit OnnxRuntimeNetwork(const std::string& path)
      : session_(Environment(), path.c_str(), Options()) {
    Ort::AllocatorWithDefaultOptions allocator;
    input_name_ = session_.GetInputNameAllocated(0, allocator).get();
    for (size_t i = 0; i < session_.GetOutputCount(); ++i)
      output_names_.emplace_back(session_.GetOutputNameAllocated(i, allocator).get());
  }

  std::vector<cv::Mat> Run(const cv::Mat& image) override {
    try {
      const std::vector<int64_t> shape(image.size.p, image.size.p + image.dims);
      // The library asks for writable memory, but does not write to an input.
      const Ort::Value input = Ort::Value::CreateTensor<float>(
          Ort::MemoryInfo::CreateCpu(OrtDeviceAllocator, OrtMemTypeDefault),
          const_cast<float*>(image.ptr<float>()), image.total(), shape.data(), shape.size());
      const char* const input_name = input_name_.c_str();
      std::vector<const char*> output_names;
      for (const std::string& name : output_names_) output_names.push_back(name.c_str());
      std::vector<cv::Mat> outputs;
      for (const Ort::Value& value :
           session_.Run({}, &input_name, &input, 1, output_names.data(), output_names.size()))
        outputs.push_back(ToMat(value));
      return outputs;
    } catch (const Ort::Exception& error) {
      throw ErrorOf(error);
    }
  }

 private:
  Ort::Session session_;
  std::string input_name_;
  std::vector<std::string> output_names_;
};

}  // namespace

std::string OnnxRuntimeName() { return "ONNX Runtime " + Ort::GetVersionString(); }

std::unique_ptr<Network> LoadByOnnxRuntime(const std::string& path) {
  try {
    return std::make_unique<OnnxRuntimeNetwork>(path);
  } catch (const Ort::Exception& error) {
    throw ErrorOf(error);
  }
}

}  // namespace oaslam
