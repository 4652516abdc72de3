#include <thread>

#include "matchers.h"
#include "oaslam/net/gzipped.h"
#include "oaslam/viewer/page.h"
#include "oaslam/viewer/viewer.h"
#include "page_client.h"
#include "random_map.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

std::string Get(const std::string& target, const std::string& headers) {
  return "GET " + target + " HTTP/1.1\r\nConnection: close\r\n" + headers + "\r\n";
}

std::shared_ptr<const Map> SomeMap(int landmarks = 200) {
  Rng rng(5);
  return std::make_shared<const Map>(
      RandomMap({.keyframes = 8, .keypoints = landmarks, .landmarks = landmarks}, rng).map);
}

TEST(Viewer, ServesThePageToThisMachineAlone) {
  const Viewer viewer(ViewerOptions{});
  EXPECT_THAT(AnswerTo(viewer.url(), Get("/", "Host: localhost\r\n")),
              HasSubstr(Gunzip(ViewerPage())));
  EXPECT_THAT(AnswerTo(viewer.url(), Get("/", "Host: localhost\r\nAccept-Encoding: gzip, br\r\n")),
              HasSubstrs("Content-Encoding: gzip\r\n", "Vary: Accept-Encoding\r\n",
                         std::string(ViewerPage())));
  EXPECT_THAT(AnswerTo(viewer.url(), Get("/?x", "Host: 127.0.0.1:80\r\n")), HasSubstr("200 OK"));
  EXPECT_THAT(AnswerTo(viewer.url(), Get("/", "Host: evil.example\r\n")),
              HasSubstr("403 Forbidden"));
  EXPECT_THAT(AnswerTo(viewer.url(), Get("/", "")), HasSubstr("403 Forbidden"));
  EXPECT_THAT(
      AnswerTo(viewer.url(), Get("/", "Host: localhost\r\nOrigin: http://evil.example\r\n")),
      HasSubstr("403 Forbidden"));
  EXPECT_THAT(AnswerTo(viewer.url(), Get("/../etc/passwd", "Host: localhost\r\n")),
              HasSubstr("404 Not Found"));
  EXPECT_THAT(
      AnswerTo(viewer.url(), "POST / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"),
      HasSubstr("405 Method Not Allowed"));
  EXPECT_THAT(
      AnswerTo(viewer.url(), "GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\n\r\nx"),
      HasSubstr("413 Payload Too Large"));
}

TEST(Viewer, TellsAPageTheMapAndAnswersItsQuestions) {
  Viewer viewer(ViewerOptions{.names = {{41, "cup"}}});
  const auto map = SomeMap();
  viewer.ShowMap(map, {});
  PageClient page(viewer.url());
  EXPECT_EQ(page.ReadUntil("hello").header["commands"], false);
  const DecodedMessage update = page.ReadUntil("update");
  EXPECT_EQ(update.Array<uint32_t>("landmark_ids").size(), map->landmarks.size());
  EXPECT_EQ(update.Array<uint32_t>("keyframe_ids").size(), map->keyframes.size());
  const ObjectId id = map->objects.Ids().front();
  page.Send(R"({"type":"object","id":)" + std::to_string(id.value) + "}");
  EXPECT_EQ(page.ReadUntil("object").header["object"]["id"], id.value);
  page.Send(R"({"type":"keyframe","id":0})");
  EXPECT_EQ(page.ReadUntil("keyframe").header["keyframe"], 0);
}

TEST(Viewer, WhoAsksMuchIsStillToldWhatIsNew) {
  Viewer viewer(ViewerOptions{});
  const auto map = SomeMap();
  viewer.ShowMap(map, {});
  PageClient page(viewer.url());
  page.ReadUntil("update");
  const std::string question =
      R"({"type":"object","id":)" + std::to_string(map->objects.Ids().front().value) + "}";
  for (int i = 0; i < 10; ++i) page.Send(question);
  viewer.ShowEvent(0, "loop", "closed");
  for (int answers = 0;; ++answers) {
    ASSERT_LT(answers, 100);
    const DecodedMessage message = page.Read();
    page.Send(question);
    page.Acknowledge();
    if (message.header.contains("events")) break;
  }
}

