#include "oaslam/images/video_container.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <memory>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
#include <libavutil/display.h>
#include <libavutil/log.h>
}

#include "oaslam/util/bad_input.h"
#include "oaslam/util/free_by.h"

namespace oaslam {
namespace {

using Input = std::unique_ptr<AVFormatContext, FreeBy<avformat_close_input>>;
using Packet = std::unique_ptr<AVPacket, FreeBy<av_packet_free>>;

// Null where FFmpeg does not recognise the file.
Input Open(const std::string& path) {
  AVFormatContext* context = nullptr;
  // The prefix keeps FFmpeg from taking the path for another protocol.
  if (avformat_open_input(&context, ("file:" + path).c_str(), nullptr, nullptr) < 0) return nullptr;
  Input input(context);
  return avformat_find_stream_info(context, nullptr) < 0 ? nullptr : std::move(input);
}

// The sizes of the video streams beside one, as a message says them.
std::string OtherStreams(const AVFormatContext& input, const AVStream* taken) {
  std::string sizes;
  for (unsigned i = 0; i < input.nb_streams; ++i) {
    const AVStream* stream = input.streams[i];
    const AVCodecParameters& codec = *stream->codecpar;
    if (stream == taken || codec.codec_type != AVMEDIA_TYPE_VIDEO ||
        (stream->disposition & AV_DISPOSITION_ATTACHED_PIC) != 0)
      continue;
    sizes += fmt::format("{}{} x {}", sizes.empty() ? "" : ", ", codec.width, codec.height);
  }
  return sizes;
}

// The first video stream, which OpenCV uses, too. It may be a cover picture.
AVStream* VideoStream(const AVFormatContext& input) {
  for (unsigned i = 0; i < input.nb_streams; ++i)
    if (input.streams[i]->codecpar->codec_type == AVMEDIA_TYPE_VIDEO) return input.streams[i];
  return nullptr;
}

struct Packets {
  int shown = 0, hidden = 0;  // hidden by an edit list
  // Times of the shown images, in units of the stream, ascending; empty where they are not usable.
  std::vector<int64_t> times;
};

Packets ReadPackets(AVFormatContext& input, int stream) {
  for (unsigned i = 0; i < input.nb_streams; ++i)
    if (static_cast<int>(i) != stream) input.streams[i]->discard = AVDISCARD_ALL;
  const Packet packet(av_packet_alloc());
  Packets packets;
  int64_t last_decoded = AV_NOPTS_VALUE;
  bool have_times = true;
  for (; av_read_frame(&input, packet.get()) >= 0; av_packet_unref(packet.get())) {
    if (packet->stream_index != stream) continue;
    // Decoding times ascend, unless the stream was concatenated from several whose times restart.
    if (packet->pts == AV_NOPTS_VALUE ||
        (packet->dts != AV_NOPTS_VALUE && packet->dts < last_decoded))
      have_times = false;
    if (packet->dts != AV_NOPTS_VALUE) last_decoded = packet->dts;
    const bool is_hidden = packet->flags & AV_PKT_FLAG_DISCARD;
    ++(is_hidden ? packets.hidden : packets.shown);
    if (!is_hidden) packets.times.push_back(packet->pts);
  }
  std::ranges::sort(packets.times);  // they were in decoding order
  if (packets.shown > 1 && packets.times.front() == packets.times.back()) have_times = false;
  if (!have_times) packets.times.clear();
  return packets;
}

// Whether the last image is in the last hundredth of what the header announces.
bool EndsInTime(const Packets& packets, const AVStream& stream) {
  constexpr double kNearEnd = 0.99;
  if (packets.times.empty() || stream.duration <= 0) return false;
  const auto start = stream.start_time == AV_NOPTS_VALUE ? 0 : stream.start_time;
  const auto last = static_cast<double>(packets.times.back() - start);
  // One image is shown until the end.
  const double interval = static_cast<double>(stream.duration) /
                          static_cast<double>(std::max<int64_t>(stream.nb_frames, 1));
  return last + 1.5 * interval >= kNearEnd * static_cast<double>(stream.duration);
}

VideoTimes TimesOf(const std::vector<int64_t>& stored, const AVStream& stream) {
  if (stored.empty()) return {};
  const double num = stream.time_base.num, den = stream.time_base.den;
  const auto seconds = [&](int64_t units) { return static_cast<double>(units) * num / den; };
  VideoTimes times;
  for (const int64_t time : stored) times.seconds.push_back(seconds(time - stored.front()));
  if (stream.start_time != AV_NOPTS_VALUE)
    times.start = seconds(stored.front() - stream.start_time);
  times.repaired = SpreadEqualTimes(times.seconds);
  return times;
}

const int32_t* DisplayMatrix(const AVStream& stream) {
#if LIBAVCODEC_VERSION_INT >= AV_VERSION_INT(60, 30, 100)
  const AVCodecParameters& codec = *stream.codecpar;
  const AVPacketSideData* data = av_packet_side_data_get(
      codec.coded_side_data, codec.nb_coded_side_data, AV_PKT_DATA_DISPLAYMATRIX);
  return data ? reinterpret_cast<const int32_t*>(data->data) : nullptr;
#else
  return reinterpret_cast<const int32_t*>(
      av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr));
#endif
}

// Phones rotate by multiples of 90 degrees; other angles are rounded to these.
int TurnOf(const AVStream& stream) {
  const int32_t* matrix = DisplayMatrix(stream);
  const double counterclockwise = matrix ? av_display_rotation_get(matrix) : 0;
  if (!std::isfinite(counterclockwise)) return 0;
  const long quarters = std::lround(-counterclockwise / 90) % 4;
  return static_cast<int>((quarters + 4) % 4) * 90;
}

// The ratios of broadcast and camcorders are between 8:15 and 2:1.
constexpr double kMostPixelRatio = 4;

void SetPixelRatio(AVFormatContext& input, AVStream& stream, VideoContainer& container) {
  const AVRational ratio = av_guess_sample_aspect_ratio(&input, &stream, nullptr);
  if (ratio.num <= 0 || ratio.den <= 0) return;
  const double value = av_q2d(ratio);
  const bool is_likely = value >= 1 / kMostPixelRatio && value <= kMostPixelRatio;
  (is_likely ? container.pixel_ratio : container.odd_pixel_ratio) = value;
}

void SayNothing(void*, int, const char*, va_list) {}

}  // namespace

