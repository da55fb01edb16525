// What the lines of workers hold.
#include "host/io/json.hpp"
#include "host/io/worker.hpp"

namespace flexor::io {

Json bytes_to_json(std::string_view bytes) {
  if (to_utf8(bytes) == bytes) return std::string(bytes);
  auto out = Json::array();
  for (const char c : bytes) out.push_back(static_cast<unsigned char>(c));
  return out;
}

std::string bytes_from_json(const Json& json) {
  if (!json.is_array()) return json.get<std::string>();
  std::string out;
  for (const auto& byte : json) out += static_cast<char>(byte.get<unsigned char>());
  return out;
}

Json to_json(const Progress& p) {
  return {{"stage", to_utf8(p.stage)},
          {"done", p.done},
          {"of", p.of},
          {"fraction", p.of > 0 ? Json(static_cast<double>(p.done) / static_cast<double>(p.of)) : nullptr},
          {"seconds_left", p.seconds_left ? Json(*p.seconds_left) : nullptr}};
}

}  // namespace flexor::io
