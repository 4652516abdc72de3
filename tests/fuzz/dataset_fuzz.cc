#include <array>

#include "fuzz.h"
#include "oaslam/camera_file.h"
#include "oaslam/images/bit_depth.h"
#include "oaslam/images/dataset.h"
#include "oaslam/images/heif_file.h"
#include "oaslam/images/sensor_data.h"

namespace {

using oaslam::TempFolder;

// One file of a dataset is the input, the others stand still.
struct FuzzedDataset {
  const char* file;
  std::initializer_list<std::pair<const char*, const char*>> others;
};

constexpr const char* kPixels = "P5\n1 1\n255\n1";
const std::array<FuzzedDataset, 18> kDatasets = {{
    {"mav0/cam0/data.csv", {}},
    {"mav0/state_groundtruth_estimate0/data.csv",
     {{"mav0/cam0/data.csv", "#[ns]\n1403636579763555584,a.pgm\n"}}},
    {"mav0/cam0/sensor.yaml",
     {{"mav0/cam0/data.csv", "#[ns]\n1403636579763555584,a.pgm\n"},
      {"mav0/state_groundtruth_estimate0/data.csv",
       "#[ns],x,y,z,q_w,q_x,q_y,q_z\n1,0,0,0,1,0,0,0\n"}}},
    {"times.txt", {{"image_0/0.pgm", kPixels}, {"image_0/1.pgm", kPixels}}},
    {"poses.txt", {{"image_0/0.pgm", kPixels}, {"times.txt", "0\n"}}},
    {"frame-000000.pose.txt", {{"frame-000000.color.png", kPixels}}},
    {"metadata", {{"rgbd/0.jpg", kPixels}}},
    {"transforms.json", {{"images/0.png", kPixels}}},
    {"sparse/0/images.txt",
     {{"images/0.png", kPixels}, {"sparse/0/cameras.txt", "1 PINHOLE 9 9 9 9 4 4\n"}}},
    {"sparse/0/images.bin", {{"images/0.png", kPixels}, {"sparse/0/cameras.bin", ""}}},
    {"sparse/0/cameras.bin", {{"images/0.png", kPixels}}},
    {"odometry.csv", {{"rgb.mp4", ""}, {"camera_matrix.csv", ""}}},
    {"livingRoom0.gt.freiburg", {{"rgb/0.png", kPixels}, {"associations.txt", ""}}},
    {"frame_00000.json", {{"frame_00000.jpg", kPixels}, {"depth_00000.png", kPixels}}},
    {"keyframes/cameras/0.json", {{"keyframes/images/0.jpg", kPixels}}},
    {"images.txt", {{"images/0.png", kPixels}, {"cameras.txt", "1 PINHOLE 9 9 9 9 4 4\n"}}},
    {"images.bin", {{"cameras.bin", ""}}},
    {"associations.txt", {{"rgb.txt", "1 rgb/1.png\n"}, {"depth/1.png", kPixels}}},
}};

const TempFolder& FolderOf(size_t i) {
  static std::array<TempFolder, kDatasets.size()> folders;
  static std::array<bool, kDatasets.size()> are_made{};
  if (!are_made[i])
    for (const auto& [name, text] : kDatasets[i].others) folders[i].Write(name, text);
  are_made[i] = true;
  return folders[i];
}

}  // namespace

// The first byte chooses the layout and the file of it; beyond these, what tells raw TIFF files and
// HEIF files apart.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  if (size == 0) return -1;
  const std::string text(fuzz::Text(data + 1, size - 1));
  const size_t which = data[0] % (kDatasets.size() + 2);
  if (which >= kDatasets.size())
    return fuzz::Try([&] {
      const std::vector<char> bytes(text.begin(), text.end());
      IsRawTiff(bytes);
      if (!IsHeif(bytes)) return;
      ExifOfHeif(bytes);
    });
  const TempFolder& folder = FolderOf(which);
  folder.Write(kDatasets[which].file, text);
  return fuzz::Try([&] {
    const auto found = FindTruth(folder.path(), {.quiet = true});
    if (!found) return;
    if (!found->camera.empty()) fuzz::Try([&] { LoadCamera(found->camera, {640, 480}); });
    if (found->truth) found->truth();
    if (found->named_truth) AtTimesOf(found->images, found->named_truth(), folder.path());
  });
}
