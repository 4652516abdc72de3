#pragma once

#include <exception>
#include <vector>

namespace oaslam::apps {

// Steps of which each is tried, whatever became of those before: what can be saved is saved.
class Failures {
 public:
  template <typename Step>
  void Try(const Step& step) {
    try {
      step();
    } catch (const std::exception&) {
      Add(std::current_exception());
    }
  }
  // Null: nothing.
  void Add(std::exception_ptr failure) {
    if (failure) failures_.push_back(std::move(failure));
  }
  bool Any() const { return !failures_.empty(); }
  // If there are failures, throws them as one, with a line for each; an InputError if all are.
  void Throw() const;

 private:
  std::vector<std::exception_ptr> failures_;
};

}  // namespace oaslam::apps
