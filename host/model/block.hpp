// The kinds of block that a model may have: those of the board's list, and a gain, which is a sum on the board.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "host/model/kinds.hpp"
#include "host/model/lti.hpp"
#include "runtime/compensator/blocks.hpp"

namespace flexor::model {

#define FLEXOR_KIND(name, Host, ...) , Host
using Kind = std::variant<Gain FLEXOR_BLOCKS(FLEXOR_KIND)>;
#undef FLEXOR_KIND

// A variant of T<K> for each kind K.
template <template <class> class T, class Variant>
struct EachOf;
template <template <class> class T, class... K>
struct EachOf<T, std::variant<K...>> {
  using type = std::variant<T<K>...>;
};

// In a document.
template <class K>
inline constexpr const char* kTypeOf = nullptr;
template <>
inline constexpr const char* kTypeOf<Gain> = "gain";
#define FLEXOR_TYPE(name, Host, ...) \
  template <>                        \
  inline constexpr const char* kTypeOf<Host> = #name;
FLEXOR_BLOCKS(FLEXOR_TYPE)
#undef FLEXOR_TYPE

// One block: signals in by name, one signal out.
struct Block {
  std::vector<std::string> from;
  std::string to;
  Kind kind;
  bool operator==(const Block&) const = default;
};

const char* type_of(const Kind& kind);

// Signals that a block takes; every kind but a sum takes one.
std::size_t inputs_of(const Kind& kind);

// As of members.hpp. Of an unknown type it lists those that there are.
void read_object(io::JsonReader& reader, Block& out);
void write_object(const Block& block, Json& json);
Json schema_of(const Block& fresh);

// Its members in a line, for people.
std::string text_of(const Kind& kind);

}  // namespace flexor::model
