#pragma once

// What the shared library shows of itself; replaced by the packages' helper.
#define OASLAM_API
