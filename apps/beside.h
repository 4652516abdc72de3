#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace oaslam::apps {

// The form of a command for people: `oaslam run walk.mp4`. What is not said is chosen, and results
// are written beside the images. With --images instead, the form for scripts, nothing is chosen.
struct PlainForm {
  std::string images;  // positional argument; empty: the other form
  bool force = false;  // write into a folder that has results already

  bool IsUsed() const { return !images.empty(); }
};

// The positional argument, which excludes `images`, and --force.
void AddPlainForm(CLI::App& app, PlainForm& form, CLI::Option* images);

// The folder for results beside images: "walk.mp4" and the suffix ".oaslam" give "walk.oaslam" in
// the same folder; of a camera "webcam:0", "webcam_0.oaslam" in the working folder.
std::string FolderBeside(const std::string& images, const std::string& suffix);

// Throws InputError if the folder has results already and is not to be overwritten.
void EnsureNoResults(const std::string& folder, const PlainForm& form);

}  // namespace oaslam::apps
