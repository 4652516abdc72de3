#pragma once

#include <Eigen/Core>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/rigid3.h"

namespace oaslam {

// Parses JSON that a client has sent. Throws InputError, with `what` as the name of the text.
nlohmann::json ParseJson(std::string_view text, const std::string& what);

// A value of JSON that a client has sent, with its place in the text, for messages. Functions throw
// InputError where it is not of the type that they return or out of bounds. The value must outlive
// this.
class JsonInput {
 public:
  JsonInput(const nlohmann::json& value, std::string place)
      : value_(&value), place_(std::move(place)) {}

  const nlohmann::json& value() const { return *value_; }
  const std::string& place() const { return place_; }

  // Of an object: a member, which must be there.
  JsonInput operator[](const std::string& key) const;
  // Of an object: a member; nothing where it is missing or null.
  std::optional<JsonInput> Find(const std::string& key) const;
  // Of an object: that it has no other members than these.
  void Only(std::initializer_list<std::string_view> keys) const;
  // Of an array.
  std::vector<JsonInput> Items(size_t min = 0,
                               size_t max = std::numeric_limits<size_t>::max()) const;

  double Number(double min = std::numeric_limits<double>::lowest(),
                double max = std::numeric_limits<double>::max()) const;
  int Integer(int min, int max) const;
  bool Boolean() const;
  const std::string& Text() const;
  Eigen::Vector3d Vector() const;  // [x, y, z]
  Rigid3 Pose() const;             // {"position": [x, y, z], "rotation": [x, y, z, w]}
  // x, y, z, w, which may be a little off unit length; the result is of unit length.
  Eigen::Quaterniond Rotation(double x, double y, double z, double w) const;

  [[noreturn]] void Refuse(const std::string& problem) const;

 private:
  const nlohmann::json* value_;
  std::string place_;
};

}  // namespace oaslam
