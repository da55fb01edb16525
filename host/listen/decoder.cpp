#include "host/listen/decoder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "host/recording/time.hpp"
#include "host/recording/unit.hpp"
#include "runtime/link/opengloves.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::listen {
namespace {

constexpr std::array<const char*, 5> kFingerNames = {"thumb", "index", "middle", "ring", "pinky"};
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kLongestLine = 4096;  // bytes; beyond it is no line of a glove's

// A clock of 16 bits in milliseconds, which wraps every 65.5 s, made whole by the host's.
class WrappingClock {
 public:
  double seconds(std::uint16_t now_ms, double host_s) {
    constexpr double kWrap_ms = 65536;
    if (!started_) {
      started_ = true;
      total_ms_ = now_ms;
    } else {
      const double step_ms = static_cast<std::uint16_t>(now_ms - last_ms_);
      const double wraps = std::max(0.0, std::round((1000 * (host_s - host_s_) - step_ms) / kWrap_ms));
      total_ms_ += step_ms + wraps * kWrap_ms;
    }
    last_ms_ = now_ms;
    host_s_ = host_s;
    return total_ms_ / 1000;
  }

 private:
  bool started_ = false;
  std::uint16_t last_ms_ = 0;
  double total_ms_ = 0;
  double host_s_ = 0;
};

// What one of both boards says in frames, of which some are samples.
class FrameDecoder : public Decoder {
 public:
  void push(std::span<const std::uint8_t> bytes, double host_s, std::vector<Sample>& out) final {
    for (const std::uint8_t byte : bytes) {
      ++tally_.bytes;
      ++held_;
      const link::Received result = packet_.push(byte);
      if (byte != link::kDelimiter) continue;
      const std::uint64_t size = held_;
      held_ = 0;
      if (size == 1) tally_.understood += 1;  // a delimiter alone
      if (result == link::Received::nothing) continue;
      if (result != link::Received::pending) {
        ++tally_.torn;
        continue;
      }
      if (!is_its_own()) continue;
      tally_.understood += size;
      if (is_sample()) take(host_s, out);
    }
  }

  void cut() final {
    if (held_ > 0) ++tally_.torn;
    held_ = 0;
    (void)packet_.push(link::kDelimiter);
  }

 protected:
  virtual bool is_its_own() = 0;  // the frame is of this board
  virtual bool is_sample() const = 0;
  virtual bool read(std::uint16_t& time_ms, Sample& sample) = 0;

  bool is_state_of(link::BoardKind board) const {
    return packet_.type() == link::Type::state && packet_.body_bytes() == link::State::kBytes &&
           link::get_state(packet_.body()).board == board;
  }

  // A counter that starts anew, as with each challenge, is no gap.
  void count_gap() {
    constexpr std::uint16_t kLongestGap = 1000;
    const std::uint16_t sequence = packet_.sequence();
    const auto gap = static_cast<std::uint16_t>(sequence - next_);
    tally_.lost = tally_.lost.value_or(0) + (tally_.samples > 0 && gap < kLongestGap ? gap : 0);
    next_ = static_cast<std::uint16_t>(sequence + 1);
  }

  link::PacketReader packet_;

 private:
  void take(double host_s, std::vector<Sample>& out) {
    std::uint16_t time_ms = 0;
    Sample sample;
    if (!read(time_ms, sample)) {
      ++tally_.torn;
      return;
    }
    sample.host_s = host_s;
    sample.board_s = clock_.seconds(time_ms, host_s);
    count_sample();
    out.push_back(std::move(sample));
  }

