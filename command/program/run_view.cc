#include "run_view.h"

namespace oaslam::apps {

void RunView::AddOptions(CLI::App& run) {
  auto* viewer = run.add_flag("--viewer")->description("serve a page that shows the run");
  run.add_option("--port")
      ->description("of that page; oaslam run --viewer --help-all lists its other options")
      ->type_name("INT")
      ->needs(viewer);
}

}  // namespace oaslam::apps
