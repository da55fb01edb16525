#include "host/model/block.hpp"

#include <algorithm>

namespace flexor::model {
namespace {

template <std::size_t kAt = 0>
Kind read_as(const std::string& type, io::JsonReader& block, std::vector<std::string>& known) {
  if constexpr (kAt == std::variant_size_v<Kind>) {
    block.fail(fmt::format("unknown block \"{}\"; known: {}", type, fmt::join(known, ", ")));
  } else {
    using T = std::variant_alternative_t<kAt, Kind>;
    if (type == kTypeOf<T>) {
      T kind;
      read_object(block, kind);
      return kind;
    }
    known.emplace_back(kTypeOf<T>);
    return read_as<kAt + 1>(type, block, known);
  }
}

template <std::size_t kAt = 0>
void add_schemas(const Json& more, Json& out) {
  if constexpr (kAt < std::variant_size_v<Kind>) {
    using T = std::variant_alternative_t<kAt, Kind>;
    Json properties = {{"type", {{"const", kTypeOf<T>}}}};
    properties.update(more);
    Json& one = out.emplace_back(object_schema(properties));
    add_schema_of(T{}, T::members(), one);
    add_schemas<kAt + 1>(more, out);
  }
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
  std::vector<std::string> known;
  out.kind = read_as(reader.text("type"), reader, known);
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

Json kind_schemas(const Json& more) {
  Json out = Json::array();
  add_schemas(more, out);
  return out;
}

Json schema_of(const Block&) {
  const Json signals = {
      {"type", "array"}, {"items", {{"type", "string"}}}, {"minItems", 1}, {"maxItems", kMaxTerms}};
  return {{"oneOf", kind_schemas({{"from", {{"anyOf", {{{"type", "string"}}, signals}}}},
                                  {"to", {{"type", "string"}}}})}};
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
