// What a deployment consists of, and the settings of both boards: integers only, all computed here in double.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/deploy/mcu.hpp"
#include "host/model/glove_tables.hpp"
#include "host/model/hardware.hpp"
#include "host/model/host_chain.hpp"
#include "host/model/model.hpp"
#include "host/model/wiring.hpp"
#include "runtime/compensator/graph.hpp"
#include "runtime/glove/settings.hpp"
#include "runtime/hand/settings.hpp"
#include "runtime/link/glove_turns.hpp"
#include "runtime/link/messages.hpp"

namespace flexor::deploy {

inline constexpr int kFingers = link::kFingers;
inline constexpr double kClock_hz = 16e6;
inline constexpr double kUsbBaud = 115200;
inline constexpr double kLeastBaudWithKey = 4800;  // of the radio

using Key = std::optional<link::Key>;  // none: plain frames

using glove::Output;
inline const std::map<std::string, Output> kOutputs = {{"radio", Output::radio},
                                                       {"opengloves", Output::opengloves},
                                                       {"text", Output::text},
                                                       {"log", Output::log}};
using model::Pins;
// Of the text for VR drivers: a number for each finger; or the model's other joints as well, which a driver
// from 0.5 on reads.
enum class Encoding { alpha, beta };

// ADC counts -> the model's input, monotonic over 0 .. 1023, straight between points and beyond; where it has no value, any
// that the model refuses.
struct Sensor {
  std::vector<double> counts;  // strictly increasing, two at least
  std::vector<double> value;
  double operator()(double counts) const;
};

// What `reads` gives at every knot of a board's table.
Sensor at_knots(const std::function<double(double counts)>& reads);
// R1 = flat + k theta in a divider with R2 = fixed, both 10 bits full scale: eqs. 1 to 3 of Sensors 2019,
// 19(18), 3896.
Sensor divider(double fixed_kohm, double flat_kohm, double kohm_per_deg);
// The model's input is that divider's alpha: unit "deg", of a column that ends in _alpha.
bool reads_alpha(const model::Input& input);
Sensor counts_as_they_are();

struct Glove {
  model::Model model;  // its sample period is the glove's
  std::array<Sensor, kFingers> sensor;
  Output output = Output::radio;
  double baud = 9600;        // of the radio; USB always has kUsbBaud
  double frame_rate_hz = 0;  // 0: as many as the radio carries, at most one for each sample
  Key key;
  Pins pins;
  Encoding encoding = Encoding::alpha;  // with output opengloves
  bool right_hand = true;               // likewise
  bool track = false;                   // sensors are followed while the glove is worn
};

// By how much a motor may differ from its HandMotor without a fault, and within the bound on its speed.
inline constexpr double kMotorSpeedShare = 0.15;
inline constexpr double kMotorFrictionShare = 0.4;

// What is known of the motors, behind their gears; duties as shares of the supply. The hand's protection lives on
// it (runtime/hand/motor_watch.hpp): with full_speed_deg_s 0 there is none.
struct HandMotor {
  double full_speed_deg_s = 0;  // at the whole supply, without friction
  double time_s = 0;            // until 63 % of it
  double friction = 0;          // the duty that dry friction takes
  double load = 0;              // the duty that the greatest load takes, besides
};

// Degrees, degrees a second, and duties as shares of the supply.
struct Hand {
  model::Hardware hardware;                  // its loop, potentiometers and radio
  std::array<double, kFingers> lower_deg{};  // of the command
  std::array<double, kFingers> upper_deg{};
  std::array<double, kFingers> rest_deg{};
  double careful_deg_s = 150;
  double reach_deg = 1e9;  // a reading further outside of the limits is none
  HandMotor motor;
  Key key;
};

// Everything below throws io::InputError, one line with the figure and the mend.

// Of 10, 20, 50 and 100 Hz.
int sample_rate_hz(const model::Model& model);

// How many samples make a frame, such that the radio carries the frames.
int samples_per_frame(const Glove& glove);

// Its button `calibrate` zeroes it: an open hand and a fist against the poses of the model. In VR that button is the
// driver's.
bool can_zero(const Glove& glove);

// Throws io::InputError where `track` asks for what there is not: poses, a model that is compiled.
void check_tracking(const Glove& glove);

// The radio carries one direction at a time: after every `every`-th frame, twice a second, the glove leaves out
// `slots` more, so that the hand's longest frame has room; after every `seek_every`-th while it receives nothing of
// the hand.
link::Turns turns_of(const Glove& glove);

// UBRR0 at double speed, where the error is at most 2.5 %.
int uart_divisor(double baud);

// What the signal chain on the board gets, for each finger.
using model::GloveTables;
GloveTables glove_tables(const Glove& glove);

// What leaves the glove: each finger's joint and, in text for VR drivers of encoding beta, the model's further joints that
// end in _mcp, _pip, _dip, of the thumb in _cmc, _mcp, _ip.
struct BoardOutput {
  std::size_t joint;  // of the model
  compensator::Output output;
};
std::vector<BoardOutput> outputs_of(const Glove& glove);

// Of the chain that computes what the board sends.
model::ChainParts chain_parts(const Glove& glove);

// Bytes of the longest line.
int line_bytes(const Glove& glove);

// Largest |fixed point - double| of any joint, degrees, both given the same inputs.
struct Error {
  double range_deg = 0;                 // the worst that a search over all valid inputs finds
  std::optional<double> recording_deg;  // over what was given
  double worst_deg() const { return std::max(range_deg, recording_deg.value_or(0)); }
};

// recording: readings of the model's inputs, a row for each sample; empty: none. Throws io::InputError when the error
// exceeds what model::allowed_fixed_error_deg allows a joint.
Error fixed_point_error(const model::Model& model, const std::vector<std::vector<double>>& recording);

// What the boards' images are given.
glove::Settings glove_settings(const Glove& glove);
hand::Settings hand_settings(const Hand& hand);

}  // namespace flexor::deploy