  WrappingClock clock_;
  std::uint64_t held_ = 0;
  std::uint16_t next_ = 0;
};

const char* remark_of(link::SensorStatus status) {
  switch (status) {
    case link::SensorStatus::ok:
      return "";
    case link::SensorStatus::open:
      return "broken wire";
    case link::SensorStatus::short_circuit:
      return "short circuit";
    case link::SensorStatus::stuck:
      break;
  }
  return "stuck";
}

class GloveFrames : public FrameDecoder {
 public:
  explicit GloveFrames(bool readings) : wanted_(readings ? link::Type::readings : link::Type::angles) {}
  // Its angles would wait for the hand's challenge; readings carry no tag in any case: nobody moves by them.
  std::string remark() const override {
    if (wanted_ == link::Type::angles || !waits_for_hand_) return {};
    return "the glove waits for its hand; nothing guards its readings";
  }

 protected:
  bool is_its_own() override {
    const link::Type type = packet_.type();
    const bool state = is_state_of(link::BoardKind::glove);
    if (state) waits_for_hand_ = !link::get_state(packet_.body()).in_touch;
    if (type == link::Type::angles) waits_for_hand_ = false;
    return state || type == link::Type::angles || type == link::Type::readings ||
           type == link::Type::coefficients;
  }
  bool is_sample() const override { return packet_.type() == wanted_; }
  bool read(std::uint16_t& time_ms, Sample& sample) override {
    return wanted_ == link::Type::angles ? angles(time_ms, sample) : readings(time_ms, sample);
  }

 private:
  bool angles(std::uint16_t& time_ms, Sample& sample) {
    const std::uint8_t joints = link::joints_in(packet_.body_bytes());
    if (joints == 0 || !fits(joints, "deg")) return false;
    std::array<std::int16_t, link::kMaxJoints> angle{};
    std::array<link::SensorStatus, link::kMaxJoints> status{};
    link::get_angles(packet_.body(), joints, time_ms, angle.data(), status.data());
    for (std::size_t i = 0; i < joints; ++i) {
      sample.value.push_back(angle.at(i) / 16.0);
      sample.remark.emplace_back(remark_of(status.at(i)));
    }
    count_gap();
    return true;
  }

  bool readings(std::uint16_t& time_ms, Sample& sample) {
    if (packet_.body_bytes() != link::readings_bytes(link::kFingers) || !fits(link::kFingers, "count"))
      return false;
    std::array<std::uint16_t, link::kFingers> counts{};
    link::get_readings(packet_.body(), link::kFingers, time_ms, counts.data());
    sample.value.assign(counts.begin(), counts.end());
    return true;
  }

  // The first frame says how many there are.
  bool fits(std::size_t count, const char* unit) {
    for (std::size_t i = columns_.size(); tally_.samples == 0 && i < count; ++i) {
      columns_.push_back(count == kFingerNames.size() ? fmt::format("{}_{}", kFingerNames.at(i), unit)
                                                      : fmt::format("joint{}_{}", i + 1, unit));
    }
    if (columns_.size() != count) count_misfit(count, columns_.size());
    return columns_.size() == count;
  }

  link::Type wanted_;
  bool waits_for_hand_ = false;
};

std::string remark_of_finger(std::uint8_t fault) {
  static constexpr std::array kNames = {"",        "stalled",  "blind",    "frozen",
                                        "slipped", "reversed", "floating", "noisy"};
  return fault < kNames.size() ? kNames.at(fault) : "a fault that this version does not know";
}

std::string remark_of_board(std::uint8_t faults) {
  static constexpr std::array kNames = {"supply dip", "converter stuck", "started by a brown-out",
                                        "started by the watchdog", "a driver that did not stop"};
  std::string out;
  for (std::size_t bit = 0; bit < kNames.size(); ++bit) {
    if ((faults >> bit & 1) != 0) out += (out.empty() ? "" : ", ") + std::string(kNames.at(bit));
  }
  return out;
}

class HandFrames : public FrameDecoder {
 public:
  HandFrames() {
    for (const char* unit : {"deg", "duty_percent", "fault"}) {
      for (const char* finger : kFingerNames) columns_.push_back(fmt::format("{}_{}", finger, unit));
    }
    columns_.emplace_back("board_faults");
  }

