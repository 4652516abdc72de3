#include "optional_values.h"

#include <algorithm>

#include "oaslam/formats/text.h"

namespace oaslam::apps {

std::vector<std::string> WithOptionalValues(int argc, const char* const* argv) {
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i) {
    std::string argument = argv[i];
    if (argument == "--") {  // what follows is no option
      arguments.insert(arguments.end(), argv + i, argv + argc);
      break;
    }
    if (argument == "--viewer" || argument == "--follow") {
      const bool has_value = i + 1 < argc && ParseNumber(argv[i + 1]);
      const std::string if_left_out = argument == "--viewer" ? std::to_string(kViewerPort) : "0";
      argument += "=" + (has_value ? argv[++i] : if_left_out);
    }
    arguments.push_back(std::move(argument));
  }
  std::ranges::reverse(arguments);
  return arguments;
}

}  // namespace oaslam::apps
