#include <boost/asio/io_context.hpp>
#include <opencv2/imgcodecs.hpp>

#include "expect_input_error.h"
#include "oaslam/service/stream_session.h"
#include "random_map.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

std::string BlankImage(int width = 640) {
  std::vector<uchar> bytes;
  cv::imencode(".png", cv::Mat::zeros(480, width, CV_8UC1), bytes);
  return {bytes.begin(), bytes.end()};
}

class TrackWorkTest : public testing::Test {
 protected:
  TrackWorkTest() {
    Rng rng(3);
    saved_ = RandomMap({}, rng);
    SaveMap(folder_ / "first", saved_);
    ServiceOptions options;
    options.store = OpenMapStore(folder_.path());
    options.models = std::make_shared<const ModelLibrary>();
    options.store->Put("desk", folder_ / "first");
    state_ = std::make_shared<ServiceState>(std::move(options), io_.get_executor());
  }
  // Replaces the map by another one.
  void PutOther() {
    Rng rng(5);
    SaveMap(folder_ / "other", RandomMap({}, rng));
    state_->shelf.store().Put("desk", folder_ / "other");
  }
  Json BeginOn(const std::string& map, bool may_write = true) {
    work_ = TrackWork(state_, map, may_write);
    const StreamStep step = work_->Begin();
    EXPECT_THAT(step.messages, SizeIs(1));
    is_ended_ = step.ends;
    return step.messages.at(0);
  }
  Json Image(const std::string& bytes, int dropped = 0) {
    ImageRequest request;
    request.bytes = bytes;
    request.camera.camera = saved_.map.cameras.front();
    request.time = ++time_;
    return work_->Image(request, {{"id", 7}}, dropped).messages.at(0);
  }
  std::vector<Json> Command(const std::string& text) {
    return work_->Command(nlohmann::json::parse(text)).messages;
  }
  void EditFlag(const std::optional<Anchor>& anchor) {
    state_->shelf.store().EditAnchor("desk", "flag 1", anchor, false);
    state_->shelf.Refresh("desk");
  }

  const TempFolder folder_;
  boost::asio::io_context io_{1};
  SavedMap saved_;
  std::shared_ptr<ServiceState> state_;
  std::unique_ptr<StreamWork> work_;
  bool is_ended_ = false;
  double time_ = 0;
};

TEST_F(TrackWorkTest, BeginsWithAllOfTheMap) {
  const Json hello = BeginOn("desk", false);
  EXPECT_EQ(hello["type"], "hello");
  EXPECT_EQ(hello["map"], "desk");
  EXPECT_EQ(hello["digest"], state_->shelf.store().Find("desk")->digest);
  EXPECT_EQ(hello["may_write"], false);
  EXPECT_THAT(hello["models"], Not(IsEmpty()));
  EXPECT_EQ(hello["models"][0]["url"].get<std::string>().find("/models/"), 0u);
  EXPECT_EQ(hello["objects"].size(), JsonOfObjects(saved_).size());
  EXPECT_FALSE(is_ended_);
  EXPECT_THAT(BeginOn("nowhere")["message"], HasSubstr("there is no map \"nowhere\""));
  EXPECT_TRUE(is_ended_);
  EXPECT_THROW(BeginOn("../desk"), InputError);
}

