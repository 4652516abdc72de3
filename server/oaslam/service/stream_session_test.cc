#include "oaslam/service/stream_session.h"

#include <boost/asio/io_context.hpp>
#include <cstring>
#include <latch>
#include <semaphore>
#include <stdexcept>

#include "matchers.h"
#include "oaslam/error.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

// What was sent is written when the test says so.
class FakeConnection : public WebSocketConnection {
 public:
  void Send(std::string message, bool is_text) override {
    EXPECT_FALSE(is_writing);
    EXPECT_TRUE(is_text);
    is_writing = true;
    sent.push_back(nlohmann::json::parse(message));
  }
  bool IsWriting() const override { return is_writing; }
  void Close(uint16_t status) override { closed = status; }

  std::vector<nlohmann::json> sent;
  bool is_writing = false;
  std::optional<uint16_t> closed;
};

// Notes what it is given to do, and answers with it. Each step waits for one of `steps`.
struct FakeWork : StreamWork {
  StreamStep Begin() override { return Step("begin"); }
  StreamStep Look() override { return Step("look"); }
  StreamStep Command(const nlohmann::json& message) override {
    return Step(message["type"].get<std::string>());
  }
  StreamStep Image(const ImageRequest& image, const nlohmann::json& header, int dropped) override {
    EXPECT_EQ(image.bytes, "image " + std::to_string(header["id"].get<int>()));
    return Step("image " + std::to_string(header["id"].get<int>()) + ", dropped " +
                std::to_string(dropped));
  }
  StreamStep Step(const std::string& what) {
    EXPECT_FALSE(is_busy.exchange(true));  // one at a time
    begun.release();
    steps.acquire();
    is_busy = false;
    if (what == "bad") throw InputError("that cannot be");
    if (what == "away") throw StoreUnavailable("the store is away");
    if (what == "broken") throw std::logic_error("secret");
    return {{{{"did", what}}}, what == "last"};
  }
  std::counting_semaphore<> steps{0}, begun{0};
  std::atomic<bool> is_busy = false;
};

class StreamSessionTest : public testing::Test {
 protected:
  explicit StreamSessionTest(std::ptrdiff_t free_steps = 1000)
      : state_(std::make_shared<ServiceState>(Options(), io_.get_executor())),
        work_(new FakeWork),
        session_(
            std::make_shared<StreamSession>(state_, "desk", std::unique_ptr<StreamWork>(work_))) {
    work_->steps.release(free_steps);
  }
  ~StreamSessionTest() override {
    if (session_) session_->OnClosed();
    state_->workers.Finish();
    io_.restart();
    io_.poll();
  }
  ServiceOptions Options() {
    ServiceOptions options;
    options.store = OpenMapStore(folder_.path());
    return options;
  }

  void Open() { session_->OnOpen(connection_); }
  void SendImage(int id) {
    std::string header = R"({"type":"image","time":1,"id":)" + std::to_string(id) + "}";
    const auto length = static_cast<uint32_t>(header.size());
    std::string message(sizeof(length), '\0');
    std::memcpy(message.data(), &length, sizeof(length));
    session_->OnMessage(message + header + "image " + std::to_string(id), false);
  }
  void SendCommand(const std::string& type) {
    session_->OnMessage(nlohmann::json{{"type", type}}.dump(), true);
  }
  // Works as the server's thread does, until something is sent or the connection is closed.
  void WaitForOutput() {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!connection_->is_writing && !connection_->closed) {
      ASSERT_LT(std::chrono::steady_clock::now(), limit) << "nothing was sent";
      io_.restart();
      io_.run_one_for(std::chrono::milliseconds(100));
    }
  }
  void Written() {
    connection_->is_writing = false;
    session_->OnWritten();
  }
  // What was done for the next message.
  std::string Next() {
    WaitForOutput();
    if (connection_->closed) return "closed " + std::to_string(*connection_->closed);
    const nlohmann::json message = connection_->sent.back();
    Written();
    if (message.contains("type"))
      return message["type"].get<std::string>() + ": " + message["message"].get<std::string>();
    return message["did"];
  }

  const TempFolder folder_;
  boost::asio::io_context io_{1};
  const std::shared_ptr<ServiceState> state_;
  FakeWork* const work_;
  std::shared_ptr<StreamSession> session_;
  const std::shared_ptr<FakeConnection> connection_ = std::make_shared<FakeConnection>();
};

class StepByStep : public StreamSessionTest {
 protected:
  StepByStep() : StreamSessionTest(0) {}
};

TEST_F(StepByStep, OnlyTheNewestImageWaits) {
  Open();
  work_->begun.acquire();
  for (int id = 0; id < 3; ++id) SendImage(id);
  work_->steps.release();
  EXPECT_EQ(Next(), "begin");
  work_->begun.acquire();  // image 2 is worked at
  for (int id = 3; id < 8; ++id) SendImage(id);
  work_->steps.release();
  EXPECT_EQ(Next(), "image 2, dropped 2");
  work_->steps.release();
  EXPECT_EQ(Next(), "image 7, dropped 6");
  SendImage(8);
  work_->steps.release();
  EXPECT_EQ(Next(), "image 8, dropped 6");
}

