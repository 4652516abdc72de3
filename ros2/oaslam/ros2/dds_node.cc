#include "oaslam/ros2/dds_node.h"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "oaslam/ros2/raw_type.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

constexpr std::string_view kTopics = "rt", kMessages = "::msg::dds_::";

// "sensor_msgs::msg::dds_::Image_" of "sensor_msgs/Image".
std::string DdsType(const std::string& type) {
  const size_t slash = type.find('/');
  return type.substr(0, slash) + std::string(kMessages) + type.substr(slash + 1) + "_";
}

// The reverse; empty where it is no message of ROS 2.
std::string RosType(const std::string& type) {
  const size_t at = type.find(kMessages);
  if (at == std::string::npos || !type.ends_with('_')) return "";
  const size_t name = at + kMessages.size();
  return type.substr(0, at) + "/" + type.substr(name, type.size() - name - 1);
}

int Check(int result, const std::string& what) {
  if (result < 0) throw BadInput("ROS 2: {}: {}", what, dds_strretcode(result));
  return result;
}

struct Quality {
  explicit Quality(const TopicQuality& quality) {
    constexpr dds_duration_t kMostBlocking = DDS_MSECS(100);
    dds_qset_reliability(
        qos, quality.is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
        kMostBlocking);
    dds_qset_durability(
        qos, quality.is_latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, quality.depth);
    if (quality.is_latched)
      dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, quality.depth,
                                  DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  ~Quality() { dds_delete_qos(qos); }
  Quality(const Quality&) = delete;
  Quality& operator=(const Quality&) = delete;
  dds_qos_t* qos = dds_create_qos();
};

int NewTopic(int participant, const std::string& name, const std::string& type) {
  ddsi_sertype* raw = NewRawType(DdsType(type));
  const std::string dds_name = std::string(kTopics) + name;
  const int topic =
      dds_create_topic_sertype(participant, dds_name.c_str(), &raw, nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(raw);
  return Check(topic, name);
}

}  // namespace

struct DdsNode::Reader {
  RecordedTopic topic;
  Take take;
  int entity = 0, dds_topic = 0;

  ~Reader() {
    dds_delete(entity);
    dds_delete(dds_topic);
  }

