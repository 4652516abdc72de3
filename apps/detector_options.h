#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "common.h"
#include "oaslam/detection/detector.h"

namespace oaslam::apps {

// Options of the commands that can run an object detector.
struct DetectorSettings {
  std::string model;  // path, empty: none
  std::string layout = "auto";
  int size = 0;  // of the network's square input, 0: what the file says
  double min_score = DetectorOptions{}.min_score;
};

// --detector, --detector-layout, --detector-size, --detector-min-score; `settings` must outlive the
// parsing. Returns the option --detector.
CLI::Option* AddDetectorOptions(CLI::App& app, DetectorSettings& settings);

// Nothing where no model was given. Throws InputError.
std::unique_ptr<Detector> LoadDetector(const DetectorSettings& settings);

// The classes: of --classes, else the names of the detector's file (which may be null or have
// none), else COCO's.
Classes ClassesFor(const CommonOptions& common, const Detector* detector);

}  // namespace oaslam::apps
