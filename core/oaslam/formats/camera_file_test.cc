#include "oaslam/camera_file.h"

#include <cmath>
#include <numbers>

#include "cameras.h"
#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

constexpr const char* kRos = R"(# ROS camera_info
camera_name: freiburg2
image_width: 640
image_height: 480
camera_matrix:
  rows: 3
  cols: 3
  data: [520.9, 0, 325.1, 0, 521.0, 249.7, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.2312, -0.7849, -0.0033, -0.0001, 0.9172]
)";

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  text.replace(text.find(what), what.size(), with);
  return text;
}

struct CameraFile : FolderTest {};

TEST_F(CameraFile, RosCameraInfo) {
  const Camera camera = LoadCamera(folder.Write("camera.yaml", kRos), {640, 480});
  EXPECT_EQ(camera.model, LensModel::kPinhole);
  EXPECT_EQ(camera.name, "freiburg2");
  EXPECT_EQ(camera.fx, 520.9);
  EXPECT_EQ(camera.fy, 521.0);
  EXPECT_EQ(camera.cx, 325.1);
  EXPECT_EQ(camera.cy, 249.7);
  EXPECT_THAT(camera.distortion, ElementsAre(0.2312, -0.7849, -0.0033, -0.0001, 0.9172));
  EXPECT_FALSE(camera.is_guess);
}

TEST_F(CameraFile, RosMessageWithFisheye) {
  const Camera camera = LoadCamera(
      folder.Write("camera.yaml",
                   "width: 848\nheight: 800\ndistortion_model: equidistant\n"
                   "D: [0.1, -0.2, 0.3, -0.4]\nK: [286, 0, 421, 0, 287, 398, 0, 0, 1]\n"),
      {});
  EXPECT_EQ(camera.model, LensModel::kFisheye);
  EXPECT_THAT(camera.distortion, ElementsAre(0.1, -0.2, 0.3, -0.4, 0));
  EXPECT_EQ(camera.width, 848);
}

TEST_F(CameraFile, OpenCvFileStorage) {
  const Camera camera = LoadCamera(
      folder.Write(
          "camera.yml",
          "%YAML:1.0\n---\nimage_Width: 640\nimage_Height: 480\nCamera_Matrix: !!opencv-matrix\n"
          "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 657.46, 0., 319.5, 0., 657.47,\n"
          "       239.5, 0., 0., 1. ]\nDistortion_Coefficients: !!opencv-matrix\n   rows: 5\n"
          "   cols: 1\n   dt: d\n   data: [ -4.18e-01, 5.0e-01, 0., 0., -5.7e-01 ]\n"),
      {640, 480});
  EXPECT_EQ(camera.fx, 657.46);
  EXPECT_EQ(camera.cy, 239.5);
  EXPECT_THAT(camera.distortion, ElementsAre(-0.418, 0.5, 0, 0, -0.57));
}

TEST_F(CameraFile, OrbSlamTakesTheSizeOfTheImages) {
  const std::string path = folder.Write(
      "TUM1.yaml",
      "%YAML:1.0\n\nCamera.fx: 517.3\nCamera.fy: 516.5\nCamera.cx: 318.6\nCamera.cy: 255.3\n"
      "Camera.k1: 0.26\nCamera.k2: -0.95\nCamera.p1: -0.005\nCamera.p2: 0.0026\nCamera.k3: 1.16\n"
      "Camera.fps: 30.0\nORBextractor.nFeatures: 1000\n");
  const Camera camera = LoadCamera(path, {640, 480});
  EXPECT_EQ(camera.width, 640);
  EXPECT_THAT(camera.distortion, ElementsAre(0.26, -0.95, -0.005, 0.0026, 1.16));
  EXPECT_INPUT_ERROR(LoadCamera(path, {}), HasSubstr("no image size"));
}

TEST_F(CameraFile, OrbSlam3Fisheye) {
  const Camera camera =
      LoadCamera(folder.Write("c.yaml",
                              "%YAML:1.0\nCamera.type: \"KannalaBrandt8\"\nCamera1.fx: "
                              "190.9\nCamera1.fy: 190.8\nCamera1.cx: 254.9\n"
                              "Camera1.cy: 256.8\nCamera1.k1: 0.0034\nCamera1.k2: "
                              "0.0007\nCamera1.k3: -0.002\nCamera1.k4: 0.0002\n"
                              "Camera.width: 512\nCamera.height: 512\n"),
                 {});
  EXPECT_EQ(camera.model, LensModel::kFisheye);
  EXPECT_THAT(camera.distortion, ElementsAre(0.0034, 0.0007, -0.002, 0.0002, 0));
}

