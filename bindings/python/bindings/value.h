#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "casters.h"

namespace oaslam::python {

// A member of a value as Python's own types, with all of its bits, and back.
template <typename Member>
struct StateOf {
  static py::object Get(const Member& member) { return py::cast(member); }
  static Member From(py::handle state) { return state.cast<Member>(); }
};
template <typename Member>
struct StateOf<std::optional<Member>> {
  static py::object Get(const std::optional<Member>& member) {
    return member ? StateOf<Member>::Get(*member) : py::none();
  }
  static std::optional<Member> From(py::handle state) {
    return state.is_none() ? std::nullopt : std::optional(StateOf<Member>::From(state));
  }
};
template <int kRows, int kColumns, int kOptions>
struct StateOf<Eigen::Matrix<double, kRows, kColumns, kOptions>> {
  using Matrix = Eigen::Matrix<double, kRows, kColumns, kOptions>;
  static py::object Get(const Matrix& member) { return ArrayOf(member); }
  static Matrix From(py::handle state) {
    const auto numbers =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(state);
    if (!numbers || numbers.size() != kRows * kColumns) throw py::cast_error("no such matrix");
    return Eigen::Map<const Eigen::Matrix<double, kRows, kColumns,
                                          kColumns == 1 ? Eigen::ColMajor : Eigen::RowMajor>>(
        numbers.data());
  }
};
template <>
struct StateOf<Rigid3::Rotation> {
  static py::object Get(const Rigid3::Rotation& r) {
    return StateOf<Eigen::Vector4d>::Get(r.coeffs());
  }
  static Rigid3::Rotation From(py::handle state) {
    return Rigid3::Rotation(StateOf<Eigen::Vector4d>::From(state));
  }
};
// The rotation of a 4x4 array has other last bits.
template <>
struct StateOf<Rigid3> {
  static py::object Get(const Rigid3& pose) {
    return py::make_tuple(StateOf<Rigid3::Rotation>::Get(pose.rotation), ArrayOf(pose.translation));
  }
  static Rigid3 From(py::handle state) {
    const auto [rotation, translation] = state.cast<std::pair<py::object, py::object>>();
    return {StateOf<Rigid3::Rotation>::From(rotation), StateOf<Eigen::Vector3d>::From(translation)};
  }
};
template <>
struct StateOf<cv::Mat> {
  static py::object Get(const cv::Mat& image) { return ArrayOf(image); }
  static cv::Mat From(py::handle state) {
    return state.is_none() ? cv::Mat() : ImageView(state).clone();
  }
};

// Whether two states are equal; NaN is equal to NaN.
bool AreEqual(py::handle a, py::handle b);

// Throws ValueError where a state of a type does not have these members and no others.
void ExpectMembers(const py::dict& state, const std::vector<std::string>& names, py::handle type);
// Throws ValueError: the state of this member is of another type.
[[noreturn]] void RefuseMember(const std::string& name, py::handle state, py::handle type);

// Defines for all types of a scope how they are pickled, by any protocol: values by their state,
// enumerators by their names (another version may change the numbers), others not at all. What
// pybind11 inherits for the protocols 0 and 1 would end the program.
void DefinePickling(py::handle scope);

// A value whose members will all be set.
template <typename T>
T Blank() {
  return {};
}

// A class of values: pickled, copied and compared by its members. Each is declared as for
// py::class_, or by one of the functions below.
template <typename T>
class Value : public py::class_<T> {
 public:
  template <typename... Extra>
  Value(py::handle scope, const char* name, const Extra&... extra)
      : py::class_<T>(scope, name, extra...) {
    def(py::pickle([members = members_](const T& value) { return StateOfAll(*members, value); },
                   [members = members_, type = py::handle(*this)](const py::dict& state) {
                     return FromState(*members, state, type);
                   }));
    def(
        "__eq__",
        [members = members_](const T& a, const T& b) {
          for (const Member& member : *members)
            if (!AreEqual(member.get(a), member.get(b))) return false;
          return true;
        },
        py::is_operator());
  }

  template <typename... Args>
  Value& def(Args&&... args) {
    py::class_<T>::def(std::forward<Args>(args)...);
    return *this;
  }
  template <typename... Args>
  Value& def_static(Args&&... args) {
    py::class_<T>::def_static(std::forward<Args>(args)...);
    return *this;
  }
  template <typename... Args>
  Value& def_property(Args&&... args) {
    py::class_<T>::def_property(std::forward<Args>(args)...);
    return *this;
  }
  template <typename... Args>
  Value& def_property_readonly(Args&&... args) {
    py::class_<T>::def_property_readonly(std::forward<Args>(args)...);
    return *this;
  }
  template <typename M>
  Value& def_readwrite(const char* name, M T::*member, const char* text) {
    py::class_<T>::def_readwrite(name, member, text);
    return keep(name, member);
  }
  template <typename M>
  Value& def_readonly(const char* name, M T::*member, const char* text) {
    py::class_<T>::def_readonly(name, member, text);
    return keep(name, member);
  }
  // A container. Python gets a tuple: changes of a list would silently be lost.
  template <typename M>
  Value& def_tuple(const char* name, M T::*member, const char* text) {
    return keep(name, member)
        .def_property_readonly(
            name, [member](const T& value) { return py::tuple(py::cast(value.*member)); }, text);
  }
  // A matrix as an array.
  template <typename M>
  Value& def_array(const char* name, M T::*member, const char* text) {
    return keep(name, member)
        .def_property_readonly(
            name, [member](const T& value) { return ArrayOf(value.*member); }, text);
  }
  // The name of a file.
  Value& def_file_name(const char* name, std::string T::*member, const char* text) {
    const auto get = [member](const T& value) { return FileTextOf(value.*member); };
    return keep(name, get, [member](T& value, py::handle state) { value.*member = PathOf(state); })
        .def_property_readonly(name, get, text);
  }

  // A member that has no attribute of its name, or another one.
  template <typename M>
  Value& keep(const char* name, M T::*member) {
    return keep(
        name, [member](const T& value) { return StateOf<M>::Get(value.*member); },
        [member](T& value, py::handle state) { value.*member = StateOf<M>::From(state); });
  }
  Value& keep(const char* name, std::function<py::object(const T&)> get,
              std::function<void(T&, py::handle)> set) {
    members_->push_back({name, std::move(get), std::move(set)});
    return *this;
  }

 private:
  struct Member {
    std::string name;
    std::function<py::object(const T&)> get;
    std::function<void(T&, py::handle)> set;
  };
  using Members = std::vector<Member>;

  static py::dict StateOfAll(const Members& members, const T& value) {
    py::dict state;
    for (const Member& member : members) state[member.name.c_str()] = member.get(value);
    return state;
  }
  static T FromState(const Members& members, const py::dict& state, py::handle type) {
    std::vector<std::string> names;
    for (const Member& member : members) names.push_back(member.name);
    ExpectMembers(state, names, type);
    T value = Blank<T>();
    for (const Member& member : members) {
      try {
        member.set(value, state[member.name.c_str()]);
      } catch (const py::cast_error&) {
        RefuseMember(member.name, state[member.name.c_str()], type);
      } catch (const py::reference_cast_error&) {  // None where there must be a value
        RefuseMember(member.name, state[member.name.c_str()], type);
      }
    }
    return value;
  }

  std::shared_ptr<Members> members_ = std::make_shared<Members>();
};

}  // namespace oaslam::python
