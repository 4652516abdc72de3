#pragma once

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

#include "common.h"
#include "oaslam/detection/turned_detector.h"
#include "oaslam/detector.h"
#include "oaslam/image_source.h"

namespace oaslam::apps {

// Options of commands that can run an object detector.
struct DetectorSettings {
  std::string model;  // a file, a name, "default", or "none"; empty: none
  std::string layout = "auto";
  std::string backend = "auto";
  int size = 0;  // side of the network's square input; 0: that of the file
  double min_score = DetectorOptions{}.min_score;
  std::string turn = "auto";  // degrees clockwise that bring the images upright
  int every = 0;              // every Nth image is looked at; 0: those whose view has changed

  bool IsGiven() const { return !model.empty() && model != "none"; }
};

// --detector, --detector-layout, --detector-size, --detector-min-score, --detector-backend;
// `settings` must outlive the parsing. Returns the option --detector.
CLI::Option* AddDetectorOptions(CLI::App& app, DetectorSettings& settings);
// --detect-every.
void AddDetectEveryOption(CLI::App& app, DetectorSettings& settings);

// The clockwise quarters of --detector-turn; nothing for auto.
std::optional<int> TurnOf(const DetectorSettings& settings);
// The turn of an image by gravity in the camera's frame, where it is given, or by its EXIF.
std::optional<int> KnownTurn(const InputImage& image,
                             const std::optional<Eigen::Vector3d>& gravity_in_cam);
// What the first seconds of recorded images tell of their turn; longer where these say that the
// images are turned. Keeps a reference to the detector.
TurnedDetector FindTurn(const std::string& images, ImageSourceOptions range, Detector& detector);

// Nothing where no model was given. Throws InputError.
std::unique_ptr<Detector> LoadDetector(const DetectorSettings& settings);

// The name of a detector or of its file.
std::string NameOfDetector(const DetectorSettings& settings);

// The classes of --classes, else those named in the detector's file (the detector may be null or
// have no names), else `categories` of a file of detections, else COCO's.
Classes ClassesFor(const CommonOptions& common, const Detector* detector,
                   const ClassNames& categories = {});

}  // namespace oaslam::apps
