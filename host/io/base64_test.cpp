#include "host/io/base64.hpp"

#include <gtest/gtest.h>

namespace flexor::io {
namespace {

// RFC 4648, section 10.
TEST(Base64, TheStandardsExamples) {
  std::size_t n = 0;
  for (const char* text : {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"}) {
    const std::string bytes = std::string("foobar").substr(0, n++);
    EXPECT_EQ(base64(bytes), text);
    EXPECT_EQ(from_base64(text), bytes);
  }
}

TEST(Base64, EveryByteComesBack) {
  std::string bytes;
  for (int i = 0; i < 256 * 3; ++i) bytes += static_cast<char>(i * 7 + i / 256);
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const std::string part = bytes.substr(0, n);
    EXPECT_EQ(from_base64(base64(part)), part);
  }
}

TEST(Base64, WhatIsNoBase64IsRefused) {
  for (const char* text : {"Z", "Zg", "Zg=", "Zg=v", "Z===", "====", "=", "Zm9\n", "Zm9 ", "Zm-_",
                           "Zh==", "Zm9=", "Zg==Zg==", "Z\xff=="})
    EXPECT_FALSE(from_base64(text)) << text;
}

}  // namespace
}  // namespace flexor::io
