#include "matchers.h"
#include "oaslam/net/gzipped.h"
#include "oaslam/service/documents.h"

namespace oaslam {
namespace {

TEST(CameraPage, IsOneWholeDocumentWithoutReferences) {
  const std::string page = Gunzip(CameraPage());
  EXPECT_THAT(page, StartsWith("<!doctype html>"));
  EXPECT_THAT(page, EndsWith("</html>\n"));
  EXPECT_THAT(page, HasSubstr("getUserMedia"));
  EXPECT_THAT(page, Not(HasSubstr("<script src")));
  EXPECT_THAT(page, Not(HasSubstr("<link rel=\"stylesheet")));
}

TEST(CameraPage, HasItsOdometryBesideIt) {
  EXPECT_THAT(Gunzip(OdometryModule()), StartsWith(std::string("\0asm", 4)));
}

}  // namespace
}  // namespace oaslam
