#pragma once

#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/images/dataset.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// What the finders of the layouts of datasets share.

struct DatasetFolder {
  std::string root;
  ImageSourceOptions options;

  std::string At(const std::string& path) const;
  bool Has(const std::string& path) const;
  // The path of the first of these that is there; empty: none.
  std::string First(std::initializer_list<const char*> paths) const;
  // The depth images in a folder of it, whose counts are millimetres unless `unit` is given;
  // nothing where there are none. `confidence`: a folder, as in DepthFiles.
  std::optional<DepthFiles> Depths(const char* folder, const char* confidence = "",
                                   double unit = 1e-3) const;
};

// The first three rows of a matrix. Throws InputError, which begins with `place`.
Rigid3 PoseOfMatrix(const std::vector<double>& rows, const std::string& place);
// Throws InputError where `count`, the number of `what` in a file, is not the number of images.
void CheckCount(const std::string& path, size_t count, const char* what, const std::string& folder,
                size_t images);

// Sets the truth of a dataset, after its images: `poses` reads those of images, by their paths.
// `has_times`: the times of the images are those of the recording.
void SetNamedTruth(std::function<std::vector<NamedPose>()> poses, bool has_times, Dataset& dataset);
// A pose with the OpenGL camera of ARKit and Nerfstudio (y up, looks along -z), with ours.
Rigid3 FromOpenGl(const Rigid3& pose);

// These throw InputError. The object in a file of JSON:
nlohmann::json ParseObject(const std::string& path);
// The numbers of a list, or of a list of lists: `count` or more.
std::vector<double> NumbersOf(const nlohmann::json& value, size_t count, const std::string& place);

// These functions return nothing where the folder is in another layout. They throw InputError.
std::optional<Dataset> FindEuRoC(const DatasetFolder& given);
std::optional<Dataset> FindKitti(const DatasetFolder& folder);
std::optional<Dataset> FindSevenScenes(const DatasetFolder& folder);
std::optional<Dataset> FindScanNet(const DatasetFolder& folder);
std::optional<Dataset> FindScannerApp(const DatasetFolder& folder);
std::optional<Dataset> FindPolycam(const DatasetFolder& given);
std::optional<Dataset> FindRecord3d(const DatasetFolder& folder);
std::optional<Dataset> FindStrayScanner(const DatasetFolder& folder);
std::optional<Dataset> FindMarsLogger(const DatasetFolder& folder);
std::optional<Dataset> FindNerfstudio(const DatasetFolder& folder);
std::optional<Dataset> FindColmap(const DatasetFolder& folder);
std::optional<Dataset> FindTum(const DatasetFolder& folder);
std::optional<Dataset> FindIclNuim(const DatasetFolder& folder);

}  // namespace oaslam
