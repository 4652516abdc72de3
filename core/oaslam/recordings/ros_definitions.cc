#include "oaslam/recordings/ros_definitions.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <vector>

#include "oaslam/formats/text.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// As in ROS 2 from Humble on, and vision_msgs from 4.0 on.
const std::map<std::string_view, std::string_view> kDefinitions = {
    {"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"},
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    {"diagnostic_msgs/DiagnosticArray",
     "std_msgs/Header header\n"
     "diagnostic_msgs/DiagnosticStatus[] status\n"},
    {"diagnostic_msgs/DiagnosticStatus",
     "uint8 level\n"
     "string name\n"
     "string message\n"
     "string hardware_id\n"
     "diagnostic_msgs/KeyValue[] values\n"},
    {"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Pose",
     "geometry_msgs/Point position\n"
     "geometry_msgs/Quaternion orientation\n"},
    {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/PoseWithCovarianceStamped",
     "std_msgs/Header header\n"
     "geometry_msgs/PoseWithCovariance pose\n"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    {"geometry_msgs/Transform",
     "geometry_msgs/Vector3 translation\n"
     "geometry_msgs/Quaternion rotation\n"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\n"
     "string child_frame_id\n"
     "geometry_msgs/Transform transform\n"},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\n"
     "string child_frame_id\n"
     "geometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
    {"rcl_interfaces/Log",
     "builtin_interfaces/Time stamp\n"
     "uint8 level\n"
     "string name\n"
     "string msg\n"
     "string file\n"
     "string function\n"
     "uint32 line\n"},
    {"sensor_msgs/CameraInfo",
     "std_msgs/Header header\n"
     "uint32 height\n"
     "uint32 width\n"
     "string distortion_model\n"
     "float64[] d\n"
     "float64[9] k\n"
     "float64[9] r\n"
     "float64[12] p\n"
     "uint32 binning_x\n"
     "uint32 binning_y\n"
     "sensor_msgs/RegionOfInterest roi\n"},
    {"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    {"sensor_msgs/PointCloud2",
     "std_msgs/Header header\n"
     "uint32 height\n"
     "uint32 width\n"
     "sensor_msgs/PointField[] fields\n"
     "bool is_bigendian\n"
     "uint32 point_step\n"
     "uint32 row_step\n"
     "uint8[] data\n"
     "bool is_dense\n"},
    {"sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
    {"sensor_msgs/RegionOfInterest",
     "uint32 x_offset\n"
     "uint32 y_offset\n"
     "uint32 height\n"
     "uint32 width\n"
     "bool do_rectify\n"},
    {"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"vision_msgs/BoundingBox2D",
     "vision_msgs/Pose2D center\n"
     "float64 size_x\n"
     "float64 size_y\n"},
    {"vision_msgs/BoundingBox3D", "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n"},
    {"vision_msgs/Detection2D",
     "std_msgs/Header header\n"
     "vision_msgs/ObjectHypothesisWithPose[] results\n"
     "vision_msgs/BoundingBox2D bbox\n"
     "string id\n"},
    {"vision_msgs/Detection2DArray",
     "std_msgs/Header header\n"
     "vision_msgs/Detection2D[] detections\n"},
    {"vision_msgs/Detection3D",
     "std_msgs/Header header\n"
     "vision_msgs/ObjectHypothesisWithPose[] results\n"
     "vision_msgs/BoundingBox3D bbox\n"
     "string id\n"},
    {"vision_msgs/Detection3DArray",
     "std_msgs/Header header\n"
     "vision_msgs/Detection3D[] detections\n"},
    {"vision_msgs/ObjectHypothesis", "string class_id\nfloat64 score\n"},
    {"vision_msgs/ObjectHypothesisWithPose",
     "vision_msgs/ObjectHypothesis hypothesis\n"
     "geometry_msgs/PoseWithCovariance pose\n"},
    {"vision_msgs/Point2D", "float64 x\nfloat64 y\n"},
    {"vision_msgs/Pose2D", "vision_msgs/Point2D position\nfloat64 theta\n"},
    {"visualization_msgs/Marker",
     "std_msgs/Header header\n"
     "string ns\n"
     "int32 id\n"
     "int32 type\n"
     "int32 action\n"
     "geometry_msgs/Pose pose\n"
     "geometry_msgs/Vector3 scale\n"
     "std_msgs/ColorRGBA color\n"
     "builtin_interfaces/Duration lifetime\n"
     "bool frame_locked\n"
     "geometry_msgs/Point[] points\n"
     "std_msgs/ColorRGBA[] colors\n"
     "string texture_resource\n"
     "sensor_msgs/CompressedImage texture\n"
     "visualization_msgs/UVCoordinate[] uv_coordinates\n"
     "string text\n"
     "string mesh_resource\n"
     "visualization_msgs/MeshFile mesh_file\n"
     "bool mesh_use_embedded_materials\n"},
    {"visualization_msgs/MarkerArray", "visualization_msgs/Marker[] markers\n"},
    {"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"},
    {"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
};

std::string_view DefinitionOf(std::string_view type) {
  const auto found = kDefinitions.find(type);
  OASLAM_CHECK(found != kDefinitions.end());
  return found->second;
}

}  // namespace

std::string RosDefinition(const std::string& type) {
  std::vector<std::string_view> types{type};
  std::string text;
  for (size_t i = 0; i < types.size(); ++i) {
    const std::string_view definition = DefinitionOf(types[i]);
    if (i > 0) text += std::string(80, '=') + "\nMSG: " + std::string(types[i]) + "\n";
    text += definition;
    for (const std::string_view line : SplitLines(definition)) {
      const std::string_view field = line.substr(0, line.find_first_of("[ "));
      if (field.find('/') != std::string_view::npos && std::ranges::count(types, field) == 0)
        types.push_back(field);
    }
  }
  return text;
}

}  // namespace oaslam
