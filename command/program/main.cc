#include <memory>

#include "oaslam_program.h"
#include "run_view.h"

int main(int argc, char** argv) {
  return oaslam::apps::RunOaslam(argc, argv, std::make_shared<oaslam::apps::RunView>());
}
