#include "oaslam_program.h"

int main(int argc, char** argv) { return oaslam::apps::RunOaslam(argc, argv); }