 protected:
  bool is_its_own() override {
    const link::Type type = packet_.type();
    const bool state = is_state_of(link::BoardKind::hand);
    if (state) count_gap();
    return state || type == link::Type::telemetry || type == link::Type::challenge;
  }
  bool is_sample() const override { return packet_.type() == link::Type::telemetry; }
  bool read(std::uint16_t& time_ms, Sample& sample) override {
    if (packet_.body_bytes() != link::telemetry_bytes(link::kFingers)) return false;
    const std::uint8_t* body = packet_.body();
    time_ms = static_cast<std::uint16_t>(body[0] | body[1] << 8);
    sample.value.resize(columns_.size());
    sample.remark.resize(columns_.size());
    for (std::uint8_t i = 0; i < link::kFingers; ++i) {
      const link::FingerTelemetry finger = link::get_telemetry(body, i);
      sample.value[i] = finger.angle / 16.0;
      sample.value[i + link::kFingers] = std::max(-100.0, 100 * finger.duty / 127.0);
      sample.value[i + 2 * link::kFingers] = finger.fault;
      sample.remark[i + 2 * link::kFingers] = remark_of_finger(finger.fault);
    }
    sample.value.back() = body[2];
    sample.remark.back() = remark_of_board(body[2]);
    count_gap();
    return true;
  }
};

// What comes as lines.
class TextDecoder : public Decoder {
 public:
  void push(std::span<const std::uint8_t> bytes, double host_s, std::vector<Sample>& out) final {
    for (const std::uint8_t byte : bytes) {
      ++tally_.bytes;
      if (byte != '\n') {
        if (line_.size() <= kLongestLine) line_ += static_cast<char>(byte);
        continue;
      }
      const std::uint64_t size = line_.size() + 1;
      if (!line_.empty() && line_.back() == '\r') line_.pop_back();
      if (std::exchange(is_piece_, false)) {
        if (size <= kLongestLine) take_piece(line_);
      } else if (size <= kLongestLine && take(line_, host_s, out)) {
        tally_.understood += size;
      } else {
        ++tally_.torn;
      }
      line_.clear();
    }
  }

  void cut() override {
    if (!is_piece_ && !line_.empty()) ++tally_.torn;
    line_.clear();
    is_piece_ = true;
  }

 protected:
  virtual bool take(const std::string& line, double host_s, std::vector<Sample>& out) = 0;
  // The first line of a port, which as a rule is the end of one.
  virtual void take_piece(const std::string& /*line*/) {}

  void give(Sample sample, std::vector<Sample>& out) {
    count_sample();
    out.push_back(std::move(sample));
  }

 private:
  std::string line_;
  bool is_piece_ = false;
};

class GlovesDecoder : public TextDecoder {
 protected:
  bool take(const std::string& line, double host_s, std::vector<Sample>& out) override {
    const std::string text = line + '\n';
    link::GloveLine said;
    const link::GloveParse parse =
        link::parse_gloves(text.data(), static_cast<std::uint16_t>(text.size()), said);
    if (parse == link::GloveParse::information) return true;
    if (parse != link::GloveParse::ok) {
      if (tally_.samples > 0) count_misfit(0, places_.size());
      return false;
    }
    if (tally_.samples == 0) name_columns(said);
    Sample sample{host_s, {}, {}, {}};
    if (tally_.samples > 0 && values_in(said) != places_.size())
      count_misfit(values_in(said), places_.size());
    for (const auto& [finger, place] : places_) {
      const bool there = place < 0 ? said.has[finger] : said.has_joint[finger][place];
      if (!there) return false;
      sample.value.push_back(place < 0 ? said.values.flexion[finger] : said.joint[finger][place]);
    }
    give(std::move(sample), out);
    return true;
  }

