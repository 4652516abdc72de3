#include <memory>

#include "live_view.h"
#include "oaslam_program.h"
#include "view.h"

// The command `oaslam` with the viewer. It calls itself oaslam in its messages, as it is called.
int main(int argc, char** argv) {
  using namespace oaslam::apps;
  return RunOaslam(argc, argv, std::make_shared<LiveView>(), &AddViewCommand);
}
