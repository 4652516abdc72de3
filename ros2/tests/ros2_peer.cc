// Another node of ROS 2, for the tests: plays a recording, or prints what it hears.
//   ros2_peer play FILE [best_effort] [loops=N] [delay=SECONDS] [skip=TOPIC] [now]
//   ros2_peer listen SECONDS [best_effort] TOPIC=TYPE...
// now: the stamps are those of the clock. A line of `listen` is topic, nanoseconds of the clock,
// and the bytes in hexadecimal.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "oaslam/recordings/recording_reader.h"
#include "oaslam/ros2/dds_node.h"
#include "oaslam/util/stopwatch.h"
#ifdef OASLAM_FAST_DDS
#include "fast_node.h"
using Node = oaslam::FastNode;
#else
using Node = oaslam::DdsNode;
#endif

namespace oaslam {
namespace {

int64_t Now() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

// Of a message that begins with a header, or of the first transform.
void SetStamp(int64_t stamp, bool is_transform, ByteBuffer& message) {
  const size_t at = is_transform ? 8 : 4;
  constexpr int64_t kSecond = 1'000'000'000;
  const auto seconds = static_cast<int32_t>(stamp / kSecond);
  const auto rest = static_cast<uint32_t>(stamp % kSecond);
  std::memcpy(message.data() + at, &seconds, sizeof seconds);
  std::memcpy(message.data() + at + 4, &rest, sizeof rest);
}

struct Settings {
  bool is_best_effort = false, is_now = false;
  int loops = 1;
  double delay = 0;
  std::vector<std::string> skipped;
};

void Wait(Node& node, double until) {
  for (double now = SteadySeconds(); now < until; now = SteadySeconds()) node.Wait(until - now);
}

void Play(Node& node, const std::string& path, const Settings& settings) {
  std::map<std::string, int> topics;
  const auto open = [&] {
    return OpenRecording(path, [](const RecordedTopic&) { return kWholeMessage; });
  };
  const auto all = open();
  while (const auto message = all->Next()) {
    const RecordedTopic& topic = *message->topic;
    if (topics.contains(topic.name) || std::ranges::count(settings.skipped, topic.name) > 0)
      continue;
    const bool is_static = topic.name == "/tf_static", is_image = topic.type.ends_with("Image");
    topics[topic.name] = node.Publish(
        topic.name, topic.type,
        {.is_reliable = !(settings.is_best_effort && is_image), .is_latched = is_static});
  }
  constexpr double kDiscovery = 1.5;  // seconds
  double begin = SteadySeconds() + kDiscovery + settings.delay;
  for (int loop = 0; loop < settings.loops; ++loop) {
    const auto reader = open();
    int64_t first = 0;
    while (const auto message = reader->Next()) {
      const auto topic = topics.find(message->topic->name);
      if (topic == topics.end()) continue;
      if (first == 0) first = message->log_time;
      Wait(node, begin + 1e-9 * static_cast<double>(message->log_time - first));
      ByteBuffer bytes(message->data.begin(), message->data.end());
      if (settings.is_now) SetStamp(Now(), message->topic->type == "tf2_msgs/TFMessage", bytes);
      node.Write(topic->second, bytes);
    }
    begin = SteadySeconds();
  }
  constexpr double kRest = 1;  // seconds in which what is on its way arrives
  Wait(node, SteadySeconds() + kRest);
}

void Listen(Node& node, double seconds, bool is_reliable, const std::vector<std::string>& topics) {
  for (const std::string& topic : topics) {
    const size_t sign = topic.find('=');
    const std::string name = topic.substr(0, sign), type = topic.substr(sign + 1);
    // As RViz would: latched where that is offered.
    const bool is_latched = type == "nav_msgs/Path" || type.find("Marker") != std::string::npos ||
                            type.find("3D") != std::string::npos;
    node.Read({name, type, MessageEncoding::kCdr, "cdr"},
              {.is_reliable = is_reliable, .is_latched = is_latched, .depth = 100},
              [](const RecordedMessage& message, uint64_t) {
                std::string text;
                for (const uint8_t byte : message.data) text += fmt::format("{:02x}", byte);
                fmt::print("{} {} {}\n", message.topic->name, Now(), text);
                std::fflush(stdout);
              });
  }
  Wait(node, SteadySeconds() + seconds);
}

int Run(const std::vector<std::string>& arguments) {
  const char* domain = std::getenv("ROS_DOMAIN_ID");
  Node node(domain ? static_cast<uint32_t>(std::stoul(domain)) : 0);
  Settings settings;
  std::vector<std::string> topics;
  for (size_t i = 2; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const std::string value = argument.substr(argument.find('=') + 1);
    if (argument == "best_effort")
      settings.is_best_effort = true;
    else if (argument == "now")
      settings.is_now = true;
    else if (argument.starts_with("loops="))
      settings.loops = std::stoi(value);
    else if (argument.starts_with("delay="))
      settings.delay = std::stod(value);
    else if (argument.starts_with("skip="))
      settings.skipped.push_back(value);
    else
      topics.push_back(argument);
  }
  if (arguments.at(0) == "play")
    Play(node, arguments.at(1), settings);
  else
    Listen(node, std::stod(arguments.at(1)), !settings.is_best_effort, topics);
  return 0;
}

}  // namespace
}  // namespace oaslam

int main(int argc, char** argv) { return oaslam::Run({argv + 1, argv + argc}); }