TEST(Viewer, ClosesOnWhatNoPageSends) {
  const Viewer viewer(ViewerOptions{});
  for (const std::string bad :
       {"", "{", "[]", "null", R"({"type":1})", R"({"type":"nonsense"})", R"({"type":"object"})",
        R"({"type":"object","id":-1})", R"({"type":"object","id":1e30})",
        R"({"type":"command","name":"format disk"})",
        R"({"type":"command","name":"pause","on":"yes"})", R"({"type":"place"})",
        R"({"type":"place","model":"flag","origin":[0,0],"direction":[0,0,1]})",
        R"({"type":"place","model":"","origin":[0,0,0],"direction":[0,0,1]})",
        R"({"type":"place","model":"flag","origin":[0,0,0],"direction":[0,0,"1"]})",
        R"({"type":"place","model":"flag","origin":[0,0,0],"direction":[0,0,1],"object":-3})",
        R"({"type":"anchor","size":1})", R"({"type":"anchor","name":"a","size":"1"})",
        R"({"type":"anchor","name":"a","remove":1})"}) {
    PageClient page(viewer.url());
    page.Send(bad);
    EXPECT_TRUE(page.IsClosed()) << bad;
  }
  PageClient nested(viewer.url());
  nested.Send(std::string(4000, '['));
  EXPECT_TRUE(nested.IsClosed());
  PageClient binary(viewer.url());
  binary.Send(R"({"type":"ack"})", false);
  EXPECT_TRUE(binary.IsClosed());
  PageClient oversized(viewer.url());
  oversized.Send(std::string(100000, ' '));
  EXPECT_TRUE(oversized.IsClosed());
  PageClient eager(viewer.url());
  for (int i = 0; i < 3; ++i) eager.Acknowledge();
  EXPECT_TRUE(eager.IsClosed());
}

TEST(Viewer, CommandsReachTheRunOnlyWhereItTakesThem) {
  Viewer open(ViewerOptions{.accepts_commands = true}), closed(ViewerOptions{});
  PageClient page(open.url()), reader(closed.url());
  EXPECT_EQ(page.ReadUntil("hello").header["commands"], true);
  for (PageClient* client : {&page, &reader})
    client->Send(R"({"type":"command","name":"pause","on":true})");
  std::vector<ViewerCommand> commands = open.TakeCommands(2000);
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].kind, ViewerCommand::Kind::kPause);
  EXPECT_TRUE(commands[0].on);
  reader.Send(R"({"type":"object","id":99999})");  // processed after the command
  reader.Acknowledge();
  EXPECT_TRUE(closed.TakeCommands(50).empty());
}

TEST(Viewer, ThatMoreIsAskedForThanCanWaitIsSaid) {
  Viewer viewer(ViewerOptions{.accepts_commands = true});
  viewer.ShowMap(SomeMap(), {});
  PageClient page(viewer.url());
  const auto told = [&](const std::string& kind) {
    std::vector<std::string> kinds;
    while (kinds.empty() || kinds.back() != kind) {
      const DecodedMessage message = page.Read();
      page.Acknowledge();
      if (message.header["type"] == kind) return kinds;
      for (const auto& event : message.header.value("events", nlohmann::json()))
        kinds.push_back(event["kind"].get<std::string>());
    }
    return kinds;
  };
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 70; ++i) page.Send(R"({"type":"command","name":"step"})");
    page.Send(R"({"type":"keyframe","id":0})");
    std::vector<std::string> kinds = told("keyframe");  // all commands have come
    viewer.ShowEvent(0, "end", "");
    for (const std::string& kind : told("end")) kinds.push_back(kind);
    EXPECT_THAT(kinds, ElementsAre("refused", "end"));
    EXPECT_EQ(viewer.TakeCommands().size(), 64U);
  }
  page.Send(R"({"type":"command","name":"step"})");
  EXPECT_EQ(viewer.TakeCommands(2000).size(), 1U);
}

TEST(Viewer, AnchorsArePlacedByPagesThatMay) {
  Viewer editor(ViewerOptions{.accepts_anchors = true}),
      closed(ViewerOptions{.accepts_commands = true});
  PageClient page(editor.url()), reader(closed.url());
  EXPECT_EQ(page.ReadUntil("hello").header["anchors"], true);
  EXPECT_EQ(reader.ReadUntil("hello").header["anchors"], false);
  for (PageClient* client : {&page, &reader}) {
    client->Send(
        R"({"type":"place","model":"flag","origin":[0,1,2],"direction":[0,0,1.5],"object":7})");
    client->Send(R"({"type":"anchor","name":"flag 1","rename":"gate","size":0.5,"turn":-0.25})");
    client->Send(R"({"type":"anchor","name":"gate","remove":true})");
  }
  std::vector<ViewerCommand> commands;
  while (commands.size() < 3) {
    const std::vector<ViewerCommand> more = editor.TakeCommands(2000);
    ASSERT_FALSE(more.empty());
    commands.insert(commands.end(), more.begin(), more.end());
  }
  using Kind = ViewerCommand::Kind;
  EXPECT_EQ(commands[0].kind, Kind::kPlaceAnchor);
  EXPECT_EQ(commands[0].place.model, "flag");
  EXPECT_EQ(commands[0].place.origin, Eigen::Vector3d(0, 1, 2));
  EXPECT_EQ(commands[0].place.direction, Eigen::Vector3d(0, 0, 1.5));
  EXPECT_EQ(commands[0].place.object, ObjectId(7));
  EXPECT_EQ(commands[1].kind, Kind::kEditAnchor);
  EXPECT_EQ(commands[1].anchor, "flag 1");
  EXPECT_EQ(commands[1].edit.name, "gate");
  EXPECT_EQ(commands[1].edit.size, 0.5);
  EXPECT_EQ(commands[1].edit.turn_rad, -0.25);
  EXPECT_EQ(commands[2].kind, Kind::kRemoveAnchor);
  reader.Send(R"({"type":"command","name":"step"})");  // processed after the others
  commands = closed.TakeCommands(2000);
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].kind, Kind::kStep);
}

