#include "oaslam/recordings/topic_choice.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace oaslam {
namespace {

constexpr std::string_view kCompressed = "/compressed";

// The name of a topic of images without the transport.
std::string BaseOf(const TopicSummary& topic) {
  const std::string& name = topic.topic.name;
  return topic.kind == TopicKind::kCompressedImage && name.ends_with(kCompressed)
             ? name.substr(0, name.size() - kCompressed.size())
             : name;
}

std::string LastWord(const std::string& name) { return name.substr(name.rfind('/') + 1); }

bool HasImages(const TopicSummary& topic) {
  return (topic.kind == TopicKind::kImage || topic.kind == TopicKind::kCompressedImage) &&
         topic.messages > 0 && topic.problem.empty();
}

bool IsColorOrGrey(const TopicSummary& topic) {
  const auto begins_with = [&](std::string_view text) { return topic.format.starts_with(text); };
  return HasImages(topic) && !IsDepth(topic) && !begins_with("16UC1") && !begins_with("32FC1") &&
         topic.format.find("compressedDepth") == std::string::npos;
}

std::string LineOf(const TopicSummary& topic) {
  std::string text = fmt::format("{}: {}", topic.topic.name, topic.topic.type);
  if (!topic.format.empty()) text += fmt::format(" {}", topic.format.substr(0, 60));
  if (topic.width > 0) text += fmt::format(" {} x {}", topic.width, topic.height);
  if (topic.topic.encoding == MessageEncoding::kOther)
    text += fmt::format(", in the encoding \"{}\", which is not read",
                        topic.topic.encoding_name.substr(0, 20));
  text += fmt::format(", {} messages", topic.messages);
  if (topic.Rate() > 0) text += fmt::format(", {:.1f} Hz", topic.Rate());
  if (!topic.problem.empty()) text += fmt::format(", not used: {}", topic.problem);
  return text;
}

std::string ListOf(const std::vector<const TopicSummary*>& topics) {
  std::vector<std::string> lines;
  for (const TopicSummary* topic : topics) lines.push_back(LineOf(*topic));
  return fmt::format("{}", fmt::join(lines, "; "));
}

std::string ListOfAll(const RecordingSummary& summary) {
  return summary.topics.empty() ? "it has no messages"
                                : fmt::format("it has {}", fmt::join(TopicLines(summary), "; "));
}

}  // namespace

const TopicSummary& ChooseImages(const RecordingSummary& summary, const std::string& asked) {
  if (!asked.empty()) {
    const TopicSummary* topic = summary.Find(asked);
    if (!topic) topic = summary.Find(asked + std::string(kCompressed));
    if (!topic || !HasImages(*topic))
      throw BadInput("{}: --topic {}: {}; {}", summary.path, asked,
                     topic ? "has no images" : "is not there", ListOfAll(summary));
    if (!IsColorOrGrey(*topic))
      throw BadInput("{}: --topic {}: has depths ({}), which --depth takes", summary.path, asked,
                     topic->format);
    return *topic;
  }
  std::vector<const TopicSummary*> found;
  for (const TopicSummary& topic : summary.topics) {
    if (!IsColorOrGrey(topic)) continue;
    // The topics are ordered by name, so that the compressed form comes after the images.
    const bool is_second = std::ranges::any_of(
        found, [&](const TopicSummary* other) { return BaseOf(*other) == BaseOf(topic); });
    if (!is_second) found.push_back(&topic);
  }
  if (found.empty())
    throw BadInput("{}: no topic of images that can be read; {}", summary.path, ListOfAll(summary));
  if (found.size() > 1)
    throw BadInput("{}: {} topics of images, --topic NAME chooses one: {}", summary.path,
                   found.size(), ListOf(found));
  return *found.front();
}

const TopicSummary* InfoOf(const RecordingSummary& summary, const TopicSummary& images) {
  const std::string base = BaseOf(images);
  const TopicSummary* beside = summary.Find(base.substr(0, base.rfind('/') + 1) + "camera_info");
  if (beside && beside->info) return beside;
  const TopicSummary* found = nullptr;
  for (const TopicSummary& topic : summary.topics) {
    if (!topic.info || images.frame.empty() || topic.frame != images.frame) continue;
    if (found) return nullptr;
    found = &topic;
  }
  return found;
}

bool IsRectified(const TopicSummary& images) {
  return LastWord(BaseOf(images)).starts_with("image_rect");
}

std::optional<Camera> CameraOf(const RecordingSummary& summary, const TopicSummary& images) {
  const TopicSummary* info = InfoOf(summary, images);
  if (!info) return std::nullopt;
  return CameraOfInfo(*info->info, IsRectified(images),
                      fmt::format("{}: {}", summary.path, info->topic.name));
}

bool IsDepth(const TopicSummary& topic) {
  return topic.kind == TopicKind::kImage && (topic.format == "16UC1" || topic.format == "32FC1");
}

const TopicSummary* ChooseDepths(const RecordingSummary& summary, const TopicSummary& images) {
  std::vector<const TopicSummary*> registered, others;
  for (const TopicSummary& topic : summary.topics) {
    if (!IsDepth(topic)) continue;
    if (topic.frame == images.frame)
      registered.push_back(&topic);
    else if (InfoOf(summary, topic) && summary.Between(images.frame, topic.frame))
      others.push_back(&topic);
  }
  const auto& found = registered.empty() ? others : registered;
  return found.size() == 1 ? found.front() : nullptr;
}

ImuTopics ChooseImu(const RecordingSummary& summary) {
  std::vector<const TopicSummary*> both, gyroscopes, accelerometers;
  for (const TopicSummary& topic : summary.topics) {
    const bool turns = !topic.gyroscope.times.empty();
    const bool moves = !topic.accelerometer.times.empty();
    if (turns && moves)
      both.push_back(&topic);
    else if (turns)
      gyroscopes.push_back(&topic);
    else if (moves)
      accelerometers.push_back(&topic);
  }
  if (both.size() == 1) return {both.front(), both.front()};
  if (!both.empty() || gyroscopes.size() != 1) return {};
  return {gyroscopes.front(), accelerometers.size() == 1 ? accelerometers.front() : nullptr};
}

std::vector<std::string> TopicLines(const RecordingSummary& summary) {
  std::vector<std::string> lines;
  for (const TopicSummary& topic : summary.topics) lines.push_back(LineOf(topic));
  return lines;
}

}  // namespace oaslam
