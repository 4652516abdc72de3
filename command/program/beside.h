#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "detector_options.h"

namespace oaslam::apps {

// The form of run and localize for people: `oaslam run walk.mp4`. Unless told otherwise, the
// default detector is used if it is here, and results are written beside the images. With --images
// instead, the form for scripts, there is a detector only where one is given, --out must be, and
// results that are there are overwritten.
struct PlainForm {
  std::string images;  // positional argument; empty: the other form
  bool force = false;  // write into a folder that has results already

  bool IsUsed() const { return !images.empty(); }
};

// The positional argument, which excludes `images`, and --force.
void AddPlainForm(CLI::App& app, PlainForm& form, CLI::Option* images);

// The folder for results beside images: "walk.mp4" and the suffix ".oaslam" give "walk.oaslam" in
// the same folder; of a camera "webcam:0", "webcam_0.oaslam" in the working folder. Throws
// InputError for "/".
std::string FolderBeside(const std::string& images, const std::string& suffix);

// The options that Complete fills in where the command line leaves them out.
struct PlainChoices {
  std::string& images;
  const std::string& detections;
  DetectorSettings& detector;
  std::string& out;
};

// If the short form is used, sets the images, the detector and the folder, whose name ends with
// `suffix`. Throws InputError if there are no such images, or if the folder has results already and
// --force is not given.
void Complete(const PlainForm& form, const std::string& suffix, const PlainChoices& choices);

}  // namespace oaslam::apps
