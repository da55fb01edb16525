#include "apps/live/request.hpp"

#include <gtest/gtest.h>

namespace flexor::live {
namespace {

using Kind = Target::Kind;

Kind kind_of(std::string_view target) { return read_target(target, "token").kind; }

TEST(Target, IsOneOfFew) {
  EXPECT_EQ(kind_of("/token"), Kind::bare);
  EXPECT_EQ(kind_of("/token?x"), Kind::bare);
  EXPECT_EQ(read_target("/token/", "token").name, "index.html");
  EXPECT_EQ(read_target("/token/?files/x", "token").name, "index.html");
  EXPECT_EQ(read_target("/token/assets/main.js", "token").name, "assets/main.js");
  EXPECT_EQ(kind_of("/token/socket"), Kind::socket);
  EXPECT_EQ(kind_of("/token/socket?"), Kind::socket);
  EXPECT_EQ(kind_of("/token/files/a/b%20c"), Kind::file);
  EXPECT_EQ(read_target("/token/files/a/b%20c", "token").name, "a/b c");
  EXPECT_EQ(read_target("/token/files/%252e%252e/a", "token").name, "%2e%2e/a");
  for (const char* foreign :
       {"", "/", "token", "*", "/toke", "/tokens/", "/Token/", "//token/", "/?/token/", "?", "/%74oken/"})
    EXPECT_EQ(kind_of(foreign), Kind::foreign) << foreign;
  for (const char* nothing :
       {"/token//", "/token/..", "/token/files/", "/token/files/a/", "/token/%", "/token/a%00",
        "/token/a\x01", "/token/\xc3\xab", "/token/a%5Cb", "/token/.a", "/token/files/a%2Fb"})
    EXPECT_EQ(kind_of(nothing), Kind::nothing) << nothing;
  EXPECT_EQ(read_target("//", "").kind, Kind::foreign);
}

TEST(Target, AnOriginIsTheWholeOfSchemeAndHost) {
  EXPECT_TRUE(is_origin_of("http://127.0.0.1:80", "127.0.0.1:80"));
  for (const char* other : {"", "null", "http://127.0.0.1:8", "http://127.0.0.1:800", "https://127.0.0.1:80",
                            "http:/127.0.0.1:80/"})
    EXPECT_FALSE(is_origin_of(other, "127.0.0.1:80")) << other;
}

TEST(Target, NoFileOfASessionIsAScript) {
  EXPECT_EQ(type_of_file("a/log.csv"), "text/csv; charset=utf-8");
  EXPECT_EQ(type_of_file("page.html"), "text/html; charset=utf-8");
  for (const char* name : {"x.js", "x.mjs", "x.css", "x.wasm", "x", ""})
    EXPECT_TRUE(type_of_file(name).starts_with("text/plain") ||
                type_of_file(name) == "application/octet-stream")
        << name;
}

}  // namespace
}  // namespace flexor::live
