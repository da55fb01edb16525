// The objects of a document as tables of members. One table reads an object, writes it and describes it as JSON Schema:
//
//   static constexpr auto members() { return std::tuple(required("x", &T::x), defaulted("y", &T::y)); }
//
// A member is a double, an int, a text, a list of numbers, any object (Json), a T with a table of its own that may be
// absent (std::optional<T>), or a list of T. A T without a table has these three functions as overloads.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "host/io/json.hpp"

namespace flexor::model {

// Of a number its value, which the reader checks; of a text or a list its length, which the kind's own check does.
struct Bounds {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
};

template <class Owner, class T>
struct Member {
  const char* key;
  T Owner::*at;
  Bounds bounds;
  bool is_required;
};

template <class Owner, class T>
constexpr Member<Owner, T> required(const char* key, T Owner::*at, Bounds bounds = {}) {
  return {key, at, bounds, true};
}
// May be left out; then it stays as it is in a new object.
template <class Owner, class T>
constexpr Member<Owner, T> defaulted(const char* key, T Owner::*at, Bounds bounds = {}) {
  return {key, at, bounds, false};
}

template <class T>
concept Table = requires {
  T::members();
};

// Json knows how to hold it.
template <class T>
inline constexpr bool kIsPlain =
    std::is_same_v<T, double> || std::is_same_v<T, int> || std::is_same_v<T, std::string> ||
    std::is_same_v<T, std::vector<double>> || std::is_same_v<T, Json>;
template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

template <Table T>
void read_object(io::JsonReader& reader, T& out);
template <Table T>
void write_object(const T& object, Json& json);
template <Table T>
Json schema_of(const T& fresh);

namespace detail {

template <class T>
T read_inner(const Json& json, const std::string& place) {
  io::JsonReader inner(json, place);
  T out;
  read_object(inner, out);
  inner.done();
  return out;
}

template <class T>
void read_value(io::JsonReader& reader, const char* key, const Bounds& bounds, T& out) {
  if constexpr (std::is_same_v<T, double>) {
    out = reader.number_within(key, bounds.least, bounds.most);
  } else if constexpr (std::is_same_v<T, int>) {
    out = reader.whole_within(key, static_cast<int>(bounds.least), static_cast<int>(bounds.most));
  } else if constexpr (std::is_same_v<T, std::string>) {
    out = reader.text(key);
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    out = reader.numbers(key);
  } else if constexpr (std::is_same_v<T, Json>) {
    out = reader.object_or_empty(key);
  } else if constexpr (kIsOptional<T>) {
    out = read_inner<typename T::value_type>(reader.member(key), fmt::format("{}: {}", reader.place(), key));
  } else {
    const Json& list = reader.list(key);
    for (std::size_t i = 0; i < list.size(); ++i) {
      out.push_back(
          read_inner<typename T::value_type>(list[i], fmt::format("{}: {}[{}]", reader.place(), key, i)));
    }
  }
}

template <class T>
void write_value(const T& value, Json& out) {
  if constexpr (kIsPlain<T>) {
    out = value;
  } else if constexpr (kIsOptional<T>) {
    write_object(*value, out);
  } else {
    out = Json::array();
    for (const auto& one : value) write_object(one, out.emplace_back(Json::object()));
  }
}

template <class T>
Json schema_of_value(const Bounds& bounds) {
  const auto bounded = [&](Json out, const char* least, const char* most) {
    const auto number = [](double x) { return std::is_same_v<T, double> ? Json(x) : Json(std::llround(x)); };
    if (std::isfinite(bounds.least)) out[least] = number(bounds.least);
    if (std::isfinite(bounds.most)) out[most] = number(bounds.most);
    return out;
  };
  if constexpr (std::is_same_v<T, double>) {
    return bounded({{"type", "number"}}, "minimum", "maximum");
  } else if constexpr (std::is_same_v<T, int>) {
    return bounded({{"type", "integer"}}, "minimum", "maximum");
  } else if constexpr (std::is_same_v<T, std::string>) {
    return bounded({{"type", "string"}}, "minLength", "maxLength");
  } else if constexpr (std::is_same_v<T, Json>) {
    return {{"type", "object"}};
  } else if constexpr (kIsOptional<T>) {
    return schema_of(typename T::value_type{});
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    return bounded({{"type", "array"}, {"items", {{"type", "number"}}}}, "minItems", "maxItems");
  } else {
    return bounded({{"type", "array"}, {"items", schema_of(typename T::value_type{})}}, "minItems",
                   "maxItems");
  }
}

}  // namespace detail

// Throws io::InputError naming the member. Leaves what is unknown to the reader's done().
template <Table T>
void read_object(io::JsonReader& reader, T& out) {
  const auto read = [&](const auto& m) {
    if (m.is_required || reader.has(m.key)) detail::read_value(reader, m.key, m.bounds, out.*m.at);
  };
  std::apply([&](const auto&... m) { (..., read(m)); }, T::members());
}

template <Table T>
void write_object(const T& object, Json& json) {
  const auto write = [&](const auto& m) {
    const auto& value = object.*m.at;
    if constexpr (kIsOptional<std::decay_t<decltype(value)>>) {
      if (!value) return;
    }
    detail::write_value(value, json[m.key]);
  };
  std::apply([&](const auto&... m) { (..., write(m)); }, T::members());
}

// Adds to the schema of an object. `fresh` has the values of members that are left out.
template <Table T>
void add_schema_of(const T& fresh, Json& out) {
  const auto add = [&](const auto& m) {
    using Value = std::decay_t<decltype(fresh.*m.at)>;
    Json& one = out["properties"][m.key];
    one = detail::schema_of_value<Value>(m.bounds);
    if (m.is_required) {
      out["required"].push_back(m.key);
    } else if constexpr (kIsPlain<Value>) {
      one["default"] = fresh.*m.at;
    }
  };
  std::apply([&](const auto&... m) { (..., add(m)); }, T::members());
}

// Of an object with these members, which no others may have.
inline Json object_schema(Json properties) {
  Json out = {{"type", "object"}, {"additionalProperties", false}, {"required", Json::array()}};
  for (const auto& item : properties.items()) out["required"].push_back(item.key());
  out["properties"] = std::move(properties);
  return out;
}
template <Table T>
Json schema_of(const T& fresh) {
  Json out = object_schema(Json::object());
  add_schema_of(fresh, out);
  return out;
}

}  // namespace flexor::model
