#include "host/model/number_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "host/io/json.hpp"

namespace flexor::model {
namespace {

using io::InputError;

const Number* find(const Numbers& numbers, const std::string& name) {
  const auto it = std::ranges::find_if(numbers, [&](const Number& n) { return n.name == name; });
  return it == numbers.end() ? nullptr : &*it;
}

[[noreturn]] void unknown(const Numbers& numbers, const std::string& name) {
  std::vector<std::string> near;
  const std::string section = name.substr(0, name.find('.') + 1);
  for (const Number& n : numbers) {
    if (section.empty() || std::string(n.name).starts_with(section)) near.emplace_back(n.name);
  }
  if (near.empty()) {
    for (const Number& n : numbers) near.emplace_back(n.name);
  }
  throw InputError("unknown parameter \"{}\"; known: {}", name, fmt::join(near, ", "));
}

// "radio.loss", or one finger's: "hand.lower_deg.index".
std::span<double> place(const Numbers& numbers, const std::string& name) {
  if (const Number* number = find(numbers, name)) return number->values;
  const auto dot = name.rfind('.');
  const Number* number = dot == std::string::npos ? nullptr : find(numbers, name.substr(0, dot));
  if (number == nullptr || number->values.size() == 1) unknown(numbers, name);
  return number->values.subspan(finger_index(name.substr(dot + 1)), 1);
}

void read_value(const Json& value, const Number& number) {
  const bool each = number.values.size() > 1;
  const auto fail = [&] {
    throw InputError("\"value\" must be a number{}", each ? " or an object with one for each finger" : "");
  };
  if (value.is_number()) {
    std::ranges::fill(number.values, value.get<double>());
    return;
  }
  if (!each || !value.is_object()) fail();
  std::array<bool, kFingers> given{};
  for (const auto& item : value.items()) {
    if (!item.value().is_number()) fail();
    const std::size_t i = finger_index(item.key());
    if (given[i]) throw InputError("\"value\" gives {} twice; remove one", finger_names()[i]);
    given[i] = true;
    number.values[i] = item.value().get<double>();
  }
}

}  // namespace

std::string value_text(const Number& number) { return fmt::format("{}", fmt::join(number.values, " ")); }

Json to_json(const Numbers& numbers) {
  Json out = Json::object();
  for (const Number& n : numbers) {
    Json value = n.values[0];
    if (n.values.size() > 1) {
      value = Json::object();
      for (std::size_t i = 0; i < kFingers; ++i) value[finger_names()[i]] = n.values[i];
    }
    out[n.name] = {{"value", std::move(value)}, {"unit", n.unit}, {"source", n.source}};
  }
  return out;
}

Json schema_of(const Numbers& numbers) {
  Json properties = Json::object();
  for (const Number& n : numbers) {
    const Json one = {{"type", "number"}, {"minimum", n.min}, {"maximum", n.max}};
    Json value = one;
    if (n.values.size() > 1) {
      Json fingers = Json::object();
      for (const std::string& name : finger_names()) fingers[name] = one;
      value = {{"anyOf", {one, {{"type", "object"}, {"properties", std::move(fingers)}}}}};
    }
    properties[n.name] = {{"type", "object"},
                          {"properties",
                           {{"value", std::move(value)},
                            {"unit", {{"const", n.unit}}},
                            {"source", {{"type", "string"}, {"default", n.source}}}}},
                          {"required", {"value"}},
                          {"additionalProperties", false}};
  }
  return {{"type", "object"}, {"properties", std::move(properties)}, {"additionalProperties", false}};
}

void read(const Json& object, const Numbers& numbers) {
  for (const auto& item : object.items()) {
    const Number* number = find(numbers, item.key());
    if (number == nullptr) unknown(numbers, item.key());
    io::JsonReader one(item.value(), item.key());
    try {
      read_value(one.member("value"), *number);
    } catch (const InputError& error) {
      io::fail_within(item.key(), error);
    }
    if (one.has("unit") && one.text("unit") != number->unit)
      one.fail(fmt::format("the unit is {}, not {}", number->unit, one.text("unit")));
    (void)one.text_or_empty("source");
    one.done();
  }
}

void check(const Numbers& numbers) {
  for (const Number& n : numbers) {
    for (const double value : n.values) {
      if (value >= n.min && value <= n.max) continue;
      throw InputError("{}: {} {} is impossible; it must lie between {} and {}", n.name, value, n.unit, n.min,
                       n.max);
    }
  }
}

void assign(const Numbers& numbers, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos) throw InputError("\"{}\": write name=value", assignment);
  const std::string name = assignment.substr(0, equals);
  const std::string text = assignment.substr(equals + 1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError("{}: \"{}\" is not a number", name, text);
  std::ranges::fill(place(numbers, name), value);
}

double value(const Numbers& numbers, const std::string& name) { return place(numbers, name)[0]; }

}  // namespace flexor::model
