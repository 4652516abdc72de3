#include "failures.h"

#include <stdexcept>
#include <string>

#include "oaslam/error.h"

namespace oaslam::apps {

void Failures::Throw() const {
  if (failures_.size() == 1) std::rethrow_exception(failures_.front());
  std::string text;
  bool are_of_input = true;
  for (const std::exception_ptr& failure : failures_) {
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& error) {
      are_of_input = are_of_input && dynamic_cast<const InputError*>(&error) != nullptr;
      text += (text.empty() ? "" : "\n") + std::string(error.what());
    }
  }
  if (text.empty()) return;
  if (are_of_input) throw InputError(text);
  throw std::runtime_error(text);
}

}  // namespace oaslam::apps
