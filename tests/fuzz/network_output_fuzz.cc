#include <bit>
#include <cstring>

#include "fuzz.h"
#include "oaslam/detection/layout_check.h"
#include "oaslam/detection/yolo_output.h"

// The output of a network that anybody may have made: its shape and metadata in the first bytes,
// then its numbers.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  constexpr size_t kHeader = 8;
  if (size < kHeader) return 0;
  const uint8_t* const choice = data;
  data += kHeader;
  size -= kHeader;
  // 64 x 64: 84 cells.
  const int rows = choice[0] % 2 == 0 ? 84 : choice[1], columns = choice[2] % 100;
  HeadMetadata head;
  const char* const tasks[] = {"", "detect", "segment", "pose", "obb"};
  head.task = tasks[choice[3] % 5];
  head.keypoint_values = choice[4] % 60;
  head.is_suppressed = choice[5] % 2 == 1;
  head.is_rt_detr = choice[5] % 7 == 6;
  for (int i = 0; i < choice[6] % 90; ++i) head.names[i] = "";
  const std::vector<int> shape{1, choice[0] % 4 < 2 ? rows : columns,
                               choice[0] % 4 < 2 ? columns : rows};
  cv::Mat output(shape, CV_32F, cv::Scalar(0));
  if (!output.empty())
    std::memcpy(output.data, data, std::min(size, output.total() * sizeof(float)));
  const cv::Size network_size(64, 64);
  for (const auto wanted :
       {DetectorLayout::kAuto, DetectorLayout::kYolox, DetectorLayout::kYolov5,
        DetectorLayout::kYolov8, DetectorLayout::kEndToEnd, DetectorLayout::kRtDetr}) {
    const auto format =
        RecognizeOutput(output, network_size, wanted, head, choice[7] % 3 == 0 ? choice[7] / 3 : 0);
    if (!format) continue;
    LayoutCheck().Add(output, *format, network_size,
                      DecodeCandidates(output, *format, network_size, 0.2));
    for (const Candidate& found :
         JoinLabels(SuppressPerClass(DecodeOutput(output, *format, network_size, 0.2), 0.45)))
      MaskCoefficients(output, *format, found.place);
  }
  return 0;
}