TEST_F(TrackWorkTest, TellsWhatHasChanged) {
  BeginOn("desk");
  EXPECT_THAT(work_->Look().messages, SizeIs(0));
  EditFlag(Anchor{"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}});
  const Json anchors = work_->Look().messages.at(0);
  EXPECT_EQ(anchors["type"], "anchors");
  EXPECT_EQ(anchors["anchors"].at(0)["name"], "flag 1");
  EXPECT_THAT(work_->Look().messages, SizeIs(0));
  EditFlag(std::nullopt);
  EXPECT_EQ(work_->Look().messages.at(0)["removed"], Json({"flag 1"}));
  PutOther();
  state_->shelf.Refresh("desk");
  const Json replaced = work_->Look().messages.at(0);
  EXPECT_EQ(replaced["type"], "map");
  EXPECT_EQ(replaced["digest"], state_->shelf.store().Find("desk")->digest);
  state_->shelf.store().Remove("desk");
  state_->shelf.Refresh("desk");
  const StreamStep removed = work_->Look();
  EXPECT_EQ(removed.messages.at(0)["type"], "error");
  EXPECT_TRUE(removed.ends);
}

TEST_F(TrackWorkTest, KeyPointsAreAnsweredLikeAnImage) {
  BeginOn("desk");
  ImageRequest request;
  request.camera.camera = saved_.map.cameras.front();
  request.features = ImageFeatures();
  request.motion.emplace().is_known = false;
  request.time = 1;
  const Json pose = work_->Image(request, {{"id", 1}}, 0).messages.at(0);
  EXPECT_EQ(pose["state"], "lost");
  EXPECT_FALSE(pose.contains("unit"));
  request.feature_count = 3;
  EXPECT_INPUT_ERROR(work_->Image(request, {{"id", 2}}, 0), HasSubstr("of 3 key points"));
}

TEST_F(TrackWorkTest, AnImageIsAnsweredAlsoWhereItIsNotFound) {
  BeginOn("desk");
  const Json pose = Image(BlankImage(), 5);
  EXPECT_EQ(pose["type"], "pose");
  EXPECT_EQ(pose["id"], 7);
  EXPECT_EQ(pose["time"], 1);
  EXPECT_EQ(pose["state"], "lost");
  EXPECT_EQ(pose["dropped"], 5);
  EXPECT_EQ(pose["source"], "none");
  EXPECT_FALSE(pose.contains("pose"));
  EXPECT_THAT(state_->metrics.Text({}), HasSubstr("oaslam_tracked_total{state=\"lost\"} 1\n"));
  EXPECT_INPUT_ERROR(Image("no image"), HasSubstr("neither a JPEG nor a PNG"));
  EXPECT_INPUT_ERROR(Image(BlankImage(320)), HasSubstr("320 x 480"));
  EXPECT_EQ(Image(BlankImage())["state"], "lost");
  time_ = 0;
  EXPECT_INPUT_ERROR(Image(BlankImage()), HasSubstr("time"));
}

TEST_F(TrackWorkTest, OnlyWhoMayWriteEdits) {
  BeginOn("desk", false);
  EXPECT_INPUT_ERROR(Command(R"({"type": "anchor", "name": "a", "remove": true})"),
                     HasSubstr("for reading"));
  BeginOn("desk", true);
  EXPECT_INPUT_ERROR(Command(R"({"type": "format"})"), HasSubstr("allowed: place, anchor"));
  EXPECT_INPUT_ERROR(Command(R"({"type": "anchor"})"), HasSubstr("\"name\""));
  EXPECT_THAT(Command(R"({"type": "anchor", "name": "a", "remove": true})").at(0)["message"],
              HasSubstr("there is no anchor \"a\""));
  EditFlag(Anchor{"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}});
  work_->Look();
  const Json renamed =
      Command(R"({"type": "anchor", "name": "flag 1", "rename": "gate", "size": 2})").at(0);
  EXPECT_EQ(renamed["anchors"].at(0)["name"], "gate");
  EXPECT_EQ(renamed["anchors"].at(0)["size"], 2);
  EXPECT_EQ(renamed["removed"], Json({"flag 1"}));
}

TEST_F(TrackWorkTest, ARenameIsOneEdit) {
  BeginOn("desk");
  EditFlag(Anchor{"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}});
  const Json before = work_->Look().messages.at(0);
  const Json renamed =
      Command(R"({"type": "anchor", "name": "flag 1", "rename": "gate", "size": 2})").at(0);
  EXPECT_EQ(renamed["version"], before["version"].get<int>() + 1);
}

// An anchor is relative to the keyframes of a map, which are others in the one that replaces it.
TEST_F(TrackWorkTest, AnEditOfAMapThatWasReplacedMeanwhileIsRefused) {
  BeginOn("desk");
  EditFlag(Anchor{"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}});
  work_->Look();
  PutOther();
  const std::string turn = R"({"type": "anchor", "name": "flag 1", "turn": 1})";
  EXPECT_EQ(Command(turn).at(0)["message"], "the map \"desk\" was replaced meanwhile");
  EXPECT_EQ(state_->shelf.Edits("desk")->anchors.at("flag 1").version, 1);
  EXPECT_EQ(work_->Look().messages.at(0)["type"], "map");
  EXPECT_EQ(Command(turn).at(0)["type"], "anchors");
  state_->shelf.store().Remove("desk");
  EXPECT_EQ(Command(turn).at(0)["message"], "there is no map \"desk\"");
}

// Who asks for what has changed since a version is told everything where the map was removed or
// replaced after it, since what is gone is no longer known.
TEST_F(TrackWorkTest, SinceReachesOverAReplacementAndARemoval) {
  const auto since = [&](int64_t version) {
    state_->shelf.Refresh("desk");
    const Json json =
        JsonOfAnchors(*state_->shelf.Get("desk"), *state_->shelf.Edits("desk"), version);
    return std::pair(json["complete"].get<bool>(), json["anchors"].size());
  };
  BeginOn("desk");
  EditFlag(Anchor{"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}});
  const size_t all = since(0).second;
  EXPECT_EQ(since(0).first, true);
  EXPECT_EQ(since(1), std::pair(false, size_t{0}));
  PutOther();
  EXPECT_EQ(since(1).first, true);
  EXPECT_EQ(since(2), std::pair(false, size_t{0}));
  state_->shelf.store().Remove("desk");
  state_->shelf.store().Put("desk", folder_ / "first");
  EXPECT_EQ(since(2), std::pair(true, all - 1));
  EXPECT_EQ(since(3), std::pair(false, size_t{0}));
}

TEST_F(TrackWorkTest, AMapThatWasRemovedAndStoredAgainIsToldAnew) {
  BeginOn("desk");
  EditFlag(Anchor{"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}});
  work_->Look();
  state_->shelf.store().Remove("desk");
  state_->shelf.store().Put("desk", folder_ / "first");
  state_->shelf.Refresh("desk");
  EXPECT_EQ(work_->Look().messages.at(0)["type"], "map");
}

}  // namespace
}  // namespace oaslam
