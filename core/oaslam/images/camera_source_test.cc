#include "oaslam/images/camera_source.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>

#include "oaslam/error.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

TEST(CameraSource, IsToldByItsName) {
  for (const char* camera : {"webcam:0", "usb:1", "/dev/video2", "rtsp://door/1", "rtsps://d",
                             "http://10.0.0.2:8080/video", "https://host/live.m3u8"})
    EXPECT_TRUE(IsCamera(camera)) << camera;
  for (const char* other : {"walk.mp4", "webcam", "http", "/dev/shm/a.mp4", "ftp://host/a.mp4",
                            "dir/http://a", "2024-05-01T10:30:12.mp4"})
    EXPECT_FALSE(IsCamera(other)) << other;
}

std::string MessageOf(const std::string& source, const ImageSourceOptions& options = {}) {
  try {
    OpenStream(source, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CameraSource, WhatIsNotThereIsSaid) {
  EXPECT_EQ(MessageOf("webcam:x"), "webcam:x: expected webcam:N with N from 0");
  EXPECT_EQ(MessageOf("usb:-1"), "usb:-1: expected usb:N with N from 0");
  EXPECT_EQ(MessageOf("/dev/video1.5"), "/dev/video1.5: expected /dev/videoN with N from 0");
  EXPECT_EQ(MessageOf("webcam:973"), "webcam:973: cannot be opened: No such file or directory");
  EXPECT_EQ(MessageOf("http://me:secret@127.0.0.1:9/v"),
            "http://127.0.0.1:9/v: cannot be opened: Connection refused");
}

TEST(CameraSource, StoppedWhileItWaitsForAnAnswer) {
  std::atomic<bool> stopped = false;
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    stopped = true;
  });
  ImageSourceOptions options;
  options.stopped = [&] { return stopped.load(); };
  const auto begin = std::chrono::steady_clock::now();
  // An address of documentation (RFC 5737): nothing answers.
  EXPECT_NE(MessageOf("http://192.0.2.1/video", options), "");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

TEST(CameraSource, AProgramMayHaveItsOwn) {
  struct NoImages : ImageSource {
    std::optional<InputImage> Next() override { return std::nullopt; }
    int size() const override { return -1; }
  };
  EXPECT_FALSE(IsCamera("robot:/camera"));
  std::string opened;
  AddCameraScheme("robot:", [&](const std::string& source, const ImageSourceOptions&) {
    opened = source;
    return std::make_unique<NoImages>();
  });
  EXPECT_TRUE(IsCamera("robot:/camera"));
  EXPECT_FALSE(IsCamera("robots.mp4"));
  EXPECT_EQ(OpenImages("robot:/camera")->size(), -1);
  EXPECT_EQ(opened, "robot:/camera");
}

TEST(CameraSource, CamerasAtUsbAreCountedByTheirNumbers) {
  const fs::path folder = fs::temp_directory_path() / ("oaslam_usb_" + std::to_string(getpid()));
  const auto add = [&](const std::string& name, const std::string& hardware, int index) {
    const fs::path device = folder / "devices" / hardware;
    fs::create_directories(device);
    fs::create_directories(folder / "class" / name);
    fs::create_directory_symlink(device, folder / "class" / name / "device");
    std::ofstream(folder / "class" / name / "index") << index << "\n";
  };
  add("video0", "pci0000/isp", 0);  // of a laptop, at another bus
  add("video10", "pci0000/usb1/1-2", 0);
  add("video2", "pci0000/usb1/1-1", 0);
  add("video3", "pci0000/usb1/1-1", 1);  // says something about the images of video2
  EXPECT_EQ(UsbCamera(0, folder / "class"), "/dev/video2");
  EXPECT_EQ(UsbCamera(1, folder / "class"), "/dev/video10");
  EXPECT_THROW(UsbCamera(2, folder / "class"), InputError);
  EXPECT_THROW(UsbCamera(0, folder / "none"), InputError);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace oaslam