TEST(Viewer, ServesModelsAndNothingElse) {
  const Viewer viewer(ViewerOptions{.models = std::make_shared<const ModelLibrary>()});
  PageClient page(viewer.url());
  const nlohmann::json models = page.ReadUntil("hello").header["models"];
  ASSERT_FALSE(models.empty());
  for (const auto& model : models) {
    const std::string answer =
        AnswerTo(viewer.url(), Get(model["url"].get<std::string>(), "Host: localhost\r\n"));
    EXPECT_THAT(answer, HasSubstrs("200 OK", "model/gltf-binary", "glTF"));
  }
  for (const std::string path :
       {"/models/", "/models/none/none.glb", "/models/../CMakeLists.txt", "/models/flag/",
        "/models/flag/../../etc/passwd", "/models/%2e%2e/%2e%2e/etc/passwd"})
    EXPECT_THAT(AnswerTo(viewer.url(), Get(path, "Host: localhost\r\n")),
                HasSubstr("404 Not Found"))
        << path;
  const TempFolder folder;
  const Viewer own(ViewerOptions{.models = std::make_shared<const ModelLibrary>(
                                     std::vector{folder.Write("lamp.glb", "a lamp")})});
  EXPECT_THAT(AnswerTo(own.url(), Get("/models/lamp/lamp.glb", "Host: localhost\r\n")),
              HasSubstrs("200 OK", "a lamp"));
}

// A viewer that stops reading holds up a message or two but no other viewer, and gets the newest
// state when it goes on.
TEST(Viewer, AViewerThatStopsReadingDelaysNobody) {
  Viewer viewer(ViewerOptions{});
  const auto map = SomeMap(3000);
  PageClient stalled(viewer.url()), page(viewer.url());
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 300; ++i) {
    FrameRecord record;
    record.result.frame = i;
    record.result.timestamp = i / 30.0;
    record.result.state = TrackingState::kTracking;
    record.view.map = i % 2 == 0 ? map : std::make_shared<const Map>(*map);
    record.view.frame.camera = std::make_shared<const Camera>(map->cameras.front());
    record.view.frame.features = std::make_shared<Features>();
    record.image = cv::Mat(480, 640, CV_8UC3, cv::Scalar(i % 255, 0, 0));
    viewer.Show(std::move(record));
    if (i % 30 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  const auto last_frame = [](PageClient& client) {
    std::vector<uint32_t> notes;
    while (notes.size() < 300) {
      const auto more = client.ReadUntil("update").Array<uint32_t>("note_frames");
      notes.insert(notes.end(), more.begin(), more.end());
    }
    return notes.back();
  };
  EXPECT_EQ(last_frame(page), 299U);
  int messages = 0;  // that were being sent to the other viewer
  stalled.ReadUntil("hello");
  for (size_t notes = 0; notes < 300; ++messages)
    notes += stalled.ReadUntil("update").Array<uint32_t>("note_frames").size();
  EXPECT_LE(messages, 4);
}

TEST(Viewer, EndsWhateverIsOpen) {
  auto viewer = std::make_unique<Viewer>(ViewerOptions{});
  RawClient half(PortOf(viewer->url()));
  half.Send("GET / HT");
  PageClient silent(viewer->url()), page(viewer->url());
  viewer->ShowMap(SomeMap(), {});
  page.ReadUntil("update");
  const auto start = std::chrono::steady_clock::now();
  viewer->Shutdown();
  viewer->Shutdown();
  viewer->ShowMap(SomeMap(), {});
  viewer->ShowPicture(0, cv::Mat(10, 10, CV_8UC1));
  viewer.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  EXPECT_TRUE(page.IsClosed());
}

}  // namespace
}  // namespace oaslam