// Sets the callback, not the log level, which OpenCV resets whenever it opens a video.
void SilenceFfmpeg() { av_log_set_callback(SayNothing); }

int SpreadEqualTimes(std::vector<double>& ascending) {
  int moved = 0;
  double step = 0;  // at the end the previous step is used
  for (size_t begin = 0; begin < ascending.size();) {
    const double time = ascending[begin];
    const auto first = ascending.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto above = std::upper_bound(first, ascending.end(), time);
    const auto count = above - first;
    if (above != ascending.end()) step = (*above - time) / static_cast<double>(count);
    for (std::ptrdiff_t i = 1; i < count; ++i, ++moved)
      first[i] = time + step * static_cast<double>(i);
    begin += static_cast<size_t>(count);
  }
  return moved;
}

VideoContainer ReadVideoContainer(const std::string& path) {
  const Input input = Open(path);
  AVStream* stream = input ? VideoStream(*input) : nullptr;
  if (!stream) throw BadInput("{}: neither a list of images nor a video that can be opened", path);
  if (stream->disposition & AV_DISPOSITION_ATTACHED_PIC)
    throw BadInput(
        "{}: its first video stream is a cover picture; ffmpeg -i FILE -map 0:V -c copy NEW.mp4 "
        "takes the film out, if there is one",
        path);
  VideoContainer container;
  container.codec = avcodec_get_name(stream->codecpar->codec_id);
  if (!avcodec_find_decoder(stream->codecpar->codec_id))
    throw BadInput("{}: there is no decoder for its video ({})", path, container.codec);
  const Packets packets = ReadPackets(*input, stream->index);
  container.images = packets.shown;
  if (stream->nb_frames > packets.hidden)
    container.announced = static_cast<int>(stream->nb_frames) - packets.hidden;
  container.times = TimesOf(packets.times, *stream);
  container.ends_in_time = EndsInTime(packets, *stream);
  container.turn_deg = TurnOf(*stream);
  SetPixelRatio(*input, *stream, container);
  container.other_streams = OtherStreams(*input, stream);
  return container;
}

size_t TimeIndexOf(const VideoTimes& times, size_t next, double reported) {
  constexpr double kSame_s = 1e-6;  // seconds; below the finest unit in use
  const double time = reported - times.start;
  const auto begin =
      times.seconds.begin() + static_cast<std::ptrdiff_t>(std::min(next, times.seconds.size()));
  const auto found = std::lower_bound(begin, times.seconds.end(), time - kSame_s);
  if (found == times.seconds.end() || *found > time + kSame_s) return next;
  return static_cast<size_t>(found - times.seconds.begin());
}

std::optional<std::string> ReadVideoTag(const std::string& path, std::string_view name_end) {
  const Input input = Open(path);
  const AVStream* stream = input ? VideoStream(*input) : nullptr;
  if (!stream) return std::nullopt;
  for (const AVDictionary* tags : {stream->metadata, input->metadata}) {
    const AVDictionaryEntry* tag = nullptr;
    while ((tag = av_dict_get(tags, "", tag, AV_DICT_IGNORE_SUFFIX)))
      if (std::string_view(tag->key).ends_with(name_end)) return tag->value;
  }
  return std::nullopt;
}

}  // namespace oaslam
