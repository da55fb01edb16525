#include "apps/live/request.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <numeric>
#include <optional>
#include <utility>

namespace flexor::live {
namespace {

// Once: what is encoded twice stays a name with a percent sign.
std::optional<std::string> decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      if (static_cast<unsigned char>(text[i]) >= 0x80) return std::nullopt;
      out += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const char* const end = text.data() + i + 3;
    unsigned char byte = 0;
    if (std::from_chars(end - 2, end, byte, 16).ptr != end || byte == '/') return std::nullopt;
    out += static_cast<char>(byte);
    i += 2;
  }
  return out;
}

// Of names: none that begins with a dot, as what is hidden and what is not yet whole does.
bool is_plain_path(const std::string& path) {
  const std::string parts = "/" + path + "/";
  const bool has_names = parts.find("//") == parts.npos && parts.find("/.") == parts.npos;
  return has_names && path.size() <= kLongestName && std::ranges::none_of(path, [](unsigned char byte) {
           return byte < 0x20 || byte == 0x7f || byte == '\\';
         });
}

bool same_in_constant_time(std::string_view one, std::string_view other) {
  return one.size() == other.size() &&
         std::inner_product(one.begin(), one.end(), other.begin(), 0, std::bit_or(), std::bit_xor()) == 0;
}

}  // namespace

Target read_target(std::string_view target, std::string_view token) {
  using enum Target::Kind;
  if (target.empty() || target.front() != '/') return {foreign, {}};
  const std::string_view path = target.substr(1, target.find('?') - 1);
  const auto slash = path.find('/');
  if (token.empty() || !same_in_constant_time(path.substr(0, slash), token)) return {foreign, {}};
  if (slash == path.npos) return {bare, {}};

  const std::string_view rest = path.substr(slash + 1);
  if (rest.empty()) return {asset, "index.html"};
  if (rest == "socket") return {socket, {}};
  auto name = decoded(rest);
  if (!name || !is_plain_path(*name)) return {nothing, {}};
  constexpr std::string_view kFiles = "files/";
  if (name->starts_with(kFiles)) return {file, name->substr(kFiles.size())};
  return {asset, std::move(*name)};
}

bool is_origin_of(std::string_view origin, std::string_view host) {
  constexpr std::string_view kScheme = "http://";
  return origin.starts_with(kScheme) && origin.substr(kScheme.size()) == host;
}

std::string_view type_of_asset(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 13> kTypes{{
      {".csv", "text/csv; charset=utf-8"},
      {".json", "application/json"},
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".mp4", "video/mp4"},
      {".glb", "model/gltf-binary"},
      {".wasm", "application/wasm"},
      {".woff2", "font/woff2"},
      {".txt", "text/plain; charset=utf-8"},
  }};
  for (const auto& [ending, type] : kTypes)
    if (name.ends_with(ending)) return type;
  return "application/octet-stream";
}

std::string_view type_of_file(std::string_view name) {
  const std::string_view type = type_of_asset(name);
  const bool runs = type.starts_with("text/javascript") || type.starts_with("text/css");
  return runs ? "text/plain; charset=utf-8" : name.ends_with(".wasm") ? "application/octet-stream" : type;
}

}  // namespace flexor::live
