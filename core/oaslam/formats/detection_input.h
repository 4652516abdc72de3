#pragma once

#include <string>
#include <vector>

#include "oaslam/class_names.h"
#include "oaslam/detection_file.h"

namespace oaslam {

struct DetectionFile {
  std::vector<ImageDetections> images;
  ClassNames categories{};  // the names that COCO's "categories" give; empty: there are none
  bool is_coco = false;     // COCO results; else OA-SLAM's own form
  // The file identifies images by numbers, and has no list of their names; MatchedToImages may find
  // the names.
  bool has_numbers_for_names = false;
  bool in_shares = false;  // boxes are shares of the image's width and height, as YOLO's are
};

// Reads the files that LoadDetections reads. The result tells what is ambiguous in the file;
// LoadDetections logs it. Throws InputError.
DetectionFile ReadDetectionFile(const std::string& path);
// Converts boxes that are shares to pixels of images of this size.
void ConvertShares(int width, int height, DetectionFile& file);
// For use without images: throws InputError where only the images could tell the names
// (has_numbers_for_names), or the pixels of boxes (in_shares).
void CheckNames(const DetectionFile& file, const std::string& path);

// Whether the paths of two images may be those of files in one folder: one folder is the end of the
// other.
bool AreInSameFolder(const std::string& one, const std::string& other);

// How the 80 classes of COCO are numbered.
enum class CocoNumbers {
  k80,       // 0 to 79, as detectors number them
  k91,       // 1 to 90, with gaps, as COCO's own files do
  kUnclear,  // the categories of a file fit both
};
CocoNumbers NumbersOf(const std::vector<ImageDetections>& images);
// Replaces COCO's own numbers by 0 to 79.
void Renumber91To80(std::vector<ImageDetections>& images);
// Replaces each category by the number that its name has in `wanted`. False where a category has no
// name or the name is not there; then nothing is changed.
bool RenumberByName(const ClassNames& names, const ClassNames& wanted,
                    std::vector<ImageDetections>& images);

// The detections with the names of the images to which they belong, so that each image finds its
// own: by name, without extension, or by the number in the name where that is unique (counted from
// 0 or from 1). `images`: all names of a source, or paths; where these differ in the folder alone,
// so do the names of detections. `path`: of the detections. Throws InputError, with an example of
// both, where no name belongs to an image.
DetectionTable MatchedToImages(const DetectionTable& detections,
                               const std::vector<std::string>& images, const std::string& path);

}  // namespace oaslam
