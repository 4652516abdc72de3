#include "oaslam/net/json_input.h"

#include "expect_input_error.h"

namespace oaslam {
namespace {

using nlohmann::json;

// The problem that reading a value throws.
std::string ProblemOf(const json& value, const std::function<void(const JsonInput&)>& read) {
  const std::string problem = InputErrorOf([&] { read(JsonInput(value, "body")); });
  EXPECT_THAT(problem, AllOf(StartsWith("body"), Not(HasSubstr("\n"))));
  return problem;
}

TEST(ParseJson, TellsWhereTextIsNone) {
  EXPECT_EQ(ParseJson(R"( {"a": [1, null]} )", "body"), (json{{"a", {1, nullptr}}}));
  for (const char* text : {" ", "{", "[1,]", "{'a': 1}", "nul", "[1] 2", "\"\xff\"", "{\"a\" 1}"})
    EXPECT_INPUT_ERROR(ParseJson(text, "body"),
                       AllOf(StartsWith("body: is no JSON, as character "), Not(HasSubstr("\n"))))
        << text;
  EXPECT_INPUT_ERROR(ParseJson("[1, x]", "body"), HasSubstr("character 5 "));
  EXPECT_INPUT_ERROR(ParseJson("", "body"), testing::StrEq("body: is empty"));
  EXPECT_INPUT_ERROR(ParseJson("[1e999]", "body"), HasSubstr("out of range"));
  EXPECT_THROW(ParseJson(std::string(100'000, '['), "body"), InputError);
  // What is whole, but would exhaust the stack of who copies it.
  EXPECT_THAT(InputErrorOf(
                  [] { ParseJson(std::string(100'000, '[') + std::string(100'000, ']'), "body"); }),
              HasSubstr("body: is nested more than 32 deep"));
  EXPECT_NO_THROW(ParseJson(std::string(32, '[') + std::string(32, ']'), "body"));
}

TEST(JsonInput, MembersAreFoundWithTheirPlaces) {
  const json value{{"camera", {{"fx", 500}}}, {"none", nullptr}};
  const JsonInput input(value, "body");
  EXPECT_EQ(input["camera"]["fx"].Number(), 500);
  EXPECT_EQ(input["camera"]["fx"].place(), "body.camera.fx");
  EXPECT_FALSE(input.Find("none"));
  EXPECT_FALSE(input.Find("other"));
  EXPECT_NO_THROW(input.Only({"camera", "none", "other"}));
  EXPECT_EQ(ProblemOf(value, [](const auto& i) { i["none"]; }), "body: \"none\" is missing");
  EXPECT_EQ(ProblemOf(value, [](const auto& i) { i["camera"]["fx"]["x"]; }),
            "body.camera.fx: must be an object");
  EXPECT_EQ(ProblemOf(value,
                      [](const auto& i) {
                        i.Only({"camera", "time"});
                      }),
            "body: unknown key \"none\", known: camera, time");
  EXPECT_EQ(ProblemOf(json::array(), [](const auto& i) { i.Only({}); }), "body: must be an object");
}

TEST(JsonInput, ItemsAreCounted) {
  const json value{1, 2, "3"};
  EXPECT_EQ(JsonInput(value, "body").Items(3, 3)[1].Number(), 2);
  EXPECT_EQ(ProblemOf(value, [](const auto& i) { i.Items()[2].Number(); }),
            "body[2]: must be a number");
  EXPECT_EQ(ProblemOf(value, [](const auto& i) { i.Items(4); }),
            "body: has 3 items, at least 4 are needed");
  EXPECT_EQ(ProblemOf(value, [](const auto& i) { i.Items(0, 2); }),
            "body: has 3 items, at most 2 are allowed");
  EXPECT_EQ(ProblemOf("[]", [](const auto& i) { i.Items(); }), "body: must be an array");
}

TEST(JsonInput, NumbersHaveBounds) {
  const auto number = [](const auto& i) { i.Number(0, 1); };
  EXPECT_EQ(ProblemOf(1.5, number), "body: 1.5, allowed: 0 to 1");
  EXPECT_EQ(ProblemOf(-1, number), "body: -1, allowed: 0 to 1");
  for (const json& other : {json(nullptr), json("1"), json(true), json::array({1})})
    EXPECT_EQ(ProblemOf(other, number), "body: must be a number");
  const auto integer = [](const auto& i) { i.Integer(-3, 100); };
  EXPECT_EQ(JsonInput(json(100.0), "body").Integer(-3, 100), 100);
  EXPECT_EQ(JsonInput(json(-3), "body").Integer(-3, 100), -3);
  EXPECT_EQ(ProblemOf(1.5, integer), "body: must be an integer");
  EXPECT_THAT(ProblemOf(UINT64_MAX, integer), HasSubstr("allowed: -3 to 100"));
  EXPECT_THAT(ProblemOf(-4, integer), HasSubstr("allowed: -3 to 100"));
}

TEST(JsonInput, OtherTypes) {
  EXPECT_TRUE(JsonInput(json(true), "body").Boolean());
  EXPECT_EQ(ProblemOf(1, [](const auto& i) { i.Boolean(); }), "body: must be true or false");
  const json text = "text";
  EXPECT_EQ(JsonInput(text, "body").Text(), "text");
  EXPECT_EQ(ProblemOf(1, [](const auto& i) { i.Text(); }), "body: must be a string");
  const json vector{1, -2.5, 3};
  EXPECT_EQ(JsonInput(vector, "body").Vector(), Eigen::Vector3d(1, -2.5, 3));
  EXPECT_THAT(ProblemOf({1, 2}, [](const auto& i) { i.Vector(); }), HasSubstr("at least 3"));
  EXPECT_EQ(ProblemOf({1, 2, nullptr}, [](const auto& i) { i.Vector(); }),
            "body[2]: must be a number");
}

TEST(JsonInput, PosesHaveRotationsOfUnitLength) {
  const auto pose = [](const json& position, const json& rotation) {
    return json{{"position", position}, {"rotation", rotation}};
  };
  const auto read = [](const auto& i) { i.Pose(); };
  const json given = pose({1, 2, 3}, {0, 0, 0.6, 0.805});  // a little too long
  const Rigid3 found = JsonInput(given, "body").Pose();
  EXPECT_EQ(found.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(found.rotation.norm(), 1, 1e-12);
  EXPECT_NEAR(found.rotation.z() / found.rotation.w(), 0.6 / 0.805, 1e-12);
  for (const json& rotation :
       {json{0, 0, 0, 0}, json{0, 0, 0, 2}, json{0, 0, 0, 1e308}, json{1e308, 1e308, 1e308, 1e308}})
    EXPECT_THAT(ProblemOf(pose({0, 0, 0}, rotation), read), HasSubstr("quaternion of length"));
  EXPECT_THAT(ProblemOf(pose({0, 0, 0}, {0, 0, 1}), read), StartsWith("body.rotation: has 3"));
  EXPECT_THAT(ProblemOf({{"rotation", {0, 0, 0, 1}}}, read), HasSubstr("\"position\" is missing"));
  json more = given;
  more["scale"] = 1;
  EXPECT_THAT(ProblemOf(more, read), HasSubstr("unknown key \"scale\""));
}

}  // namespace
}  // namespace oaslam
