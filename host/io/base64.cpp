#include "host/io/base64.hpp"

#include <algorithm>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/binary_from_base64.hpp>
#include <boost/archive/iterators/transform_width.hpp>

namespace flexor::io {

namespace iterators = boost::archive::iterators;

std::string base64(std::string_view bytes) {
  using Letters = iterators::base64_from_binary<iterators::transform_width<const char*, 6, 8>>;
  std::string out(Letters(bytes.data()), Letters(bytes.data() + bytes.size()));
  return out.append((3 - bytes.size() % 3) % 3, '=');
}

// Boost takes padding for zeros wherever it stands: what is not written so again was no base64.
std::optional<std::string> from_base64(std::string_view text) {
  using Bytes = iterators::transform_width<iterators::binary_from_base64<const char*>, 8, 6>;
  if (text.size() % 4 != 0) return std::nullopt;
  try {
    std::string out(Bytes(text.data()), Bytes(text.data() + text.size()));
    const std::size_t padding = text.size() - (text.find_last_not_of('=') + 1);
    out.resize(out.size() - std::min(padding, out.size()));
    if (base64(out) == text) return out;
  } catch (const iterators::dataflow_exception&) {
  }
  return std::nullopt;
}

}  // namespace flexor::io