 private:
  static std::size_t values_in(const link::GloveLine& said) {
    std::size_t out = 0;
    for (int finger = 0; finger < link::kGloveFingers; ++finger) {
      out += said.has[finger] ? 1 : 0;
      out += static_cast<std::size_t>(
          std::count(said.has_joint[finger], said.has_joint[finger] + link::kGlovePlaces, true));
    }
    return out;
  }
  void name_columns(const link::GloveLine& said) {
    for (int finger = 0; finger < link::kGloveFingers; ++finger) {
      const char* name = kFingerNames.at(static_cast<std::size_t>(finger));
      if (said.has[finger]) add(finger, -1, fmt::format("{}_count", name));
      for (int place = 0; place < link::kGlovePlaces; ++place) {
        if (said.has_joint[finger][place])
          add(finger, place, fmt::format("{}_joint{}_count", name, place + 1));
      }
    }
  }
  void add(int finger, int place, std::string column) {
    places_.emplace_back(finger, place);
    columns_.push_back(std::move(column));
  }

  std::vector<std::pair<int, int>> places_;  // finger, joint or -1
};

// Cells between separators; of blanks, several are one.
std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> out;
  while (true) {
    if (separator == ' ') line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    if (separator == ' ' && line.empty()) return out;
    const std::size_t end = std::min(line.find(separator), line.size());
    out.push_back(recording::trimmed(line.substr(0, end)));
    if (end == line.size()) return out;
    line.remove_prefix(end + 1);
  }
}

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !recording::is_measurement(value))
    return {};
  return value;
}

bool is_name(std::string_view cell) { return !recording::is_missing(cell) && !recording::to_number(cell); }

// A recording has a t_s and a host_s of its own, and is read by names: one that is taken gets a number.
std::vector<std::string> without_clashes(const std::vector<std::string>& names) {
  std::set<std::string> given = {"t_s", "host_s"};
  std::vector<std::string> out;
  for (const std::string& name : names) {
    std::string own = name;
    for (int k = 2; given.contains(own) || (own != name && std::ranges::find(names, own) != names.end()); ++k)
      own = fmt::format("{}-{}", name, k);
    given.insert(own);
    out.push_back(own);
  }
  return out;
}

class LineDecoder : public TextDecoder {
 public:
  void cut() override {
    TextDecoder::cut();
    is_fresh_ = true;
  }
  std::string refusal() const override { return refusal_; }

