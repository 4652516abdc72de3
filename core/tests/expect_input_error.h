#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "matchers.h"
#include "oaslam/error.h"

namespace oaslam {

// The message of the InputError that `act` throws; the test fails if it throws none.
inline std::string InputErrorOf(const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError was thrown";
  return {};
}

}  // namespace oaslam

// Expects that the statement throws an InputError whose message the matcher takes.
#define EXPECT_INPUT_ERROR(statement, matcher) \
  EXPECT_THAT(::oaslam::InputErrorOf([&] { statement; }), matcher)
