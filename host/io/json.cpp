#include "host/io/json.hpp"

namespace flexor::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kDeepest = 64;
constexpr std::size_t kMost_bytes = 16 << 20;  // which take up to 0.7 GB when parsed
constexpr std::size_t kMostKeys = 512;         // each is looked for among those before it
constexpr std::size_t kLongestExcerpt = 60;

// What the parser does not say, or says by running out of stack: how deep, which word is no JSON, which byte
// no UTF-8.
class Scan {
 public:
  Scan(std::string_view text, const std::string& source) : text_(text), source_(source) {}

  void run() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"') {
        skip_text();
      } else if (is_letter(c)) {
        require_json_word();
      } else if (c == '-' || is_digit(c)) {
        skip_number();
      } else {
        bracket(c);
        step();
      }
    }
  }

 private:
  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }

  [[noreturn]] void fail(const std::string& what) const { throw InputError(source_ + ": " + what); }

  void step() {
    const std::size_t length = utf8_length(text_, at_);
    if (length == 0) {
      fail(fmt::format("is no UTF-8 text: byte {}, in line {}; save it as UTF-8", at_, line_));
    }
    if (text_[at_] == '\n') ++line_;
    at_ += length;
  }

  void bracket(char c) {
    if (c == '[' || c == '{') ++depth_;
    if ((c == ']' || c == '}') && depth_ > 0) --depth_;
    if (depth_ > kDeepest) fail(fmt::format("nested deeper than {} levels at line {}", kDeepest, line_));
  }

  void skip_text() {
    step();
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] == '\\') ++at_;
      if (at_ < text_.size()) step();
    }
    if (at_ < text_.size()) step();
  }

  void skip_number() {
    while (at_ < text_.size() &&
           (is_digit(text_[at_]) || std::string_view("+-.eE").find(text_[at_]) != std::string_view::npos))
      ++at_;
  }

  void require_json_word() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && is_letter(text_[at_])) ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    if (word == "true" || word == "false" || word == "null") return;
    // A word that the end cut short is told as such by the parser.
    if (at_ == text_.size()) return;
    fail(fmt::format("not valid JSON at line {}: {} is no value; a number, or a text in quotes?", line_,
                     start_of(word, kLongestExcerpt)));
  }

  std::string_view text_;
  const std::string& source_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  std::size_t depth_ = 0;
};

// The parser would keep the last of two.
class UniqueKeys {
 public:
  explicit UniqueKeys(const std::string& source) : source_(source) {}

  bool operator()(Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) open_.emplace_back();
    if (event == Json::parse_event_t::object_end) open_.pop_back();
    if (event != Json::parse_event_t::key) return true;
    if (!open_.back().insert(parsed.get<std::string>()).second) {
      throw InputError(fmt::format("{}: key {} comes twice in one object; remove one", source_,
                                   start_of(dump_line(parsed), kLongestExcerpt)));
    }
    if (open_.back().size() > kMostKeys)
      throw InputError(
          fmt::format("{}: an object of more than {} keys; is it the right file?", source_, kMostKeys));
    return true;
  }

 private:
  const std::string& source_;
  std::vector<std::set<std::string>> open_;
};

}  // namespace

std::string read_document(const std::filesystem::path& path) { return read_file(path, kMost_bytes); }

nlohmann::ordered_json parse_json(const std::string& text, const std::string& source) {
  if (text.size() > kMost_bytes) {
    throw InputError(fmt::format("{}: a document of {} MB; at most {} are read", source, text.size() >> 20,
                                 kMost_bytes >> 20));
  }
  Scan(text, source).run();
  UniqueKeys unique(source);
  try {
    return Json::parse(text,
                       [&](int, Json::parse_event_t event, Json& parsed) { return unique(event, parsed); });
  } catch (const Json::out_of_range& error) {
    const std::string what = error.what();
    const std::string reason = what.substr(what.find("] ") + 2);
    throw InputError(fmt::format("{}: {}", source, start_of(reason, 2 * kLongestExcerpt)));
  } catch (const Json::parse_error& error) {
    const std::string what = error.what();
    const auto at = what.find("at line");
    throw InputError(fmt::format("{}: not valid JSON {}; is the file cut off?", source,
                                 at == std::string::npos ? what : what.substr(at, what.find(';') - at)));
  }
}

namespace {

// Letters that a terminal obeys are escaped, and all others beside them.
std::string dump_with(const nlohmann::ordered_json& json, int indent) {
  const std::string out = json.dump(indent, ' ', false, Json::error_handler_t::replace);
  return without_controls(out, "\n") == out ? out
                                            : json.dump(indent, ' ', true, Json::error_handler_t::replace);
}

}  // namespace

std::string dump(const nlohmann::ordered_json& json) { return dump_with(json, 2) + "\n"; }
std::string dump_line(const nlohmann::ordered_json& json) { return dump_with(json, -1); }

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