// A client that does not take its answers is not worked for.
TEST_F(StreamSessionTest, NothingIsBegunBeforeTheAnswerIsWritten) {
  Open();
  WaitForOutput();
  for (int id = 0; id < 3; ++id) SendImage(id);
  session_->OnMapChanged();
  SendCommand("a");
  state_->workers.Finish();  // so that nothing is under way
  EXPECT_EQ(work_->begun.try_acquire(), true);
  EXPECT_EQ(work_->begun.try_acquire(), false);
  EXPECT_EQ(connection_->sent.size(), 1u);
}

TEST_F(StepByStep, CommandsComeBeforeImagesAndInTheirOrder) {
  Open();
  work_->begun.acquire();
  SendImage(0);
  SendCommand("a");
  for (int i = 0; i < 3; ++i) session_->OnMapChanged();
  SendCommand("b");
  work_->steps.release(1000);
  EXPECT_EQ(Next(), "begin");
  EXPECT_EQ(Next(), "look");
  EXPECT_EQ(Next(), "a");
  EXPECT_EQ(Next(), "b");
  EXPECT_EQ(Next(), "image 0, dropped 0");
}

TEST_F(StepByStep, WhoSendsTooManyCommandsIsClosed) {
  Open();
  work_->begun.acquire();
  for (int i = 0; i < 16; ++i) SendCommand("a");
  EXPECT_FALSE(connection_->closed);
  SendCommand("a");
  EXPECT_EQ(connection_->closed, 1008);
  work_->steps.release(1000);
}

TEST_F(StreamSessionTest, WhatIsWrongIsToldAndTheStreamGoesOn) {
  Open();
  EXPECT_EQ(Next(), "begin");
  for (const std::string& bytes :
       {std::string(), std::string("\1\0", 2), std::string(4, '\0'), std::string(4, '\xff'),
        std::string("\x02\0\0\0[]", 6), std::string("\x03\0\0\0{}", 6),
        std::string("\x02\0\0\0{}", 6), std::string("\x10\0\0\0{\"type\": \"other\"}", 20)}) {
    session_->OnMessage(bytes, false);
    EXPECT_THAT(Next(), HasSubstr("error: ")) << bytes;
  }
  for (const char* text : {"", "[1", "{}", R"({"type": 1})", "[]"}) {
    session_->OnMessage(text, true);
    EXPECT_THAT(Next(), HasSubstr("error: message")) << text;
  }
  SendCommand("bad");
  EXPECT_EQ(Next(), "error: that cannot be");
  SendCommand("away");
  EXPECT_EQ(Next(), "error: the store is away");
  SendImage(1);
  EXPECT_EQ(Next(), "image 1, dropped 0");
  SendCommand("broken");
  EXPECT_EQ(Next(), "error: internal error");
  EXPECT_EQ(Next(), "closed 1000");
}

TEST_F(StreamSessionTest, ItEndsWhereTheWorkSaysSo) {
  Open();
  EXPECT_EQ(Next(), "begin");
  SendCommand("last");
  SendCommand("never");
  EXPECT_EQ(Next(), "last");
  EXPECT_EQ(Next(), "closed 1000");
  EXPECT_THAT(connection_->sent, SizeIs(2));
}

TEST_F(StreamSessionTest, OneThatFindsNoWorkerGetsItsTurnLater) {
  std::latch all_wait(1);
  std::latch is_busy(1);
  ASSERT_TRUE(state_->workers.TryAdd([&] {
    is_busy.count_down();
    all_wait.wait();
  }));
  is_busy.wait();
  while (state_->workers.TryAdd([] {})) {
  }
  Open();
  SendImage(0);
  io_.run_for(std::chrono::milliseconds(50));
  EXPECT_THAT(connection_->sent, IsEmpty());
  all_wait.count_down();
  EXPECT_EQ(Next(), "begin");
  EXPECT_EQ(Next(), "image 0, dropped 0");
}

TEST_F(StepByStep, OneThatIsClosedWhileItWorksIsForgotten) {
  Open();
  EXPECT_THAT(state_->followers, ElementsAre(Pair("desk", ElementsAre(session_.get()))));
  work_->begun.acquire();
  SendImage(0);
  session_->OnClosed();
  EXPECT_THAT(state_->followers, IsEmpty());
  std::weak_ptr<StreamSession> session = session_;
  session_ = nullptr;
  EXPECT_FALSE(session.expired());  // used by its step
  work_->steps.release(1000);
  state_->workers.Finish();
  io_.restart();
  io_.poll();
  EXPECT_TRUE(session.expired());
  EXPECT_THAT(connection_->sent, IsEmpty());
}

}  // namespace
}  // namespace oaslam
