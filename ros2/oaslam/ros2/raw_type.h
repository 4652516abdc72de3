#pragma once

#include <string>

#include "oaslam/recordings/record_bytes.h"

struct ddsi_sertype;
struct ddsi_serdata;

namespace oaslam {

// A type of DDS whose samples are their bytes in CDR with the head of four bytes, of whatever type
// of ROS 2: recordings/ and exports/ read and make these. dds_write takes a ByteView.
// `type`: "sensor_msgs::msg::dds_::Image_". dds_create_topic_sertype takes the result over.
ddsi_sertype* NewRawType(const std::string& type);

// The bytes of a sample of such a type (dds_takecdr), valid as long as the sample.
ByteView BytesOf(const ddsi_serdata& sample);

}  // namespace oaslam