 protected:
  bool take(const std::string& line, double host_s, std::vector<Sample>& out) override {
    if (recording::trimmed(line).empty() || !refusal_.empty()) return true;
    std::string text = without_clock(line);
    if (separator_ == 0) separator_ = separator_of(text);
    if (separator_ == ';') std::ranges::replace(text, ',', '.');  // decimal commas
    std::vector<std::string_view> cells = cells_of(text, separator_);
    const std::vector<std::string_view> labels = take_labels(cells);
    if (!labels.empty() && !take_labelled(labels)) return false;
    const bool is_header = std::ranges::all_of(cells, is_name);
    const bool is_row = !is_header || (!cells.empty() && !cells[0].empty() &&
                                       number(cells[0].substr(0, 1)));  // "1;2" is a name, too
    std::vector<double> numbers = is_header ? std::vector<double>() : numbers_in(cells);
    const bool is_text = !is_row || (numbers.empty() && cells.size() == names_.size());
    const std::size_t found = is_text ? 0 : cells.size();
    if (tally_.samples > 0 && found != names_.size() && (is_text || found != other_.size()))
      count_misfit(found, names_.size());
    if (is_header) return take_header(cells);
    if (numbers.empty()) return false;
    if (names_.empty() && !take_names(numbers.size())) return true;
    if (is_anothers(numbers.size())) return true;
    if (numbers.size() != names_.size()) return false;
    is_fresh_ = false;
    numbers = in_own_order(numbers);
    if (time_ && std::isnan(numbers[*time_])) return false;
    Sample sample{host_s, {}, {}, {}};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (time_ == i) {
        sample.board_s = numbers[i] * unit_s_;
      } else {
        sample.value.push_back(numbers[i]);
      }
    }
    give(std::move(sample), out);
    return true;
  }

  // A board that starts when its port is opened begins with its header.
  void take_piece(const std::string& line) override {
    const char separator = separator_ == 0 ? separator_of(line) : separator_;
    const std::vector<std::string_view> cells = cells_of(line, separator);
    if (cells.size() < 2 || !std::ranges::all_of(cells, is_name)) return;
    separator_ = separator;
    take_header(cells);
  }

 private:
  // "17:03:50.753 -> 512,498", as the Arduino IDE shows it.
  static std::string without_clock(const std::string& line) {
    const std::size_t arrow = line.find(" -> ");
    return arrow == std::string::npos ? line : line.substr(arrow + 4);
  }

  // "thumb:512,index:498", as serial plotters take it: the names, which are cut off the cells. Empty: not all have one.
  static std::vector<std::string_view> take_labels(std::vector<std::string_view>& cells) {
    std::vector<std::string_view> names;
    std::vector<std::string_view> values;
    for (const std::string_view cell : cells) {
      const std::size_t colon = std::min(cell.find(':'), cell.size());
      names.push_back(recording::trimmed(cell.substr(0, colon)));
      values.push_back(recording::trimmed(cell.substr(std::min(colon + 1, cell.size()))));
      if (!is_name(names.back()) || !number(values.back())) return {};
    }
    cells = values;
    return names;
  }

  // A labelled row says itself whose it is; another glove's are known by two alike, for a label may be torn.
  bool take_labelled(const std::vector<std::string_view>& labels) {
    if (std::ranges::equal(labels, names_)) {
      places_.clear();
      other_.clear();
      return true;
    }
    const bool is_again = !other_.empty() && std::ranges::equal(labels, other_);
    if (take_header(labels)) return true;
    if (is_again) is_anothers(labels.size());
    return false;
  }

  static char separator_of(const std::string& line) {
    for (const char c : {'\t', ';', ','}) {
      if (line.find(c) != std::string::npos) return c;
    }
    return ' ';
  }

  // A strip that is dead is missing, NaN, beside others that are not, once it is known what the columns are. Empty: torn.
  std::vector<double> numbers_in(const std::vector<std::string_view>& cells) const {
    std::vector<double> out;
    for (const std::string_view cell : cells) {
      const bool is_missing = !names_.empty() && recording::is_missing(cell);
      const std::optional<double> value = is_missing ? kMissing : number(cell);
      if (!value) return {};
      out.push_back(*value);
    }
    return std::ranges::all_of(out, [](double value) { return std::isnan(value); }) ? std::vector<double>()
                                                                                    : out;
  }

  // The header again, as after a reset of the board, is no sample and nothing torn.
  bool take_header(const std::vector<std::string_view>& cells) {
    const std::vector<std::string> names(cells.begin(), cells.end());
    if (tally_.samples > 0) return take_later_header(names);
    if (names == names_) return true;
    if (cells.size() < 2) {
      separator_ = 0;  // a greeting
      return false;
    }
    names_ = names;
    has_header_ = true;
    columns_.clear();
    time_.reset();
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (!time_ && is_time(names_[i])) {
        time_ = i;
      } else {
        columns_.push_back(names_[i]);
      }
    }
    columns_ = without_clashes(columns_);
    return true;
  }

  // Of the glove that was plugged in again, or another. A greeting shares no name with a header, and where nothing was
  // plugged in a greeting is all that it can be. Without a header before, no name is wrong.
  bool take_later_header(const std::vector<std::string>& names) {
    if (std::vector<std::size_t> places = places_of(names); !places.empty()) {
      places_ = std::move(places);
      other_.clear();
      return true;
    }
    const bool shares = std::ranges::any_of(
        names, [this](const std::string& name) { return std::ranges::find(names_, name) != names_.end(); });
    if (has_header_ && names.size() > 1 && (is_fresh_ || shares)) other_ = names;
    return false;
  }

  // Where each of them stands in the header that was first; empty: they are not the same. The first one may be torn, or
  // stand behind half a row.
  std::vector<std::size_t> places_of(const std::vector<std::string>& names) const {
    const std::size_t n = names_.size();
    if (names.size() != n) return {};
    std::vector<std::size_t> out(n, n);
    std::vector<bool> is_given(n);
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t k = 0; k < n; ++k) {
        const bool is_torn = i == 0 && (names[i].ends_with(names_[k]) || names_[k].ends_with(names[i]));
        const bool fits = !is_given[k] && (names[i] == names_[k] || is_torn);
        if (fits && (out[i] == n || k == i)) out[i] = k;
      }
      if (out[i] == n) return {};
      is_given[out[i]] = true;
    }
    return out;
  }

  std::vector<double> in_own_order(const std::vector<double>& numbers) const {
    if (places_.empty()) return numbers;
    std::vector<double> out(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) out[places_[i]] = numbers[i];
    return out;
  }

  // Whether a row of so many numbers is of the other header that came last.
  bool is_anothers(std::size_t count) {
    if (other_.empty()) return false;
    if (count == other_.size()) {
      refusal_ = fmt::format("another glove speaks: its columns are {}, and they were {}",
                             fmt::join(other_, ","), fmt::join(names_, ","));
    }
    other_.clear();
    return !refusal_.empty();
  }

  // Without a header nobody knows which is a clock: none is taken for one. The first line may be half a one: two must
  // agree.
  bool take_names(std::size_t count) {
    if (std::exchange(count_before_, count) != count) return false;
    for (std::size_t i = 0; i < count; ++i) names_.push_back(fmt::format("column{}", i + 1));
    columns_ = names_;
    return true;
  }

  bool is_time(const std::string& column) {
    const recording::NameAndUnit cut = recording::cut_name(column);
    if (cut.name == "millis" || cut.name == "micros") {
      unit_s_ = cut.name == "millis" ? 1e-3 : 1e-6;
      return true;
    }
    if (cut.name != "t" && cut.name != "time" && cut.name != "timestamp") return false;
    unit_s_ = recording::seconds_in(cut.unit).value_or(1);
    return true;
  }

  char separator_ = 0;
  std::vector<std::string> names_;
  std::size_t count_before_ = 0;
  std::optional<std::size_t> time_;
  bool has_header_ = false;
  bool is_fresh_ = false;            // plugged in, and no row came yet
  std::vector<std::size_t> places_;  // of a row's cells, in names_; empty: in their order
  std::vector<std::string> other_;   // a header with other names; no row came yet
  std::string refusal_;
  double unit_s_ = 1;
};

}  // namespace

std::string lost_in_words(const Tally& tally) {
  return tally.lost ? fmt::format("{} lost", *tally.lost) : "not known how many were lost";
}

std::string misfit_in_words(const Misfit& misfit) {
  if (misfit.found == 0)
    return fmt::format("the lines that come are no rows of numbers, and {} values are expected",
                       misfit.expected);
  return fmt::format("the rows that come have {} values, and {} are expected", misfit.found, misfit.expected);
}

const char* name_of(Format format) {
  switch (format) {
    case Format::frames:
      return "Flexor's frames";
    case Format::hand:
      return "a hand's telemetry";
    case Format::gloves:
      return "text for VR drivers";
    case Format::lines:
      break;
  }
  return "lines of numbers";
}

std::unique_ptr<Decoder> make_decoder(Format format, bool readings) {
  switch (format) {
    case Format::frames:
      return std::make_unique<GloveFrames>(readings);
    case Format::hand:
      return std::make_unique<HandFrames>();
    case Format::gloves:
      return std::make_unique<GlovesDecoder>();
    case Format::lines:
      break;
  }
  return std::make_unique<LineDecoder>();
}

}  // namespace flexor::listen
