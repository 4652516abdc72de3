#pragma once

#include <CLI/CLI.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common.h"
#include "oaslam/slam.h"

namespace oaslam::apps {

// --mask: an image, auto (empty, too) or none.
void AddMaskOption(CLI::App& app, std::string& mask);

// The mask of a source of images, for Slam::SetMask: as --mask says it, else the calibration's key
// `mask`. With auto, it is looked for in the first seconds of recorded images, which is said; empty
// where none is found there, or where images are still to come. `camera`: as --camera. Throws
// InputError.
cv::Mat MaskFor(const std::string& mask, const std::string& camera, const std::string& images,
                const CommonOptions& common);

// Gives a mask of MaskFor to what is used with a camera; for `none`, one that hides nothing.
// Without either, parts that move with the camera are found in the images that come.
void UseMask(const std::string& option, const cv::Mat& mask, Slam& slam, const Camera& camera);

// Removes the boxes of which a mask hides more than half: they are of what moves with the camera.
void EraseHidden(const cv::Mat& mask, std::vector<Detection>& detections);

}  // namespace oaslam::apps
