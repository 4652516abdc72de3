#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/camera_file.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/log.h"

namespace oaslam {
namespace {

// A calibration, and where it shows the direction (0.5, -0.3, 1), computed from the papers'
// formulas elsewhere.
struct Kind {
  struct {
    const char *name, *file;
    LensModel model;
    Eigen::Vector2d pixel;
  } what;
  const char* text;
};

constexpr auto kPinhole = LensModel::kPinhole;
constexpr auto kFisheye = LensModel::kFisheye;

const Kind kKinds[] = {
    {{"OpenVSLAM", "c.yaml", kFisheye, {555.099, 98.140}},
     "Camera.name: \"x\"\nCamera.setup: \"monocular\"\nCamera.model: \"fisheye\"\nCamera.fx: "
     "525\nCamera.fy: 525\nCamera.cx: 319.5\nCamera.cy: 239.5\nCamera.k1: -0.03\nCamera.k2: "
     "-0.004\nCamera.k3: 0.002\nCamera.k4: -0.0006\nCamera.cols: 640\nCamera.rows: 480\n"
     "Feature.num_levels: 8\n"},
    {{"stella_vslam", "c.yaml", kFisheye, {555.099, 98.140}},
     "Camera:\n  name: x\n  setup: monocular\n  model: fisheye\n  fx: 525\n  fy: 525\n  cx: 319.5\n"
     "  cy: 239.5\n  k1: -0.03\n  k2: -0.004\n  k3: 0.002\n  k4: -0.0006\n  fps: 30\n  cols: 640\n"
     "  rows: 480\n  color_order: RGB\nPreprocessing:\n  min_size: 800\n"},
    {{"VINS, Kannala-Brandt", "c.yaml", kFisheye, {555.099, 98.140}},
     "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\ncamera_name: camera\nimage_width: "
     "640\nimage_height: 480\nprojection_parameters:\n   k2: -0.03\n   k3: -0.004\n   k4: 0.002\n"
     "   k5: -0.0006\n   mu: 525\n   mv: 525\n   u0: 319.5\n   v0: 239.5\n"},
    {{"OKVIS", "c.yaml", kFisheye, {555.099, 98.140}},
     "%YAML:1.0\ncameras:\n     - {T_SC: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],\n"
     "        image_dimension: [640, 480],\n        distortion_coefficients: [-0.03, -0.004, "
     "0.002, -0.0006],\n        distortion_type: equidistant,\n        focal_length: [525, 525],\n"
     "        principal_point: [319.5, 239.5]}\nimu_params:\n    a_max: 176.0\n"},
    {{"Nerfstudio", "transforms.json", kFisheye, {555.099, 98.140}},
     "{\n\t\"camera_model\": \"OPENCV_FISHEYE\", \"fl_x\": 525, \"fl_y\": 525, \"cx\": 320, "
     "\"cy\": 240, \"w\": 640, \"h\": 480, \"k1\": -0.03, \"k2\": -0.004, \"k3\": 0.002, \"k4\": "
     "-0.0006, \"frames\": [{\"file_path\": \"images/a.png\", \"transform_matrix\": [[1]]}]}"},
    {{"OpenCV's XML", "c.xml", kPinhole, {924.519, 188.269}},
     "<?xml version=\"1.0\"?>\n<opencv_storage>\n<calibration_time>\"today\"</calibration_time>\n"
     "<image_width>1280</image_width><image_height>720</image_height>\n<camera_matrix "
     "type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>600. 0. 639.5 0. 601. "
     "359.5 0. 0. 1.</data></camera_matrix>\n<distortion_coefficients "
     "type_id=\"opencv-matrix\"><rows>8</rows><cols>1</cols><dt>d</dt><data>0.3 -0.1 5e-4 -3e-4 "
     "0.02 0.45 -0.05 0.01</data></distortion_coefficients></opencv_storage>\n"},
    {{"ROS, rational", "c.yaml", kPinhole, {924.519, 188.269}},
     "height: 720\nwidth: 1280\ndistortion_model: rational_polynomial\nD: [0.3, -0.1, 5e-4, -3e-4, "
     "0.02, 0.45, -0.05, 0.01]\nK: [600, 0, 639.5, 0, 601, 359.5, 0, 0, 1]\n"
     "R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nbinning_x: 0\n"},
    {{"thin prism", "c.yaml", kPinhole, {929.411, 185.336}},
     "image_width: 1280\nimage_height: 720\ncameraMatrix: [600, 0, 639.5, 0, 601, 359.5, 0, 0, 1]\n"
     "distCoeffs: [-0.1, 0.01, 5e-4, -3e-4, 0, 0, 0, 0, 3e-5, -1e-5, 2e-5, 0]\n"},
    {{"DPVO's line", "calib.txt", kPinhole, {924.519, 188.269}},
     "600 601 639.5 359.5 0.3 -0.1 5e-4 -3e-4 0.02 0.45 -0.05 0.01\n"},
    {{"Kalibr omni", "c.yaml", kPinhole, {882.414, 213.606}},
     "cam0:\n  camera_model: omni\n  intrinsics: [0.9, 1000, 1001, 639.5, 359.5]\n"
     "  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.02, 0, 0]\n"
     "  resolution: [1280, 720]\n"},
    {{"VINS, MEI", "c.yaml", kPinhole, {882.414, 213.606}},
     "model_type: MEI\ncamera_name: camera\nimage_width: 1280\nimage_height: 720\n"
     "mirror_parameters:\n   xi: 0.9\ndistortion_parameters:\n   k1: -0.1\n   k2: 0.02\n   p1: 0\n "
     "  p2: 0\nprojection_parameters:\n   gamma1: 1000\n   gamma2: 1001\n   u0: 639.5\n   v0: "
     "359.5\n"},
    {{"Kalibr ds", "c.yaml", kFisheye, {517.853, 120.148}},
     "cam0:\n  camera_model: ds\n  intrinsics: [-0.2, 0.58, 350, 351, 319.5, 239.5]\n"
     "  distortion_model: none\n  distortion_coeffs: []\n  resolution: [640, 480]\n"},
    {{"Kalibr eucm", "c.yaml", kFisheye, {478.114, 144.060}},
     "cam0:\n  camera_model: eucm\n  intrinsics: [0.6, 1.1, 350, 351, 319.5, 239.5]\n"
     "  distortion_model: none\n  distortion_coeffs: []\n  resolution: [640, 480]\n"},
    {{"Kalibr fov", "c.yaml", kFisheye, {490.577, 136.560}},
     "cam0:\n  camera_model: pinhole\n  intrinsics: [350, 351, 319.5, 239.5]\n"
     "  distortion_model: fov\n  distortion_coeffs: [0.9]\n  resolution: [640, 480]\n"},
    {{"COLMAP's thin prism fisheye", "cameras.txt", kFisheye, {912.416, 195.481}},
     "1 THIN_PRISM_FISHEYE 1280 720 600 601 640 360 0.02 -0.01 1e-5 -1e-5 0.003 -0.001 1e-5 "
     "1e-5\n"},
    {{"Nerfstudio with k4", "transforms.json", kPinhole, {948.258, 174.202}},
     "{\"camera_model\": \"OPENCV\", \"fl_x\": 600, \"fl_y\": 601, \"cx\": 640, \"cy\": 360, "
     "\"w\": 1280, \"h\": 720, \"k1\": 0.1, \"k2\": -0.05, \"k3\": 0.02, \"k4\": -0.004, \"p1\": "
     "0.001, \"p2\": 0.0005}"},
    {{"a matrix", "camera_matrix.csv", kPinhole, {939.5, 179.2}},
     "600,0,639.5\n0,601,359.5\n0,0,1\n"},
    {{"Python's json.dump of OpenCV's results", "calib.json", kPinhole, {924.519, 188.269}},
     "{\"mtx\": [[600, 0, 639.5],\n\t[0, 601, 359.5], [0, 0, 1]], \"dist\": [[0.3, -0.1, 5e-4, "
     "-3e-4, 0.02, 0.45, -0.05, 0.01]], \"rms\": 0.2}"},
    {{"the same by yaml.dump", "calib.yaml", kPinhole, {924.519, 188.269}},
     "camera_matrix:\n- [600, 0, 639.5]\n- [0, 601, 359.5]\n- [0, 0, 1]\ndist_coeff:\n- [0.3, "
     "-0.1, 5e-4, -3e-4, 0.02, 0.45, -0.05, 0.01]\n"},
    {{"OpenCV's JSON", "calib.json", kPinhole, {939.5, 179.2}},
     "{\"camera_matrix\": {\"type_id\": \"opencv-matrix\", \"rows\": 3, \"cols\": 3, \"dt\": "
     "\"d\", \"data\": [600.0, 0, 639.5, 0, 601, 359.5, 0, 0, 1.0]}}"},
    {{"Record3D", "metadata", kPinhole, {939.5, 179.2}},
     "{\"w\": 1280, \"h\": 720, \"K\": [600,0,0,0,601,0,639.5,359.5,1]}"},
    {{"KITTI", "calib.txt", kPinhole, {939.5, 179.2}},
     "P0: 600 0 639.5 0 0 601 359.5 0 0 0 1 0\nP2: 600 0 639.5 45 0 601 359.5 0 0 0 1 0\nTr: 1 "
     "0\n"},
};

struct CameraKinds : FolderTest {};

TEST_F(CameraKinds, ShowADirectionWhereTheirFormulasDo) {
  for (const Kind& kind : kKinds) {
    const bool is_small = kind.what.pixel.x() < 600;
    Camera camera;
    EXPECT_NO_THROW(camera = LoadCamera(folder.Write(kind.what.file, kind.text),
                                        is_small ? cv::Size(640, 480) : cv::Size(1280, 720)))
        << kind.what.name;
    EXPECT_EQ(camera.width, is_small ? 640 : 1280) << kind.what.name;
    const Eigen::Vector2d pixel =
        Distort(camera, ProjectIdeal(camera, Eigen::Vector3d(0.5, -0.3, 1)));
    EXPECT_LT((pixel - kind.what.pixel).norm(), 0.05)
        << kind.what.name << ": " << pixel.transpose();
  }
}

TEST_F(CameraKinds, WhatIsNotUnderstoodIsNamed) {
  const std::string orb =
      "Camera.fx: 525\nCamera.fy: 525\nCamera.cx: 319.5\nCamera.cy: 239.5\nCamera.cols: "
      "640\nCamera.rows: 480\n";
  const std::string cam0 =
      "cam0:\n  intrinsics: [525, 525, 319.5, 239.5]\n  resolution: [640, 480]\n";
  const std::string ros =
      "image_width: 640\nimage_height: 480\nK: [525, 0, 319.5, 0, 525, 239.5, 0, 0, 1]\n";
  const std::pair<std::string, std::vector<std::string>> files[] = {
      {orb + "Camera.lens: wide\n", {"Camera.lens", "\"wide\"", "not understood"}},
      {orb + "Camera.model: equirectangular\n", {"Camera.model", "equirectangular", "v360"}},
      {orb + "Camera.model: radial_division\n", {"radial_division", "undistort"}},
      {orb + "Camera.model: fisheye\nCamera.p1: 0.1\n", {"Camera.p1: 0.1", "fisheye"}},
      {"Camera:\n  model: fisheye\n  fx: 500\n  widht: 3\n", {"Camera.widht", "width"}},
      {cam0 + "  shutter: 3\n", {"cam0.shutter", "not understood"}},
      {cam0 + "  camera_model: ocam\n", {"cam0.camera_model", "ocam", "eucm"}},
      {"cam0:\n  camera_model: omni\n  intrinsics: [0.9, 500, 500, 319.5, 239.5]\n  "
       "distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.02, 0.01, 0]\n  resolution: [640, "
       "480]\n",
       {"cam0.distortion_coeffs", "omni", "px", "undistort"}},
      {cam0 + "  camera_model: ds\n", {"cam0.intrinsics", "4 values", "6"}},
      {ros + "distortion_type: fisheye\n", {"distortion_type", "not understood"}},
      {ros + "image_witdh: 640\n", {"image_witdh"}},
      {ros + "binning_x: 2\n", {"binning_x: 2"}},
      {ros + "roi: {x_offset: 20, y_offset: 0}\n", {"roi.x_offset: 20"}},
      {ros + "D: [0, 0, 0, 0, 0, 9, -80, 90]\n", {"D", "rational", "px", "undistort"}},
      {ros + "D: [0, 0, 0, 0, 0, 0, 0, 0, 0.02, 0, 0, 0]\n", {"thin prism", "undistort"}},
      {"model_type: SCARAMUZZA\nimage_width: 640\nimage_height: 480\n", {"SCARAMUZZA", "MEI"}},
      {"imu: 1\ncam0_calib: cam0_mei.yaml\n", {"cam0_mei.yaml", "give that file"}},
      {"1 2 3\n4 5 6\n7 8 9\n", {"matrix"}},
      {"1 2 3\n", {"fx fy cx cy"}},
      {"<html><body>no</body></html>", {"opencv_storage"}},
      {"1 DIVISION 640 480 500 500 320 240 0.1\n", {"DIVISION", "image_undistorter"}},
  };
  for (const auto& [text, words] : files) {
    const std::string error = InputErrorOf([&, text = text] {
      LoadCamera(folder.Write("bad.yaml", text), {640, 480});
    });
    EXPECT_THAT(error, HasSubstr("bad.yaml")) << text;
    for (const std::string& word : words) EXPECT_THAT(error, HasSubstr(word)) << text;
  }
}

// What people wrote in place of focal lengths in pixels, and files of no known kind.
TEST_F(CameraKinds, UnitsAndKindsThatAreNotKnownAreExplained) {
  const std::pair<const char*, const char*> files[] = {
      {"3.637 3.638 320 240\n", "expected pixels"},
      {"16.5 16.5 320 240\n", "millimetres"},
      {"0.82 1.09 0.5 0.5\n", "share of the image's width"},
      {"0.82 1.09 0.5 0.5 0\n640 480\ncrop\n640 480\n", "not a calibration"},
      {"a: \x01 \x1f\n", "not a calibration"},
      {"", "not a calibration"}};
  for (const auto& [text, word] : files)
    EXPECT_INPUT_ERROR(LoadCamera(folder.Write("c.txt", text), {640, 480}),
                       HasSubstrs("c.txt", word))
        << text;
}

TEST_F(CameraKinds, APrincipalPointFarAsideIsSaid) {
  std::string said;
  SetLogSink([&](LogLevel, const std::string& message) { said += message; });
  LoadCamera(folder.Write("c.txt", "525 525 319.5 239.5\n"), {640, 480});
  EXPECT_EQ(said, "");
  LoadCamera(folder.Write("c.txt", "525 525 319.5 239.5\n"), {1280, 960});
  SetLogSink({});
  EXPECT_THAT(said, HasSubstrs("320 240", "1280 x 960", "about 640 x 480"));
}

TEST_F(CameraKinds, SizesOfAllSpellingsAreCompared) {
  for (const char* text : {"Camera.model: fisheye\nCamera.fx: 525\nCamera.fy: 525\nCamera.cx: "
                           "319.5\nCamera.cy: 239.5\nCamera.cols: 1280\nCamera.rows: 960\n",
                           "Camera: {model: perspective, fx: 525, fy: 525, cx: 319.5, cy: 239.5, "
                           "cols: 1280, rows: 960}\n"})
    EXPECT_INPUT_ERROR(LoadCamera(folder.Write("c.yaml", text), {640, 480}),
                       HasSubstrs("1280 x 960", "640 x 480"));
}

}  // namespace
}  // namespace oaslam
