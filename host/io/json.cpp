#include "host/io/json.hpp"

#include <cstring>

namespace flexor::io {
namespace {

constexpr int kDeepest = 64;
constexpr std::size_t kMost_bytes = 16 << 20;  // which take up to 0.7 GB when parsed
constexpr std::size_t kMostKeys = 512;         // each is looked for among those before it
constexpr std::size_t kLongestExcerpt = 60;

// What the parser lets pass: any depth, and of two members of one key the last.
class Limits {
 public:
  explicit Limits(const std::string& source) : source_(source) {}

  bool operator()(int depth, Json::parse_event_t event, const Json& parsed) {
    using Event = Json::parse_event_t;
    if (event == Event::object_end) keys_.pop_back();
    if (event == Event::object_start) keys_.emplace_back();
    if ((event == Event::object_start || event == Event::array_start) && depth >= kDeepest)
      throw InputError("{}: nested deeper than {} levels", source_, kDeepest);
    if (event != Event::key) return true;
    if (!keys_.back().insert(parsed.get<std::string>()).second)
      throw InputError("{}: key {} comes twice in one object; remove one", source_,
                       start_of(dump_line(parsed), kLongestExcerpt));
    if (keys_.back().size() > kMostKeys)
      throw InputError("{}: an object of more than {} keys; is it the right file?", source_, kMostKeys);
    return true;
  }

 private:
  const std::string& source_;
  std::vector<std::set<std::string>> keys_;
};

// What the parser stumbled over: a byte, a word, or the end.
std::string reason_of(const Json::parse_error& error, std::string_view text) {
  const auto line = [&](std::size_t at) { return 1 + std::ranges::count(text.substr(0, at), '\n'); };
  for (std::size_t at = 0, length = 0; at < text.size(); at += length) {
    length = utf8_length(text, at);
    if (length == 0)
      return fmt::format("is no UTF-8 text: byte {}, in line {}; save it as UTF-8", at, line(at));
  }
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
  const std::size_t at = std::min(error.byte, text.size() + 1) - 1;
  const std::size_t begin = text.substr(0, at + 1).find_last_not_of(kLetters) + 1;
  const std::string_view word = text.substr(begin, text.find_first_not_of(kLetters, begin) - begin);
  const bool is_json = word.empty() || word == "true" || word == "false" || word == "null";
  if (!is_json && begin + word.size() < text.size() && !std::strstr(error.what(), "invalid string"))
    return fmt::format("not valid JSON at line {}: {} is no value; a number, or a text in quotes?", line(at),
                       start_of(word, kLongestExcerpt));
  return fmt::format("not valid JSON at line {}; is the file cut off?", line(at));
}

}  // namespace

std::string read_document(const std::filesystem::path& path) { return read_file(path, kMost_bytes); }

Json parse_json(const std::string& text, const std::string& source) {
  if (text.size() > kMost_bytes) {
    throw InputError("{}: a document of {} MB; at most {} are read", source, text.size() >> 20,
                     kMost_bytes >> 20);
  }
  Limits limits(source);
  try {
    if (!text.starts_with("\xFF\xFE")) return Json::parse(text, std::ref(limits));
    std::u16string wide(text.size() / 2, u' ');  // as Windows PowerShell writes what a program prints
    std::memcpy(wide.data(), text.data(), 2 * wide.size());
    return Json::parse(wide, std::ref(limits));
  } catch (const Json::out_of_range& error) {
    const std::string what = error.what();
    const std::string reason = what.substr(what.find("] ") + 2);
    throw InputError("{}: {}", source, start_of(reason, 2 * kLongestExcerpt));
  } catch (const Json::parse_error& error) {
    throw InputError("{}: {}", source, reason_of(error, text));
  }
}

namespace {

// Letters that control a terminal are escaped, and all others beside them.
std::string dump_with(const Json& json, int indent) {
  const std::string out = json.dump(indent, ' ', false, Json::error_handler_t::replace);
  return without_controls(out, "\n") == out ? out
                                            : json.dump(indent, ' ', true, Json::error_handler_t::replace);
}

}  // namespace

std::string dump(const Json& json) { return dump_with(json, 2) + "\n"; }
std::string dump_line(const Json& json) { return dump_with(json, -1); }

std::string to_utf8(std::string_view bytes) {
  std::string out;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t length = utf8_length(bytes, at);
    out += length > 0 ? bytes.substr(at, length) : std::string_view("\xEF\xBF\xBD");
    at += std::max<std::size_t>(length, 1);
  }
  return out;
}

}  // namespace flexor::io
