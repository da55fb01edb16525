// JSON documents: parsing and reading with errors that name the place and the mend.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::io {

// The text of a file that is to be parsed. Throws InputError as read_file does, and above 16 MB.
std::string read_document(const std::filesystem::path& path);

// `source` names the text in errors. Throws InputError, one line with the place: no JSON, more than 16 MB, 64 levels or
// 512 keys in one object, a key twice, a number out of range, NaN or Infinity, text that is not UTF-8.
Json parse_json(const std::string& text, const std::string& source);

// As a document: indented, UTF-8 whatever the texts in it hold, with a newline at its end.
std::string dump(const Json& json);
// On one line.
std::string dump_line(const Json& json);

// The same text with every byte that is not UTF-8 replaced by U+FFFD: file names are bytes, documents are
// text.
std::string to_utf8(std::string_view bytes);

// `error` again, with the source in front of it, where it is not there yet.
[[noreturn]] inline void fail_within(const std::string& source, const InputError& error) {
  const std::string what = error.what();
  throw InputError(what.starts_with(source + ": ") ? what : fmt::format("{}: {}", source, what));
}

// Reads one JSON object's members and reports which are missing, wrong or unknown, with their place.
class JsonReader {
 public:
  JsonReader(const Json& object, std::string place) : object_(object), place_(std::move(place)) {
    if (!object.is_object()) fail("must be an object");
  }

  [[noreturn]] void fail(const std::string& what) const { throw InputError("{}: {}", place_, what); }

  // Of a document of this kind, at most of this version.
  void schema(const char* name, int newest) {
    if (!has("schema"))
      fail(fmt::format(R"(begin it with "schema": "{}", "schema_version": {},)", name, newest));
    if (text("schema") != name) fail(fmt::format("\"schema\" must be \"{}\"", name));
    const double version = number("schema_version");
    if (version > newest)
      fail(fmt::format("has schema_version {}, newer than {}: update Flexor", version, newest));
    (void)whole_within("schema_version", 1, newest);
  }

  double number(const char* key) {
    const Json& value = member(key);
    if (!value.is_number()) fail(fmt::format("\"{}\" must be a number", key));
    return value.get<double>();
  }

  double number_within(const char* key, double low, double high) {
    return within(key, number(key), low, high);
  }

  int whole_within(const char* key, int low, int high) {
    const double value = number(key);
    if (!(value >= low && value <= high && value == std::floor(value))) {
      fail(fmt::format("\"{}\" is {:g}; it must be a whole number from {} to {}", key, value, low, high));
    }
    return static_cast<int>(value);
  }

  std::string text(const char* key) {
    const Json& value = member(key);
    if (!value.is_string()) fail(fmt::format("\"{}\" must be a text in quotes", key));
    return value.get<std::string>();
  }

  std::string text_or_empty(const char* key) { return has(key) ? text(key) : std::string(); }

  std::vector<double> numbers(const char* key) {
    const Json& value = member(key);
    const bool all_numbers =
        value.is_array() && std::ranges::all_of(value, [](const Json& v) { return v.is_number(); });
    if (!all_numbers) fail(fmt::format("\"{}\" must be a list of numbers", key));
    return value.get<std::vector<double>>();
  }

  std::vector<double> numbers_within(const char* key, double low, double high) {
    std::vector<double> values = numbers(key);
    for (const double value : values) within(key, value, low, high);
    return values;
  }

  std::vector<double> numbers_or_empty(const char* key) {
    return has(key) ? numbers(key) : std::vector<double>();
  }

  Json object_or_empty(const char* key) {
    if (!has(key)) return Json::object();
    const Json& value = member(key);
    if (!value.is_object()) fail(fmt::format("\"{}\" must be an object", key));
    return value;
  }

  const Json& list(const char* key) {
    const Json& value = member(key);
    if (!value.is_array() || value.empty()) fail(fmt::format("\"{}\" must be a list, not empty", key));
    return value;
  }

  const Json& member(const char* key) {
    known_.insert(key);
    const auto it = object_.find(key);
    if (it == object_.end()) fail(fmt::format("\"{}\" is missing; add it", key));
    return *it;
  }

  bool has(const char* key) {
    known_.insert(key);
    return object_.contains(key);
  }

  // A misspelt key must not pass silently.
  void done() const {
    for (const auto& item : object_.items()) {
      if (!known_.contains(item.key())) {
        fail(fmt::format("unknown key \"{}\"; known here: {}", item.key(), fmt::join(known_, ", ")));
      }
    }
  }

  const std::string& place() const { return place_; }

 private:
  double within(const char* key, double value, double low, double high) const {
    if (!(value >= low && value <= high)) {
      fail(fmt::format("\"{}\" is {:g}; it must lie between {:g} and {:g}", key, value, low, high));
    }
    return value;
  }

  const Json& object_;
  std::string place_;
  std::set<std::string> known_;
};

}  // namespace flexor::io