TEST_F(CameraFile, KalibrAndEuroc) {
  const std::string body =
      "camera_model: pinhole\n  intrinsics: [461.6, 460.3, 363.0, 248.1]\n  distortion_model: "
      "equidistant\n"
      "  distortion_coeffs: [-0.01, 0.02, -0.03, 0.04]\n  resolution: [752, 480]\n";
  const Camera camera = LoadCamera(
      folder.Write("camchain.yaml", "cam0:\n  cam_overlaps: [1]\n  " + body), {752, 480});
  EXPECT_EQ(camera.model, LensModel::kFisheye);
  EXPECT_EQ(camera.fy, 460.3);
  EXPECT_EQ(camera.distortion[3], 0.04);
  const Camera euroc =
      LoadCamera(folder.Write("sensor.yaml",
                              "resolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458.6, "
                              "457.3, 367.2, 248.4]\n"
                              "distortion_model: radial-tangential\ndistortion_coefficients: "
                              "[-0.28, 0.07, 0.0002, 1.8e-05]\n"),
                 {});
  EXPECT_EQ(euroc.model, LensModel::kPinhole);
  EXPECT_THAT(euroc.distortion, ElementsAre(-0.28, 0.07, 0.0002, 1.8e-05, 0));
}

TEST_F(CameraFile, ColmapPixelCentresAreAtHalfIntegers) {
  const std::string two = folder.Write("cameras.txt",
                                       "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
                                       "1 SIMPLE_RADIAL 1920 1080 1500 960 540 0.01\n"
                                       "2 OPENCV 640 480 500 501 320 240 0.1 0.2 0.003 0.004\n");
  const Camera opencv = LoadCamera(two, {640, 480});
  EXPECT_EQ(opencv.fy, 501);
  EXPECT_EQ(opencv.cx, 319.5);
  EXPECT_THAT(opencv.distortion, ElementsAre(0.1, 0.2, 0.003, 0.004, 0));
  const Camera radial = LoadCamera(two, {1920, 1080});
  EXPECT_EQ(radial.fy, 1500);
  EXPECT_EQ(radial.cy, 539.5);
  EXPECT_EQ(radial.distortion[0], 0.01);
  EXPECT_INPUT_ERROR(LoadCamera(two, {}), HasSubstr("2 cameras"));
  EXPECT_INPUT_ERROR(LoadCamera(folder.Write("few.txt", "1 PINHOLE 640 480 500 500 320\n"), {}),
                     HasSubstrs("few.txt:1", "expected 6"));
}

TEST_F(CameraFile, FieldOfViewIsAGuess) {
  const Camera camera = LoadCamera("fov:60", {640, 480});
  EXPECT_TRUE(camera.is_guess);
  EXPECT_NEAR(2 * std::atan2(320, camera.fx) * 180 / std::numbers::pi, 60, 1e-9);
  EXPECT_EQ(camera.cx, 319.5);
  EXPECT_INPUT_ERROR(LoadCamera("fov:60", {}), HasSubstr("needs images"));
  EXPECT_INPUT_ERROR(LoadCamera("fov:nan", {640, 480}), HasSubstr("5 to 170"));
}

TEST_F(CameraFile, BadInputIsNamed) {
  const auto error = [&](const std::string& text, const cv::Size& size = {640, 480}) {
    return InputErrorOf([&] { LoadCamera(folder.Write("bad.yaml", text), size); });
  };
  EXPECT_THAT(error(kRos, {320, 240}), HasSubstrs("640 x 480", "320 x 240"));
  EXPECT_THAT(error(Replaced(kRos, "520.9", ".nan")),
              HasSubstrs("bad.yaml", "camera_matrix.data[0]"));
  EXPECT_THAT(error(Replaced(kRos, "520.9", "-520.9")), HasSubstrs("fx", "-520.9", "allowed"));
  EXPECT_THAT(error(Replaced(kRos, "520.9, 0", "520.9, 3")), HasSubstr("expected [fx 0 cx"));
  EXPECT_THAT(error(Replaced(kRos, "plumb_bob", "double_sphere")),
              HasSubstrs("double_sphere", "allowed"));
  EXPECT_THAT(error(Replaced(kRos, "image_height: 480\n", "")),
              HasSubstr("image_height is missing"));
  EXPECT_THAT(error(Replaced(kRos, "data: [0.2312", "data: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.2312")),
              HasSubstrs("distortion_coefficients[14]", "only 14 coefficients"));
  EXPECT_THAT(error("a: 1\n"), HasSubstr("not a calibration"));
  EXPECT_THAT(error("a: [1\n"), HasSubstr("bad.yaml:"));
  EXPECT_INPUT_ERROR(LoadCamera(folder / "missing.yaml", {}), HasSubstr("no such file"));
}

