// Bytes from a glove or a hand, as they come, to samples.
//
// frames  a glove's frames of joint angles or of readings (runtime/link/PROTOCOL.md); tags are not checked: a PC that
//         listens moves nothing
// hand    a hand's telemetry: of each finger its angle, the motor's duty in percent of the supply, positive to flex, and
//         its fault; and the board's faults, as bits (runtime/hand/README.md)
// lines   as host/recording/table.hpp has them; units below a header become a part of the names. A header with other names is another
//         glove's, of which nothing is taken
// gloves  lines of text for VR drivers, alpha and beta encodings (runtime/link/opengloves.hpp)
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace flexor::listen {

enum class Format { frames, hand, gloves, lines };
const char* name_of(Format format);

struct Sample {
  double host_s = 0;                // when its last byte came, monotonic
  std::optional<double> board_s;    // by the board's own clock, if it sends one
  std::vector<double> value;        // in the order of the columns; NaN: nothing was read
  std::vector<std::string> remark;  // of each value what is wrong, or ""; empty: the format has none
};

// Whole rows of another number of values than the first had.
struct Misfit {
  std::size_t found = 0;
  std::size_t expected = 0;
};

// All since the start.
struct Tally {
  std::uint64_t bytes = 0;
  std::uint64_t understood = 0;  // bytes of whole frames and lines
  std::uint64_t samples = 0;
  std::uint64_t malformed = 0;        // frames and lines that were no whole ones
  std::uint64_t malformed_since = 0;  // the newest sample
  std::string malformed_line = {};    // the newest of them; frames have none
  std::uint64_t late = 0;             // frames that came twice, or after one that was sent later: no samples
  std::optional<std::uint64_t> lost = {};  // samples, by the gaps in their counter; none: they have none
  std::optional<Misfit> misfit = {};  // of the newest rows: two alike, one may be malformed; none: they fit
};
// "2 lost", with ", 1 twice or late" where there are such.
std::string lost_in_words(const Tally& tally);
std::string misfit_in_words(const Misfit& misfit);  // "the rows that come have 3 values, and 5 are expected"

class Decoder {
 public:
  virtual ~Decoder() = default;
  // Appends what becomes whole with these bytes, which came at `host_s`, to `out`.
  virtual void push(std::span<const std::uint8_t> bytes, double host_s, std::vector<Sample>& out) = 0;
  // The port has gone: what is half is dropped and counted as malformed. What comes next may begin in mid-line: until the line's
  // end it is no sample.
  virtual void cut() = 0;
  // Names with units; the same for good from the first sample on.
  const std::vector<std::string>& columns() const { return columns_; }
  const Tally& tally() const { return tally_; }
  // What is to be known of the samples, as they come now; "": nothing.
  virtual std::string remark() const { return {}; }
  virtual bool is_for_drivers() const { return false; }  // what comes is text for VR drivers
  // Why nothing is taken any more, in a line; "": it is.
  virtual std::string refusal() const { return {}; }

 protected:
  void count_sample() {
    ++tally_.samples;
    tally_.malformed_since = 0;
    tally_.misfit.reset();
    other_values_.reset();
  }
  void count_malformed(std::string_view line = {}) {
    ++tally_.malformed;
    ++tally_.malformed_since;
    tally_.malformed_line = line;
  }
  void count_misfit(std::size_t found, std::size_t expected) {
    if (std::exchange(other_values_, found) == found) tally_.misfit = Misfit{found, expected};
  }

  std::vector<std::string> columns_;
  Tally tally_;

 private:
  std::optional<std::size_t> other_values_;  // of the row before; none: it fits
};

// `readings`: of frames, those with readings instead of those with angles.
std::unique_ptr<Decoder> make_decoder(Format format, bool readings = false);

struct Guess {
  Format format;
  bool readings;  // of frames: the samples are readings
  double share;   // of the bytes that are in whole frames or lines
  // 0: frames, but no samples: a glove that waits for its hand, or a hand for its glove.
  std::uint64_t samples;
};

// The format that most of the bytes are in; none where that is less than half of them, or fewer than three samples (one
// of a hand, which speaks twice a second) or two frames of other kinds. `readings`: of a glove that gives them they are the
// samples, instead of angles.
std::optional<Guess> guess(std::span<const std::uint8_t> bytes, bool readings = false);

}  // namespace flexor::listen
