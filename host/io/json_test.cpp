#include "host/io/json.hpp"

#include <gtest/gtest.h>

#include "host/io/refusal_test.hpp"

namespace flexor::io {
namespace {

std::string refusal(const std::string& text) {
  return io::refusal_of([&] { (void)parse_json(text, "x.json"); });
}

std::string nested(std::size_t levels, const std::string& open, const std::string& close) {
  std::string text;
  for (std::size_t i = 0; i < levels; ++i) text += open;
  text += "1";
  for (std::size_t i = 0; i < levels; ++i) text += close;
  return text;
}

TEST(Json, SixtyFourLevelsAreReadAndMoreAreRefused) {
  EXPECT_EQ(parse_json(nested(64, "[", "]"), "x").size(), 1u);
  EXPECT_EQ(refusal("\n\n" + nested(65, "[", "]")), "x.json: nested deeper than 64 levels");
  EXPECT_EQ(refusal(nested(80000, "[", "]")), "x.json: nested deeper than 64 levels");
  EXPECT_EQ(refusal(nested(80000, "{\"a\":", "}")), "x.json: nested deeper than 64 levels");
  EXPECT_EQ(refusal(std::string(5'000'000, '[')), "x.json: nested deeper than 64 levels");
  EXPECT_EQ(parse_json("[\"" + std::string(1000, '[') + "\\\"[\"]", "x").size(), 1u) << "brackets in a text";
  EXPECT_EQ(
      parse_json("[" + nested(1, "[", "]") + std::string(100, ' ') + "," + nested(63, "[", "]") + "]", "x")
          .size(),
      2u);
}

TEST(Json, ADocumentOfMoreThanSixteenMegabytesIsRefusedBeforeItIsParsed) {
  EXPECT_EQ(parse_json("[" + std::string((16 << 20) - 2, ' ') + "]", "x").size(), 0u);
  EXPECT_EQ(refusal(std::string((17 << 20), ' ')), "x.json: a document of 17 MB; at most 16 are read");
}

TEST(Json, AKeyThatComesTwiceIsNamed) {
  EXPECT_EQ(refusal(R"({"a": 1, "b": {"c": 1}, "a": 2})"),
            "x.json: key \"a\" comes twice in one object; remove one");
  EXPECT_EQ(refusal(R"({"b": {"c": 1, "c": 1}})"), "x.json: key \"c\" comes twice in one object; remove one");
  EXPECT_EQ(refusal(R"({"a": {"c": 1}, "b": [{"c": 1}, {"c": 1}]})"), "accepted");
  std::string many = "{";
  for (int k = 0; k <= 512; ++k) many += fmt::format("\"{}\":0,", k);
  EXPECT_EQ(refusal(many), "x.json: an object of more than 512 keys; is it the right file?");
}

TEST(Json, ALongKeyIsShownWithoutCuttingALetterInTwo) {
  std::string key;
  for (int i = 0; i < 60; ++i) key += "\u00e9";
  const std::string why = refusal("{\"" + key + "\": 1, \"" + key + "\": 2}");
  EXPECT_NE(why.find("comes twice"), std::string::npos) << why;
  EXPECT_EQ(to_utf8(why), why);
}

TEST(Json, AMessageStaysOneLineWhateverNamesADocumentHolds) {
  const auto json = parse_json(R"({"a\nb\u001b[2J\u0000c": 1})", "x.json");
  EXPECT_EQ(refusal_of<InputError>([&] { JsonReader(json, "x.json").done(); }),
            "x.json: unknown key \"a?b?[2J?c\"; known here: ");
}

TEST(Json, NumbersThatAreNoneAreNamed) {
  EXPECT_EQ(refusal("{\"a\": 1e999}"), "x.json: number overflow parsing '1e999'");
  EXPECT_LT(refusal("[1" + std::string(100000, '0') + "]").size(), 200u);
  for (const std::string word : {"NaN", "Infinity", "-Infinity", "nan", "None", "True"}) {
    const std::string name = word.substr(word.front() == '-' ? 1 : 0);
    EXPECT_EQ(refusal("{\n\"a\": " + word + "}"),
              "x.json: not valid JSON at line 2: " + name + " is no value; a number, or a text in quotes?");
  }
  EXPECT_EQ(parse_json("[1e5, -2.5E-3, true, false, null]", "x").size(), 5u);
  EXPECT_EQ(parse_json(std::string("\xFF\xFE[\0"
                                   "1\0]\0",
                                   8),
                       "x"),
            Json({1}))
      << "UTF-16";
}

TEST(Json, TextThatIsNotUtf8IsRefusedWithItsByte) {
  EXPECT_EQ(refusal("{\n\"gl\xf6ve\": 1}"), "x.json: is no UTF-8 text: byte 5, in line 2; save it as UTF-8");
  for (const std::string bytes :
       {"\x80", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82"}) {
    EXPECT_NE(refusal("[\"" + bytes + "\"]").find("byte 2,"), std::string::npos);
  }
  EXPECT_EQ(parse_json("[\"glöve ∠ 😀\"]", "x")[0], "glöve ∠ 😀");
}

TEST(Json, AFileThatIsCutOffIsCalledSo) {
  for (const std::string text : {"", "{", "{\"a", "{\"a\": tr", "[1,", "[\"\\"})
    EXPECT_NE(refusal(text).find("is the file cut off?"), std::string::npos) << text << ": " << refusal(text);
}

TEST(Json, BytesOfAFileNameBecomeText) {
  EXPECT_EQ(to_utf8("gl\xf6ve.csv"), "gl\uFFFDve.csv");
  EXPECT_EQ(to_utf8("glöve ∠ 😀"), "glöve ∠ 😀");
  EXPECT_EQ(to_utf8("\xe2\x82"), "\uFFFD\uFFFD");
  const Json json = {{"file", "gl\xf6ve.csv"}};
  EXPECT_EQ(dump(json), "{\n  \"file\": \"gl\uFFFDve.csv\"\n}\n");
  EXPECT_EQ(dump_line(json), "{\"file\":\"gl\uFFFDve.csv\"}");
  EXPECT_EQ(dump_line({{"a", "\u202e\u009b\x7f"}}), R"({"a":"\u202e\u009b\u007f"})")
      << "they control a terminal";
}

}  // namespace
}  // namespace flexor::io
