#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "oaslam/recordings/recording_reader.h"

namespace oaslam {

// The value of the environment variable CYCLONEDDS_URI with which nodes stay on this machine.
inline constexpr char kLoopbackOnly[] =
    R"(<General><Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>)"
    R"(<AllowMulticast>false</AllowMulticast></General>)"
    R"(<Discovery><Peers><Peer address="127.0.0.1"/></Peers>)"
    R"(<ParticipantIndex>auto</ParticipantIndex>)"
    R"(<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex></Discovery>)";

// A quality of service, as ROS 2 has them.
struct TopicQuality {
  bool is_reliable = true;  // else best effort
  bool is_latched = false;  // transient local: those who come later get the last messages, too
  int depth = 10;           // messages kept
};

// A topic that another program publishes.
struct Publication {
  std::string topic, type;  // as in RecordedTopic: "/camera/image_raw", "sensor_msgs/Image"
  bool is_reliable = false;
};

// A node among those of ROS 2, by CycloneDDS, whose messages are bytes in CDR. The environment
// variable CYCLONEDDS_URI is heard. Write may be called by any thread, all else by one.
class DdsNode {
 public:
  // `publisher`: differs between the publishers of a topic.
  using Take = std::function<void(const RecordedMessage& message, uint64_t publisher)>;

  // Throws InputError where the network cannot be used.
  explicit DdsNode(uint32_t domain);
  ~DdsNode();
  DdsNode(const DdsNode&) = delete;
  DdsNode& operator=(const DdsNode&) = delete;

  // Wait hands each message of this topic to `take`. Another call for the topic replaces the first.
  void Read(const RecordedTopic& topic, const TopicQuality& quality, Take take);
  // The publishers that a topic is read from: those of its type, and of a quality that suffices.
  std::vector<uint64_t> Publishers(const std::string& topic) const;
  // Returns the number for Write.
  int Publish(const std::string& topic, const std::string& type, const TopicQuality& quality);
  int CountSubscribers(int topic) const;
  // Nobody needs to hear it. Drops the message where DDS refuses it.
  void Write(int topic, ByteView message);

  // Waits for messages and takes them, for so long at most.
  void Wait(double seconds);
  // What others publish, as far as it is known by now; each publisher by itself.
  std::vector<Publication> Publications() const;

 private:
  struct Reader;

  int participant_ = 0, discovery_ = 0, waitset_ = 0;
  std::map<std::string, std::unique_ptr<Reader>> readers_;  // by topic
  std::vector<int> writers_;
};

}  // namespace oaslam
