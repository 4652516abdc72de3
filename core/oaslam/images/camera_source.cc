#include "oaslam/images/camera_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <fstream>
#include <map>
#include <opencv2/imgproc.hpp>
#include <thread>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavdevice/avdevice.h>
#include <libavformat/avformat.h>
#include <libavutil/error.h>
#include <libavutil/imgutils.h>
#include <libswscale/swscale.h>
}

#include "oaslam/formats/text.h"
#include "oaslam/images/stream_clock.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/free_by.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr std::array kSchemes = {"rtsp://", "rtsps://", "http://", "https://",
                                 "rtmp://", "udp://",   "srt://"};
constexpr const char* kDevice = "/dev/video";

using StreamInput = std::unique_ptr<AVFormatContext, FreeBy<avformat_close_input>>;
using StreamDecoder = std::unique_ptr<AVCodecContext, FreeBy<avcodec_free_context>>;
using StreamPacket = std::unique_ptr<AVPacket, FreeBy<av_packet_free>>;
using StreamFrame = std::unique_ptr<AVFrame, FreeBy<av_frame_free>>;

class Settings {
 public:
  ~Settings() { av_dict_free(&values_); }
  Settings() = default;
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;
  void Set(const char* key, const std::string& value) {
    av_dict_set(&values_, key, value.c_str(), 0);
  }
  AVDictionary** get() { return &values_; }

 private:
  AVDictionary* values_ = nullptr;
};

