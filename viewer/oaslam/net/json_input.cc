#include "oaslam/net/json_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oaslam/util/bad_input.h"

namespace oaslam {

nlohmann::json ParseJson(std::string_view text, const std::string& what) {
  // The library recurses over nested values: deep ones would overflow the stack. No message of the
  // protocol is nested more than ten deep.
  constexpr int kDeepest = 32;
  const auto check_depth = [&](int depth, nlohmann::json::parse_event_t, const nlohmann::json&) {
    if (depth > kDeepest) throw BadInput("{}: is nested more than {} deep", what, kDeepest);
    return true;
  };
  if (text.empty()) throw InputError(what + ": is empty");
  try {
    return nlohmann::json::parse(text, check_depth);
  } catch (const nlohmann::json::parse_error& error) {
    throw BadInput("{}: is no JSON, as character {} shows", what, error.byte);
  } catch (const nlohmann::json::exception&) {
    throw InputError(what + ": has a number that is out of range");
  }
}

void JsonInput::Refuse(const std::string& problem) const {
  throw InputError(place_ + ": " + problem);
}

std::optional<JsonInput> JsonInput::Find(const std::string& key) const {
  if (!value_->is_object()) Refuse("must be an object");
  const auto member = value_->find(key);
  if (member == value_->end() || member->is_null()) return std::nullopt;
  return JsonInput(*member, place_ + "." + key);
}

JsonInput JsonInput::operator[](const std::string& key) const {
  const std::optional<JsonInput> member = Find(key);
  if (!member) Refuse("\"" + key + "\" is missing");
  return *member;
}

void JsonInput::Only(std::initializer_list<std::string_view> keys) const {
  if (!value_->is_object()) Refuse("must be an object");
  for (const auto& member : value_->items())
    if (std::ranges::find(keys, member.key()) == keys.end())
      Refuse(fmt::format("unknown key \"{}\", known: {}", member.key(), fmt::join(keys, ", ")));
}

std::vector<JsonInput> JsonInput::Items(size_t min, size_t max) const {
  if (!value_->is_array()) Refuse("must be an array");
  if (value_->size() < min)
    Refuse(fmt::format("has {} items, at least {} are needed", value_->size(), min));
  if (value_->size() > max)
    Refuse(fmt::format("has {} items, at most {} are allowed", value_->size(), max));
  std::vector<JsonInput> items;
  for (size_t i = 0; i < value_->size(); ++i)
    items.emplace_back((*value_)[i], fmt::format("{}[{}]", place_, i));
  return items;
}

double JsonInput::Number(double min, double max) const {
  if (!value_->is_number()) Refuse("must be a number");
  const double number = value_->get<double>();
  if (!(number >= min && number <= max))
    Refuse(fmt::format("{}, allowed: {} to {}", number, min, max));
  return number;
}

int JsonInput::Integer(int min, int max) const {
  const double number = Number(min, max);
  if (number != std::floor(number)) Refuse("must be an integer");
  return static_cast<int>(number);
}

bool JsonInput::Boolean() const {
  if (!value_->is_boolean()) Refuse("must be true or false");
  return value_->get<bool>();
}

const std::string& JsonInput::Text() const {
  if (!value_->is_string()) Refuse("must be a string");
  return value_->get_ref<const std::string&>();
}

Eigen::Vector3d JsonInput::Vector() const {
  const std::vector<JsonInput> items = Items(3, 3);
  return {items[0].Number(), items[1].Number(), items[2].Number()};
}

Eigen::Quaterniond JsonInput::Rotation(double x, double y, double z, double w) const {
  const Eigen::Quaterniond rotation(w, x, y, z);
  if (!(std::abs(rotation.norm() - 1) < 1e-2))
    Refuse(fmt::format("a quaternion of length {}, expected 1", rotation.norm()));
  return rotation.normalized();
}

Rigid3 JsonInput::Pose() const {
  Only({"position", "rotation"});
  const JsonInput rotation = (*this)["rotation"];
  const std::vector<JsonInput> q = rotation.Items(4, 4);
  return {rotation.Rotation(q[0].Number(), q[1].Number(), q[2].Number(), q[3].Number()),
          (*this)["position"].Vector()};
}

}  // namespace oaslam
