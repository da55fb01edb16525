// The numbers of a document, each with its range, unit and source: one table reads them, writes them, sets them by name and
// describes them as JSON Schema.
//
//   {NAME: {"value", "unit", "source"}, ...}
// A value is a number, for some also an object with one for each finger. A name that is left out keeps its value.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "host/model/wiring.hpp"

namespace flexor::model {

using PerFinger = std::array<double, kFingers>;

// Where a number is: one for all fingers, or one for each.
struct Values : std::span<double> {
  Values(double& one) : std::span<double>(&one, 1) {}
  Values(PerFinger& each) : std::span<double>(each) {}
};

struct Number {
  const char* name;
  Values values;
  double min;
  double max;
  const char* unit;
  const char* source;
};
using Numbers = std::vector<Number>;

// "0.2", or one for each finger: "1 2 3 4 5".
std::string value_text(const Number& number);

nlohmann::ordered_json to_json(const Numbers& numbers);
nlohmann::ordered_json schema_of(const Numbers& numbers);

// All below throw io::InputError naming the number; of an unknown name, those that are near.
void read(const nlohmann::ordered_json& object, const Numbers& numbers);
void check(const Numbers& numbers);  // ranges

// "radio.loss=0.05", "hand.lower_deg.index=40".
void assign(const Numbers& numbers, const std::string& assignment);
// What assign() sets by that name; of a name for every finger, the thumb's.
double value(const Numbers& numbers, const std::string& name);

}  // namespace flexor::model
