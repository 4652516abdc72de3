#include "oaslam/io/video_container.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
#include <libavutil/log.h>
}

#include "oaslam/error.h"

namespace oaslam {
namespace {

struct CloseInput {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
};
using Input = std::unique_ptr<AVFormatContext, CloseInput>;

struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
using Packet = std::unique_ptr<AVPacket, FreePacket>;

Input Open(const std::string& path) {
  AVFormatContext* context = nullptr;
  // Not by a protocol that the name may look like.
  if (avformat_open_input(&context, ("file:" + path).c_str(), nullptr, nullptr) < 0) return nullptr;
  Input input(context);
  return avformat_find_stream_info(context, nullptr) < 0 ? nullptr : std::move(input);
}

// The first one, as OpenCV takes it.
const AVStream* VideoStream(const AVFormatContext& input) {
  for (unsigned i = 0; i < input.nb_streams; ++i)
    if (input.streams[i]->codecpar->codec_type == AVMEDIA_TYPE_VIDEO) return input.streams[i];
  return nullptr;
}

// In units of the stream, in the order of display; empty where a packet has no time, or where times begin anew.
std::vector<int64_t> DisplayTimes(AVFormatContext& input, int stream) {
  for (unsigned i = 0; i < input.nb_streams; ++i)
    if (static_cast<int>(i) != stream) input.streams[i]->discard = AVDISCARD_ALL;
  const Packet packet(av_packet_alloc());
  std::vector<int64_t> times;
  int64_t decoded = AV_NOPTS_VALUE;
  bool is_usable = true;
  for (; is_usable && av_read_frame(&input, packet.get()) >= 0; av_packet_unref(packet.get())) {
    if (packet->stream_index != stream) continue;
    // Times of decoding ascend in a stream of one piece.
    is_usable = packet->pts != AV_NOPTS_VALUE && (packet->dts == AV_NOPTS_VALUE || decoded == AV_NOPTS_VALUE || packet->dts >= decoded);
    if (packet->dts != AV_NOPTS_VALUE) decoded = packet->dts;
    if (!(packet->flags & AV_PKT_FLAG_DISCARD)) times.push_back(packet->pts);
  }
  if (!is_usable) return {};
  std::ranges::sort(times);
  return times;
}

}  // namespace

QuietFfmpeg::QuietFfmpeg() : level_(av_log_get_level()) { av_log_set_level(AV_LOG_QUIET); }
QuietFfmpeg::~QuietFfmpeg() { av_log_set_level(level_); }

int SpreadEqualTimes(std::vector<double>& ascending) {
  int moved = 0;
  double interval = 0;  // of an image before the equal ones
  for (size_t begin = 0; begin < ascending.size();) {
    const double time = ascending[begin];
    const auto above = std::upper_bound(ascending.begin() + static_cast<std::ptrdiff_t>(begin), ascending.end(), time);
    const size_t end = static_cast<size_t>(above - ascending.begin());
    const auto count = static_cast<double>(end - begin);
    const double step = above == ascending.end() ? interval : (*above - time) / count;
    for (size_t i = begin + 1; i < end; ++i, ++moved) ascending[i] = time + step * static_cast<double>(i - begin);
    interval = step;
    begin = end;
  }
  return moved;
}

VideoTimes ReadVideoTimes(const std::string& path) {
  const QuietFfmpeg quiet;
  const Input input = Open(path);
  const AVStream* stream = input ? VideoStream(*input) : nullptr;
  if (!stream) throw InputError(fmt::format("{}: neither a list of images nor a video that can be opened", path));
  const AVCodecID codec = stream->codecpar->codec_id;
  if (!avcodec_find_decoder(codec)) throw InputError(fmt::format("{}: there is no decoder for its video ({})", path, avcodec_get_name(codec)));
  const std::vector<int64_t> stored = DisplayTimes(*input, stream->index);
  VideoTimes times;
  if (stored.empty() || stored.front() == stored.back()) {
    if (stored.size() == 1) times.seconds = {0};
    return times;
  }
  const auto [num, den] = stream->time_base;
  const auto seconds = [num = num, den = den](int64_t units) { return static_cast<double>(units) * num / den; };
  for (const int64_t time : stored) times.seconds.push_back(seconds(time - stored.front()));
  if (stream->start_time != AV_NOPTS_VALUE) times.start = seconds(stored.front() - stream->start_time);
  times.repaired = SpreadEqualTimes(times.seconds);
  return times;
}

size_t TimeIndexOf(const VideoTimes& times, size_t next, double reported) {
  constexpr double kSame_s = 1e-6;  // stored times are of 10 microseconds at best
  const double time = reported - times.start;
  const auto begin = times.seconds.begin() + static_cast<std::ptrdiff_t>(std::min(next, times.seconds.size()));
  const auto found = std::lower_bound(begin, times.seconds.end(), time - kSame_s);
  return found != times.seconds.end() && *found <= time + kSame_s ? static_cast<size_t>(found - times.seconds.begin()) : next;
}

std::optional<std::string> ReadVideoTag(const std::string& path, std::string_view name_end) {
  const QuietFfmpeg quiet;
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
