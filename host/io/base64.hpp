// Bytes as text of 64 letters, four for every three bytes (RFC 4648, section 4: with padding, no line breaks).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace flexor::io {

std::string base64(std::string_view bytes);
// None: a letter that is none of the 64, padding that is missing or in the middle, bits left over that are not zero.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace flexor::io