TEST_F(CameraFile, AMatrixWithoutItsDataIsNamed) {
  for (const char* key : {"camera_matrix", "distortion_coefficients"}) {
    std::string text = kRos;
    const size_t data = text.find("data", text.find(key));
    text.erase(data, text.find('\n', data) - data);
    EXPECT_INPUT_ERROR(
        LoadCamera(folder.Write("bad.yaml", text), {640, 480}),
        HasSubstrs("bad.yaml", std::string(key) + ".data: nothing", "list of numbers"));
  }
}

// A valid file of each kind.
std::vector<std::string> GoodFiles() {
  return {
      kRos,
      "width: 848\nheight: 800\ndistortion_model: equidistant\n"
      "D: [0.1, -0.2, 0.3, -0.4]\nK: [286, 0, 421, 0, 287, 398, 0, 0, 1]\n",
      "%YAML:1.0\n---\nCamera_Matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 657.46, 0., 319.5, 0., 657.47, 239.5, 0., 0., 1. ]\n",
      "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 517.3\nCamera.fy: 516.5\n"
      "Camera.cx: 318.6\nCamera.cy: 255.3\nCamera.k1: 0.26\n",
      "cam0:\n  camera_model: pinhole\n  intrinsics: [461.6, 460.3, 363.0, 248.1]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [-0.01, 0.02, 0.0, 0.0]\n"
      "  resolution: [752, 480]\n",
      "1 SIMPLE_RADIAL 1920 1080 1500 960 540 0.01\n",
      "525 525 319.5 239.5 0.1 0 0 0\n",
      "Camera: {model: fisheye, fx: 525, fy: 525, cx: 319.5, cy: 239.5}\n",
      "cameras: [{image_dimension: [640, 480], focal_length: [525, 525], principal_point: "
      "[319, 239]}]\n",
      "model_type: PINHOLE\nprojection_parameters: {fx: 525, fy: 525, cx: 319, cy: 239}\n",
      "<opencv_storage><K type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>"
      "525 0 319 0 525 239 0 0 1</data></K></opencv_storage>\n"};
}

// Expects that the text is read, or refused with a message that names the file.
void ExpectReadOrNamed(const TempFolder& folder, const std::string& text) {
  try {
    LoadCamera(folder.Write("damaged.yaml", text), {640, 480});
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("damaged.yaml")) << text;
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what() << "\n" << text;
  }
}

TEST_F(CameraFile, WhateverIsDamagedTheFileIsNamed) {
  for (const std::string& good : GoodFiles()) {
    for (size_t length = 0; length < good.size(); ++length)
      ExpectReadOrNamed(folder, good.substr(0, length));
    for (size_t i = 0; i < good.size(); ++i)
      for (const char c : {' ', '\n', ':', '[', '}', '-', '&', '"', '\0', '\xff'}) {
        std::string damaged = good;
        damaged[i] = c;
        ExpectReadOrNamed(folder, damaged);
      }
    for (size_t begin = 0; begin < good.size(); begin = good.find('\n', begin) + 1) {
      std::string without_line = good;
      ExpectReadOrNamed(folder, without_line.erase(begin, good.find('\n', begin) + 1 - begin));
    }
  }
}

TEST_F(CameraFile, WhatIsWrittenIsReadAgain) {
  Camera pinhole{
      .width = 1280, .height = 720, .fx = 960.35, .fy = 961.125, .cx = 634.78, .cy = 365.79};
  pinhole.name = "a \"phone\"";
  pinhole.distortion = {0.0713, -0.0472, 1e-5, 0, 0.25};
  Camera fisheye = synthetic::kFisheye;
  fisheye.name = "eye";
  for (const Camera& camera : {pinhole, fisheye})
    EXPECT_EQ(
        LoadCamera(folder.Write("camera.yaml", CameraText(camera, "estimated\nby this test")), {}),
        camera);
}

}  // namespace
}  // namespace oaslam
