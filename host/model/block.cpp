#include "host/model/block.hpp"

namespace flexor::model {
namespace {

template <std::size_t kAt = 0>
Kind read_as(const std::string& type, io::JsonReader& block, std::vector<std::string>& known) {
  if constexpr (kAt == std::variant_size_v<Kind>) {
    block.fail(fmt::format("unknown block \"{}\"; known: {}", type, fmt::join(known, ", ")));
  } else {
    using T = std::variant_alternative_t<kAt, Kind>;
    if (type == T::kType) return T::read(block);
    known.emplace_back(T::kType);
    return read_as<kAt + 1>(type, block, known);
  }
}

}  // namespace

const char* type_of(const Kind& kind) {
  return std::visit([](const auto& k) { return k.kType; }, kind);
}

std::size_t inputs_of(const Kind& kind) {
  const auto* sum = std::get_if<Sum>(&kind);
  return sum != nullptr ? sum->weights.size() : 1;
}

Kind read_kind(io::JsonReader& block) {
  std::vector<std::string> known;
  return read_as(block.text("type"), block, known);
}

void write_kind(const Kind& kind, Json& json) {
  std::visit([&](const auto& k) { k.write(json); }, kind);
}

std::string text_of(const Kind& kind) {
  return std::visit([](const auto& k) { return k.text(); }, kind);
}

}  // namespace flexor::model
