// A glove's log and the angle that a camera saw, on one clock and on the grid of a compensator.
//
// The sensor is sampled as `apply` samples it: from the log's first row, with nothing but past readings. The measured angle is no
// input of the compensator: it is the straight line between its neighbours at each of these instants.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/recording/align.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/recording.hpp"
#include "host/recording/resample.hpp"
#include "host/recording/time.hpp"

namespace flexor::recording {

struct Pair {
  Recording sensor;
  std::string input;  // column
  Recording reference;
  std::string output;  // column, degrees
};

// The greatest count of a converter that reads as much: of 10 bits, 12, 14 ...
double adc_top(double greatest);

// Between its ends, which say that nothing is plugged in; an end is a reading where ordinary steps lead to it.
Range counts_that_tell(std::span<const double> value, double top);

// What stands beside NAME_deg where its angle is not known: NAME_quality or NAME_status, from this value on.
struct Unknown {
  const char* ending;
  double from;
  const char* why;
};
inline constexpr std::array<Unknown, 2> kUnknown = {
    {{"_quality", 3, "lost by the camera"}, {"_status", 1, "held by the model"}}};

// Takes out the rows whose angle is not known, and that column. Says how many rows. Throws io::JobError when fewer than two are left.
void leave_out_lost(Recording& recording, const std::string& column);

// One column alone, in the rows that have a reading of it. Throws io::JobError where these are fewer than two.
Recording without_holes(const Recording& recording, const std::string& column);

// Takes out the rows whose angle is a spike (resample.hpp, without_spikes), and says so.
void leave_out_spikes(Recording& recording, const std::string& column);

// Where a sensor's reading does not change at all while the angle moves on by a quarter of its range, the longest such stretch of
// three seconds or more; not at an end of its range, where it is clipped. `offset_s`: of the angle's clock from the reading's.
struct Still {
  double begin_s = 0;
  double end_s = 0;
};
std::optional<Still> frozen(const Series& reading, const Series& angle, double offset_s);
std::string in_words(const Still& still);

// Takes out the rows in which an angle stands so while the sensor moves, at whatever value: trackers repeat the last one, or write 0.
// Says so; false where there are none. Throws io::JobError where hardly any is left.
bool leave_out_frozen(Recording& angle, const std::string& column, const Series& reading,
                      double clock_offset_s, std::vector<std::string>& warnings);

// One column of a file of measured angles, of each trial in it (csv.hpp), without what its tracker lost and without spikes.
// Throws io::InputError and io::JobError.
std::vector<Recording> angle_segments(const Log& log, const std::string& column, const TimeOptions& time);
Recording read_angle(const Log& log, const std::string& column, const TimeOptions& time);

// Degrees, whatever the column says; `stated` is the user's word where it has none. Says what it converted. An angle that wraps at
// the end of a turn goes on from there. Throws io::InputError for a unit that is no angle's, or a word against the column's.
void to_degrees(Recording& recording, const std::string& column, const std::string& stated);

// The unit of a sensor's column: what its name says, or else `stated`, the user's word; both may be empty. Throws
// io::InputError for a unit that is none, or a word against the column's.
void state_unit(Recording& recording, const std::string& column, const std::string& stated);

// A column of degrees or radians that jumps by a turn at the end of one goes on; its middle is then within half a turn of where it
// jumps. Missing values stay.
void unwrap(Recording& recording, const std::string& column);

// Throws io::InputError for what is no rate, no offset between two clocks, or no lead.
void check_clock(double rate_hz, std::optional<double> clock_offset_s, double lead_s);

struct Aligned {
  std::optional<Alignment>
      alignment;              // none: the offset was given and the signals do not tell; without its drift
  double clock_offset_s = 0;  // used: the user's, or the signals'. Reference time minus sensor time
  double period_s = 0;
  double max_gap_s = 0;  // of the sensor: an older reading is a pause
  Range valid;           // readings of the sensor that mean something
  // On the sensor's clock, from its first row to the end of what both saw.
  std::vector<double> t_s;
  std::vector<double> input;
  std::vector<double> angle_deg;
  std::vector<std::uint8_t> gap;           // a pause of either log; 1 before overlap_begin
  std::vector<std::uint8_t> unseen;        // of these, a pause of the reference: the angle is guessed
  std::size_t overlap_begin = 0;           // first sample that the reference saw
  std::size_t holdout_begin = 0;           // first sample of the part that is held out
  std::optional<std::size_t> holdout_end;  // none: all that follows is
  std::vector<std::string> warnings;

  std::size_t size() const { return t_s.size(); }
  std::size_t held_end() const { return holdout_end.value_or(size()); }
};

// Of the whole overlap. Throws io::InputError and io::JobError.
Aligned align_pair(Pair pair, double rate_hz, std::optional<double> clock_offset_s);

// The samples of a pair whose clock offset is known; fills in all but the alignment.
// lead_s: the angle is the one so far ahead; a compensator that is fitted to it predicts. 0 to 1.
// split: the share of the overlap, from its start, that a fit sees. What counts as a pause and as a reading is learnt from the
// rows of that part alone: counts_that_tell, or in any other unit what was read and a quarter of that range on
// either side. Throws io::InputError and io::JobError.
void sample_pair(const Pair& pair, double rate_hz, double clock_offset_s, double lead_s, double split,
                 Aligned& out);

// What both saw: t_s, input, output and gap columns, for wide CSV.
Recording to_recording(const Aligned& aligned, const Pair& pair);

// The fitted and the held-out readings of one recording.
struct Halves {
  std::span<const double> fitted;
  std::span<const double> held;
};

// What was found, without the samples.
nlohmann::ordered_json to_json(const Aligned& aligned);

// How many held-out readings the fitted parts of all recordings did not reach; none: as good as all are within.
std::optional<std::string> beyond_fitted(const std::vector<Halves>& recordings);

}  // namespace flexor::recording
