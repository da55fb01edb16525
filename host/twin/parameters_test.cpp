#include "host/twin/parameters.hpp"

#include <gtest/gtest.h>

#include <set>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"

namespace flexor::twin {
namespace {

std::string refusal(const std::string& parameters) {
  return io::refusal_of([&] {
    (void)from_json(R"({"schema":"flexor-twin","schema_version":1,"parameters":)" + parameters + "}",
                    "t.json");
  });
}

TEST(Parameters, EveryEntryHasAnotherNameAUnitASourceAndALegalDefault) {
  std::set<std::string> names;
  for (const model::Number& e : numbers(Parameters())) {
    EXPECT_TRUE(names.insert(e.name).second) << e.name;
    EXPECT_STRNE(e.unit, "") << e.name;
    EXPECT_STRNE(e.source, "") << e.name;
    EXPECT_LT(e.min, e.max) << e.name;
  }
  EXPECT_NO_THROW(check(Parameters()));
}

TEST(Parameters, AFileThatIsCalledLikeAParameterIsNamedAllTheSame) {
  const std::string text =
      R"({"schema":"flexor-twin","schema_version":1,"parameters":{"radio.loss":{"value":2}}})";
  EXPECT_EQ(io::refusal_of([&] { (void)from_json(text, "radio"); }).find("radio: radio.loss: 2"), 0U);
}

TEST(Parameters, AFingerWithTwoNamesHasOneValue) {
  EXPECT_EQ(refusal(R"({"placement.bend_lower_deg":{"value":{"pinky":30,"little":31}}})"),
            "t.json: placement.bend_lower_deg: \"value\" gives pinky twice; remove one");
}

TEST(Parameters, ComeBackFromJsonToTheBit) {
  Parameters p;
  p.loss = 0.1234567890123;
  p.bend_lower_deg[3] = 17.3;
  p.faults.push_back({2, FaultKind::stuck, 1.5, 2});
  const std::string text = to_json(p);
  EXPECT_EQ(to_json(from_json(text, "t.json")), text);
}

TEST(Parameters, TheHardwareIsIncludedByNameOrAsADocument) {
  const auto with = [](const std::string& members) {
    return from_json(R"({"schema":"flexor-twin","schema_version":2,)" + members + "}", "t.json");
  };
  EXPECT_EQ(with(R"("hardware":"lucidgloves")").pins.strip[0], 4);
  const std::string own = R"("hardware":{"schema":"flexor-hardware","schema_version":1,
      "parameters":{"divider.fixed_kohm":{"value":47}}})";
  EXPECT_EQ(with(own).divider_kohm, 47);
  EXPECT_EQ(with(own + R"(,"parameters":{"divider.fixed_kohm":{"value":10}})").divider_kohm, 10);
  EXPECT_EQ(io::refusal_of([&] { with(R"("hardware":{"schema":"flexor-twin"})"); }),
            R"(t.json: hardware: "schema" must be "flexor-hardware")");
}

TEST(Parameters, RefusesTheImpossibleByName) {
  for (const auto& [parameters, reason] : std::vector<std::pair<std::string, std::string>>{
           {R"("radio.frame_rate_hz":{"value":500})", "do not fit 9600 baud"},
           {R"("radio.los":{"value":0})", "radio.loss"},
           {R"("radio.loss":{"value":"much"})", "must be a number"},
           {R"("placement.bend_lower_deg":{"value":{"ring":170}})", "placement.bend_lower_deg of ring, 170"},
           {R"("motor.resistance_ohm":{"value":0.01})", "faster than the plant's step"}})
    EXPECT_NE(refusal("{" + parameters + "}").find(reason), std::string::npos) << parameters;
  EXPECT_EQ(refusal("{}"), "accepted");
}

TEST(Parameters, RefusesAbsurdDocumentsInOneLine) {
  for (const char* rest :
       {R"([])", R"({"radio.loss":0.1})", R"({"radio.loss":{"value":1e308}})",
        R"({"hand.lower_deg":{"value":{"toe":1}}})", R"({},"faults":{"a":{}})", R"({},"faults":[7])",
        R"({},"faults":[{"finger":"index","kind":"gone","start_s":1,"duration_s":1}])",
        R"({},"faults":[{"finger":"index","kind":"open","start_s":-1,"duration_s":1}])"}) {
    EXPECT_TRUE(refusal(rest).starts_with("t.json: ")) << refusal(rest);
    io::expect_line(refusal(rest), "");
  }
}

TEST(Parameters, AssignmentsReachOneFingerOrAll) {
  Parameters p;
  assign(p, "placement.bend_lower_deg.pointer=41");
  EXPECT_EQ(p.bend_lower_deg[1], 41);
  assign(p, "placement.bend_lower_deg=12");
  EXPECT_EQ(p.bend_lower_deg[4], 12);
  EXPECT_THROW(assign(p, "radio.loss"), io::InputError);
  EXPECT_THROW(assign(p, "radio.loss=half"), io::InputError);
  EXPECT_THROW(assign(p, "radio.loss.index=0.1"), io::InputError);
}

}  // namespace
}  // namespace flexor::twin
