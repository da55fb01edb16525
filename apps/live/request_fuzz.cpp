// What a request asks for: whatever the bytes, a name that is given stays below its folder.
#include <cstdint>
#include <cstdlib>

#include "apps/live/request.hpp"

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexor::live;
  using Kind = Target::Kind;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  type_of_file(text);
  require(is_origin_of(text, "127.0.0.1:80") == (text == "http://127.0.0.1:80"));

  const Target target = read_target(text, "token");
  require(target.kind == Kind::foreign || text.starts_with("/token"));
  if (target.kind != Kind::file && target.kind != Kind::asset) {
    require(target.name.empty());
    return 0;
  }
  const std::string path = "/" + target.name + "/";
  require(path.size() <= kLongestName + 2);
  for (const char* out : {"//", "/.", "\\"}) require(path.find(out) == path.npos);
  require(path.find('\0') == path.npos);
  return 0;
}
