#include "host/model/block.hpp"

#include <algorithm>

namespace flexor::model {
namespace {

// Calls `each` with a fresh one of every kind.
template <class Each>
void for_each_kind(const Each& each) {
  [&]<std::size_t... kAt>(std::index_sequence<kAt...>) {
    (each(std::variant_alternative_t<kAt, Kind>()), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Kind>>());
}

}  // namespace

const char* type_of(const Kind& kind) {
  return std::visit([]<class K>(const K&) { return kTypeOf<K>; }, kind);
}

std::size_t inputs_of(const Kind& kind) {
  const auto* sum = std::get_if<Sum>(&kind);
  return sum != nullptr ? sum->weights.size() : 1;
}

void read_object(io::JsonReader& reader, Block& out) {
  const Json& from = reader.member("from");
  const bool names = from.is_array() && !from.empty() &&
                     std::ranges::all_of(from, [](const Json& v) { return v.is_string(); });
  if (!from.is_string() && !names) reader.fail("\"from\" must be a signal's name, or a list of them");
  out.from = from.is_string() ? std::vector{from.get<std::string>()} : from.get<std::vector<std::string>>();
  out.to = reader.text("to");
  const std::string type = reader.text("type");
  std::vector<std::string> known;
  bool is_known = false;
  for_each_kind([&]<class K>(K kind) {
    known.emplace_back(kTypeOf<K>);
    if (type != kTypeOf<K>) return;
    is_known = true;
    read_object(reader, kind);
    out.kind = std::move(kind);
  });
  if (!is_known) reader.fail(fmt::format("unknown block \"{}\"; known: {}", type, fmt::join(known, ", ")));
}

void write_object(const Block& block, Json& json) {
  json = {{"type", type_of(block.kind)}};
  if (block.from.size() == 1) {
    json["from"] = block.from.front();
  } else {
    json["from"] = block.from;
  }
  json["to"] = block.to;
  std::visit([&](const auto& k) { write_object(k, json); }, block.kind);
}

Json schema_of(const Block&) {
  const Json name = {{"type", "string"}};
  const Json names = {{"type", "array"}, {"items", name}, {"minItems", 1}, {"maxItems", kMaxTerms}};
  Json kinds = Json::array();
  for_each_kind([&]<class K>(const K& fresh) {
    Json& one = kinds.emplace_back(object_schema(
        {{"type", {{"const", kTypeOf<K>}}}, {"from", {{"anyOf", {name, names}}}}, {"to", name}}));
    add_schema_of(fresh, one);
  });
  return {{"oneOf", std::move(kinds)}};
}

std::string text_of(const Kind& kind) {
  return std::visit(
      []<class K>(const K& k) {
        std::string out;
        const auto add = [&](const auto& m) {
          const auto& value = k.*m.at;
          out += fmt::format("{}{} ", out.empty() ? "" : ", ", m.key);
          if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::vector<double>>) {
            out += fmt::format("{::.4g}", value);
          } else {
            out += fmt::format("{:.4g}", static_cast<double>(value));
          }
        };
        std::apply([&](const auto&... m) { (..., add(m)); }, K::members());
        return out;
      },
      kind);
}

}  // namespace flexor::model
