#include "host/export/lsl.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include "host/io/io.hpp"

namespace flexor::exports {
namespace {

void expect_refused(const LslOptions& options, const std::string& part) {
  try {
    const LslStream stream({"a"}, options);
    ADD_FAILURE() << "made, where " << part;
  } catch (const io::InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find(part), std::string::npos) << what;
    EXPECT_NE(what.find("pip install pylsl"), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
}

TEST(Lsl, SaysWhereTheLibraryComesFrom) {
  LslOptions options;
  options.library = "/no/liblsl.so";
  expect_refused(options, "/no/liblsl.so: cannot be loaded");
  options.library = "libm.so.6";  // another one
  expect_refused(options, "has no lsl_create_streaminfo");
  ::setenv("FLEXOR_LSL", "/none/liblsl.so", 1);
  expect_refused({}, "/none/liblsl.so: cannot be loaded");
  ::unsetenv("FLEXOR_LSL");
}

}  // namespace
}  // namespace flexor::exports