std::string Reason(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

// Those of AddCameraScheme.
std::map<std::string, OpenOwnCamera>& CamerasOfProgram() {
  static std::map<std::string, OpenOwnCamera> cameras;
  return cameras;
}

// Null: it is not one of these.
const OpenOwnCamera* CameraOfProgram(const std::string& source) {
  for (const auto& [scheme, open] : CamerasOfProgram())
    if (source.starts_with(scheme)) return &open;
  return nullptr;
}

bool IsOfNetwork(const std::string& source) {
  return std::ranges::any_of(kSchemes, [&](const char* s) { return source.starts_with(s); });
}

// The device of webcam:N, usb:N or /dev/videoN.
std::string DeviceOf(const std::string& source) {
  const bool is_usb = source.starts_with("usb:");
  const size_t begin = is_usb ? 4 : source.starts_with("webcam:") ? 7 : std::string(kDevice).size();
  const auto number = ParseNumber(source.substr(begin));
  // No system has a larger number of cameras.
  if (!number || !(*number >= 0 && *number <= 1000) || *number != static_cast<int>(*number))
    throw BadInput("{}: expected {}N with N from 0", source, source.substr(0, begin));
  const int n = static_cast<int>(*number);
  return is_usb ? UsbCamera(n, "/sys/class/video4linux") : kDevice + std::to_string(n);
}

class CameraSource : public ImageSource {
 public:
  CameraSource(const std::string& source, const ImageSourceOptions& options)
      : source_(source),
        name_(WithoutPassword(source)),
        is_device_(!IsOfNetwork(source)),
        url_(is_device_ ? DeviceOf(source) : source),
        options_(options) {
    if (const int error = Connect(); error < 0)
      throw BadInput("{}: cannot be opened: {}", name_, problem_);
  }

  ~CameraSource() override { sws_freeContext(scaler_); }
  CameraSource(const CameraSource&) = delete;
  CameraSource& operator=(const CameraSource&) = delete;

  std::optional<InputImage> Next() override {
    while (!IsStopped() && (options_.to < 0 || index_ < options_.to)) {
      const int error = input_ ? Decode() : AVERROR_EOF;
      if (error == AVERROR(EAGAIN)) continue;
      if (error < 0) {
        if (IsStopped() || (error == AVERROR_EOF && is_finite_) || !ConnectAgain(error)) break;
        continue;
      }
      const StreamClock::Image time = clock_.Next(StampOf(*frame_), SteadySeconds());
      last_image_s_ = SteadySeconds();
      const int index = index_++;
      if (index < options_.from) continue;
      InputImage image{index, time.timestamp, fmt::format("{:06}", index), Picture()};
      image.taken_s = time.taken;
      if (!image.image.empty()) return image;
    }
    if (index_ == 0 && !IsStopped())
      throw BadInput("{}: not one of its images can be decoded", name_);
    return std::nullopt;
  }
  int size() const override {
    return options_.to < 0 ? -1 : std::max(options_.to - options_.from, 0);
  }
  void Stop() override { is_stopped_ = true; }

 private:
  // A camera that says nothing for so long has gone; the same is waited for its answer.
  static constexpr double kSilence_s = 10;
  // A network camera that is switched off and on is back after so long.
  static constexpr double kGivenUp_s = 30;

  bool IsStopped() const { return is_stopped_ || (options_.stopped && options_.stopped()); }

  // FFmpeg asks several times a second whether to go on waiting.
  static int MustEnd(void* self) {
    const auto& source = *static_cast<CameraSource*>(self);
    return source.IsStopped() || SteadySeconds() > source.deadline_s_ ? 1 : 0;
  }

  // Returns FFmpeg's error, and sets what the problem is.
  int Connect() {
    decoder_.reset();
    input_.reset();
    clock_.Restart();
    deadline_s_ = SteadySeconds() + kSilence_s;
    const int error = OpenInput();
    connected_s_ = SteadySeconds();
    is_drained_ = false;
    if (error >= 0) return error;
    input_.reset();
    if (problem_.empty())
      problem_ = error == AVERROR_EXIT ? fmt::format("no answer within {:g} s", kSilence_s)
                                       : Reason(error);
    return error;
  }

  int OpenInput() {
    problem_.clear();
    avdevice_register_all();
    AVFormatContext* context = avformat_alloc_context();
    if (!context) return AVERROR(ENOMEM);
    context->interrupt_callback = {MustEnd, this};
    if (is_device_) context->flags |= AVFMT_FLAG_NONBLOCK;
    Settings settings;
    if (is_device_) {
      settings.Set("video_size", "640x480");  // or the nearest that it has
      if (options_.fps) settings.Set("framerate", fmt::format("{:g}", *options_.fps));
    } else if (url_.starts_with("rtsp")) {
      settings.Set("rtsp_flags", "prefer_tcp");  // images are whole
    }
    const AVInputFormat* format = is_device_ ? av_find_input_format("v4l2") : nullptr;
    if (is_device_ && !format) {
      avformat_free_context(context);
      problem_ = "this FFmpeg reads no cameras (v4l2)";
      return AVERROR_DEMUXER_NOT_FOUND;
    }
    // It frees the context where it fails.
    int error = avformat_open_input(&context, url_.c_str(), format, settings.get());
    if (error < 0) return error;
    input_.reset(context);
    if (error = avformat_find_stream_info(context, nullptr); error < 0) return error;
    const AVCodec* codec = nullptr;
    stream_ = av_find_best_stream(context, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_ < 0) {
      problem_ = "no images in it";
      return stream_;
    }
    const std::string kind = input_->iformat->name;
    has_times_ = !kind.starts_with("mpjpeg") && !kind.starts_with("mjpeg") &&
                 !kind.starts_with("image2") && !kind.ends_with("_pipe");
    is_finite_ = !is_device_ && input_->duration > 0;
    return OpenDecoder(codec);
  }

  int OpenDecoder(const AVCodec* codec) {
    for (unsigned i = 0; i < input_->nb_streams; ++i)
      if (static_cast<int>(i) != stream_) input_->streams[i]->discard = AVDISCARD_ALL;
    decoder_.reset(avcodec_alloc_context3(codec));
    if (!decoder_) return AVERROR(ENOMEM);
    decoder_->thread_type = FF_THREAD_SLICE;  // several images at once would make them late
    decoder_->thread_count = 2;
    const int error =
        avcodec_parameters_to_context(decoder_.get(), input_->streams[stream_]->codecpar);
    return error < 0 ? error : avcodec_open2(decoder_.get(), codec, nullptr);
  }

  // False where it does not come back. `error`: why it is not there.
  bool ConnectAgain(int error) {
    if (last_image_s_ == 0) last_image_s_ = SteadySeconds();
    Log(LogLevel::kWarning, "{}: broke off after {} images ({}); connecting again", name_, index_,
        error == AVERROR_EOF    ? "its end"
        : error == AVERROR_EXIT ? fmt::format("nothing for {:g} s", kSilence_s)
                                : Reason(error));
    while (!IsStopped() && SteadySeconds() < last_image_s_ + kGivenUp_s) {
      if (Connect() >= 0) return true;
      for (int i = 0; i < 10 && !IsStopped(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    if (!IsStopped())
      Log(LogLevel::kWarning, "{}: no image for {:g} s, no more are expected: {}", name_,
          kGivenUp_s, problem_);
    return false;
  }

  // The next image into frame_; EAGAIN: not yet.
  int Decode() {
    // Until an image is there: a stream may send what is none.
    deadline_s_ = std::max(last_image_s_, connected_s_) + kSilence_s;
    if (SteadySeconds() > deadline_s_) return AVERROR_EXIT;
    if (const int error = avcodec_receive_frame(decoder_.get(), frame_.get());
        error != AVERROR(EAGAIN))
      return error == AVERROR_INVALIDDATA ? AVERROR(EAGAIN) : error;
    const int error = av_read_frame(input_.get(), packet_.get());
    if (error == AVERROR(EAGAIN))  // of a device: no image yet
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    // At the end the decoder gives the images that it holds back.
    if (error == AVERROR_EOF && !is_drained_) {
      is_drained_ = true;
      avcodec_send_packet(decoder_.get(), nullptr);
      return AVERROR(EAGAIN);
    }
    if (error < 0) return error;
    if (packet_->stream_index == stream_) avcodec_send_packet(decoder_.get(), packet_.get());
    av_packet_unref(packet_.get());
    return AVERROR(EAGAIN);
  }

  std::optional<double> StampOf(const AVFrame& frame) const {
    if (!has_times_ || frame.best_effort_timestamp == AV_NOPTS_VALUE) return std::nullopt;
    return static_cast<double>(frame.best_effort_timestamp) *
           av_q2d(input_->streams[stream_]->time_base);
  }

  // Empty where FFmpeg cannot convert it.
  cv::Mat Picture() {
    const auto format = static_cast<AVPixelFormat>(frame_->format);
    scaler_ = sws_getCachedContext(scaler_, frame_->width, frame_->height, format, frame_->width,
                                   frame_->height, AV_PIX_FMT_BGR24, SWS_BILINEAR, nullptr, nullptr,
                                   nullptr);
    if (!scaler_) return {};
    cv::Mat picture(frame_->height, frame_->width, CV_8UC3);
    const int stride = static_cast<int>(picture.step);
    sws_scale(scaler_, frame_->data, frame_->linesize, 0, frame_->height, &picture.data, &stride);
    if (!options_.color && !options_.color_if_free)
      cv::cvtColor(picture, picture, cv::COLOR_BGR2GRAY);
    return picture;
  }

  std::string source_, name_;
  bool is_device_;
  std::string url_;
  ImageSourceOptions options_;
  std::atomic<bool> is_stopped_ = false;
  StreamInput input_;
  StreamDecoder decoder_;
  StreamPacket packet_{av_packet_alloc()};
  StreamFrame frame_{av_frame_alloc()};
  SwsContext* scaler_ = nullptr;
  StreamClock clock_;
  int stream_ = 0;
  bool has_times_ = false, is_finite_ = false, is_drained_ = false;
  double deadline_s_ = 0, connected_s_ = 0, last_image_s_ = 0;  // of the steady clock
  std::string problem_;
  int index_ = 0;
};

}  // namespace

bool IsCamera(const std::string& source) {
  return source.starts_with("webcam:") || source.starts_with("usb:") ||
         source.starts_with(kDevice) || IsOfNetwork(source) || CameraOfProgram(source);
}

void AddCameraScheme(const std::string& scheme, OpenOwnCamera open) {
  CamerasOfProgram()[scheme] = std::move(open);
}

std::unique_ptr<ImageSource> OpenStream(const std::string& source,
                                        const ImageSourceOptions& options) {
  if (const OpenOwnCamera* open = CameraOfProgram(source)) return (*open)(source, options);
  return std::make_unique<CameraSource>(source, options);
}

std::string UsbCamera(int number, const fs::path& classes) {
  std::map<int, std::string> devices;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(classes, error)) {
    const std::string name = entry.path().filename().string();
    const auto n = name.starts_with("video") ? ParseNumber(name.substr(5)) : std::nullopt;
    // The first node of a camera has its images, others say something about them.
    int index = -1;
    std::ifstream(entry.path() / "index") >> index;
    const std::string hardware = fs::canonical(entry.path() / "device", error).string();
    if (n && index == 0 && hardware.find("/usb") != std::string::npos)
      devices[static_cast<int>(*n)] = "/dev/" + name;
  }
  if (number >= static_cast<int>(devices.size()))
    throw BadInput("usb:{}: there are {} cameras at USB, counted from 0", number, devices.size());
  return std::next(devices.begin(), number)->second;
}

}  // namespace oaslam
