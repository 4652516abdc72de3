#include "run_view.h"

namespace oaslam::apps {

void RunView::AddOptions(CLI::App& run) {
  run.add_flag("--viewer")
      ->description(
          "serve a page that shows the run: oaslam run --viewer --help lists its options");
}

}  // namespace oaslam::apps
