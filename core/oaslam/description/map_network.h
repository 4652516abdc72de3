#pragma once

#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>

#include "oaslam/description/weights_file.h"

namespace oaslam {

// Values at the cells of a grid over an image. Cell (0, 0) lies on pixel (0, 0).
struct CellMap {
  cv::Mat values;   // floats, 1 x channels x rows x columns
  int cell_px = 1;  // distance of cells in pixels of the image
  int channels() const { return values.size[1]; }
  int rows() const { return values.size[2]; }
  int columns() const { return values.size[3]; }
};

// The convolutions of the descriptor's network (Net.maps in train/net.py), run by OpenCV on the CPU
// on as many threads as cv::setNumThreads allows. Not thread-safe: it has buffers, which fit the
// image before; for images of another size they are made anew.
class MapNetwork {
 public:
  static constexpr int kFineChannels = 24, kCoarseChannels = 64;

  explicit MapNetwork(const DescriptorLayers& layers);

  struct Maps {
    CellMap fine, coarse;  // cells of 4 and 8 pixels; at least 4 x 4
  };
  // Computes the maps of a grey image of any size but 0. The maps are valid until the next call.
  // Throws cv::Exception where memory is short.
  Maps Run(const cv::Mat& grey);

 private:
  void FillInput(const cv::Mat& grey);

  cv::dnn::Net net_;
  cv::Mat input_;           // floats, 1 x 1 x rows x columns
  cv::Mat sums_, squares_;  // of the pixels in the window around each pixel
};

}  // namespace oaslam