  void TakeAll() {
    constexpr size_t kAtOnce = 16;
    constexpr int kMostPasses = 64;  // of a flood: others, and the end, must get their turn
    std::array<ddsi_serdata*, kAtOnce> samples{};
    std::array<dds_sample_info_t, kAtOnce> infos;
    for (int pass = 0; pass < kMostPasses; ++pass) {
      const int count = dds_takecdr(entity, samples.data(), kAtOnce, infos.data(), DDS_ANY_STATE);
      for (int i = 0; i < count; ++i) {
        const auto& info = infos[static_cast<size_t>(i)];
        ddsi_serdata* sample = samples[static_cast<size_t>(i)];
        if (info.valid_data)
          take({&topic, info.source_timestamp, BytesOf(*sample)}, info.publication_handle);
        ddsi_serdata_unref(sample);
      }
      if (count < static_cast<int>(kAtOnce)) break;
    }
  }
};

DdsNode::DdsNode(uint32_t domain)
    : participant_(Check(dds_create_participant(domain, nullptr, nullptr),
                         fmt::format("domain {} cannot be joined", domain))) {
  discovery_ =
      Check(dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
            "discovery");
  waitset_ = Check(dds_create_waitset(participant_), "waiting");
}

DdsNode::~DdsNode() {
  readers_.clear();
  dds_delete(participant_);
}

void DdsNode::Read(const RecordedTopic& topic, const TopicQuality& quality, Take take) {
  readers_.erase(topic.name);
  auto reader = std::make_unique<Reader>();
  reader->topic = topic;
  reader->topic.encoding = MessageEncoding::kCdr;
  reader->take = std::move(take);
  reader->dds_topic = NewTopic(participant_, topic.name, topic.type);
  const Quality qos(quality);
  reader->entity =
      Check(dds_create_reader(participant_, reader->dds_topic, qos.qos, nullptr), topic.name);
  Check(dds_set_status_mask(reader->entity, DDS_DATA_AVAILABLE_STATUS), topic.name);
  Check(dds_waitset_attach(waitset_, reader->entity, reinterpret_cast<dds_attach_t>(reader.get())),
        topic.name);
  readers_[topic.name] = std::move(reader);
}

std::vector<uint64_t> DdsNode::Publishers(const std::string& topic) const {
  constexpr size_t kMost = 100;
  const auto reader = readers_.find(topic);
  if (reader == readers_.end()) return {};
  std::vector<uint64_t> found(kMost);
  const int count = dds_get_matched_publications(reader->second->entity, found.data(), kMost);
  found.resize(std::clamp<size_t>(static_cast<size_t>(std::max(count, 0)), 0, kMost));
  return found;
}

int DdsNode::Publish(const std::string& topic, const std::string& type,
                     const TopicQuality& quality) {
  const Quality qos(quality);
  const int entity =
      dds_create_writer(participant_, NewTopic(participant_, topic, type), qos.qos, nullptr);
  writers_.push_back(Check(entity, topic));
  return static_cast<int>(writers_.size()) - 1;
}

int DdsNode::CountSubscribers(int topic) const {
  return std::max(0,
                  dds_get_matched_subscriptions(writers_[static_cast<size_t>(topic)], nullptr, 0));
}

void DdsNode::Write(int topic, ByteView message) {
  dds_write(writers_[static_cast<size_t>(topic)], &message);
}

void DdsNode::Wait(double seconds) {
  constexpr size_t kMost = 32;  // topics that are read
  std::array<dds_attach_t, kMost> ready;
  const int count =
      dds_waitset_wait(waitset_, ready.data(), kMost, static_cast<dds_duration_t>(seconds * 1e9));
  for (int i = 0; i < count; ++i)
    reinterpret_cast<Reader*>(ready[static_cast<size_t>(i)])->TakeAll();
}

std::vector<Publication> DdsNode::Publications() const {
  constexpr size_t kMost = 5000;
  std::vector<void*> samples(kMost, nullptr);
  std::vector<dds_sample_info_t> infos(kMost);
  dds_guid_t own{};
  dds_get_guid(participant_, &own);
  // Those that have gone would fill the reader in the course of time.
  constexpr uint32_t kGone = DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE |
                             DDS_NOT_ALIVE_DISPOSED_INSTANCE_STATE |
                             DDS_NOT_ALIVE_NO_WRITERS_INSTANCE_STATE;
  const int gone = dds_take_mask(discovery_, samples.data(), infos.data(), kMost, kMost, kGone);
  if (gone > 0) dds_return_loan(discovery_, samples.data(), gone);
  const int count = dds_read(discovery_, samples.data(), infos.data(), kMost, kMost);
  std::vector<Publication> found;
  for (int i = 0; i < count; ++i) {
    const auto& endpoint =
        *static_cast<const dds_builtintopic_endpoint_t*>(samples[static_cast<size_t>(i)]);
    const dds_sample_info_t& info = infos[static_cast<size_t>(i)];
    if (!info.valid_data || info.instance_state != DDS_ALIVE_INSTANCE_STATE) continue;
    if (std::memcmp(&endpoint.participant_key, &own, sizeof own) == 0) continue;
    const std::string name = endpoint.topic_name, type = RosType(endpoint.type_name);
    if (!name.starts_with(std::string(kTopics) + "/") || type.empty()) continue;
    dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
    dds_qget_reliability(endpoint.qos, &reliability, nullptr);
    found.push_back({name.substr(kTopics.size()), type, reliability == DDS_RELIABILITY_RELIABLE});
  }
  if (count > 0) dds_return_loan(discovery_, samples.data(), count);
  return found;
}

}  // namespace oaslam
