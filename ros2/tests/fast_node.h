#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <chrono>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "oaslam/ros2/dds_node.h"

namespace oaslam {

// The same as DdsNode by eProsima Fast DDS, the library below most nodes of ROS 2, on this machine
// alone. Version 2 of the library.
class FastNode {
 public:
  explicit FastNode(uint32_t domain) {
    using namespace eprosima::fastrtps::rtps;
    eprosima::fastdds::dds::DomainParticipantQos qos;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    constexpr uint32_t kPort = 7410, kPerDomain = 250, kPeers = 10;
    for (uint32_t peer = 0; peer < kPeers; ++peer) {
      Locator_t at;
      IPLocator::setIPv4(at, 127, 0, 0, 1);
      at.port = kPort + kPerDomain * domain + 2 * peer;
      qos.wire_protocol().builtin.initialPeersList.push_back(at);
    }
    using eprosima::fastdds::dds::DomainParticipantFactory;
    participant_ = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
  }

  int Publish(const std::string& name, const std::string& type, const TopicQuality& quality) {
    using namespace eprosima::fastdds::dds;
    DataWriterQos qos;
    Set(qos, quality);
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
    writers_.push_back(participant_->create_publisher(PUBLISHER_QOS_DEFAULT)
                           ->create_datawriter(TopicOf(name, type), qos));
    return static_cast<int>(writers_.size()) - 1;
  }

  void Write(int topic, ByteView message) {
    ByteBuffer bytes(message.begin(), message.end());
    writers_[static_cast<size_t>(topic)]->write(&bytes);
  }

  void Read(const RecordedTopic& topic, const TopicQuality& quality, DdsNode::Take take) {
    using namespace eprosima::fastdds::dds;
    DataReaderQos qos;
    Set(qos, quality);
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* reader = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT)
                       ->create_datareader(TopicOf(topic.name, topic.type), qos);
    readers_.push_back({topic, std::move(take), reader});
  }

  void Wait(double seconds) {
    ByteBuffer bytes;
    eprosima::fastdds::dds::SampleInfo info;
    bool has_any = false;
    for (Reader& reader : readers_)
      while (reader.entity->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
        has_any = true;
        if (info.valid_data) reader.take({&reader.topic, 0, bytes}, 0);
      }
    constexpr double kMost = 1e-3;
    if (!has_any)
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(seconds, kMost)));
  }

 private:
  struct Reader {
    RecordedTopic topic;
    DdsNode::Take take;
    eprosima::fastdds::dds::DataReader* entity;
  };

  // The bytes of a message, of whatever type.
  class Bytes : public eprosima::fastdds::dds::TopicDataType {
   public:
    using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
    explicit Bytes(const std::string& type) {
      constexpr uint32_t kExpected = 1 << 16;  // it grows
      setName(type.c_str());
      m_typeSize = kExpected;
      m_isGetKeyDefined = false;
      auto_fill_type_object(false);
      auto_fill_type_information(false);  // as ROS 2 does
    }
    bool serialize(void* data, Payload* payload) override {
      const auto& bytes = *static_cast<ByteBuffer*>(data);
      if (payload->max_size < bytes.size()) return false;
      std::memcpy(payload->data, bytes.data(), bytes.size());
      payload->length = static_cast<uint32_t>(bytes.size());
      payload->encapsulation = CDR_LE;
      return true;
    }
    bool deserialize(Payload* payload, void* data) override {
      static_cast<ByteBuffer*>(data)->assign(payload->data, payload->data + payload->length);
      return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
      return [data] { return static_cast<uint32_t>(static_cast<ByteBuffer*>(data)->size()); };
    }
    void* createData() override { return new ByteBuffer; }
    void deleteData(void* data) override { delete static_cast<ByteBuffer*>(data); }
    bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
  };

  template <typename Qos>
  static void Set(Qos& qos, const TopicQuality& quality) {
    using namespace eprosima::fastdds::dds;
    qos.reliability().kind =
        quality.is_reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind =
        quality.is_latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.history().depth = quality.depth;
  }

  eprosima::fastdds::dds::Topic* TopicOf(const std::string& name, const std::string& type) {
    const size_t slash = type.find('/');
    const std::string dds_type =
        type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
    eprosima::fastdds::dds::TypeSupport(new Bytes(dds_type)).register_type(participant_);
    return participant_->create_topic("rt" + name, dds_type,
                                      eprosima::fastdds::dds::TOPIC_QOS_DEFAULT);
  }

  eprosima::fastdds::dds::DomainParticipant* participant_;
  std::vector<eprosima::fastdds::dds::DataWriter*> writers_;
  std::vector<Reader> readers_;
};

}  // namespace oaslam
