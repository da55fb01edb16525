// A model and a hand as C++ that the firmware includes: integers only, all computed here in double.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/deploy/mcu.hpp"
#include "host/deploy/pins.hpp"
#include "host/model/glove_tables.hpp"
#include "host/model/host_chain.hpp"
#include "host/model/model.hpp"
#include "host/model/wiring.hpp"
#include "runtime/glove/follower.hpp"
#include "runtime/hand/finger.hpp"
#include "runtime/link/messages.hpp"

namespace flexor::deploy {

inline constexpr int kFingers = link::kFingers;
inline constexpr double kClock_hz = 16e6;
inline constexpr double kUsbBaud = 115200;
inline constexpr double kLeastBaudWithKey = 4800;  // of the radio

using Key = std::optional<link::Key>;  // none: plain frames

enum class Output { radio, opengloves };
// Of the text for VR drivers: a number for each finger; or the model's other joints as well, which a driver
// from 0.5 on reads.
enum class Encoding { alpha, beta };

enum class ModelAs { code, data };  // compiled, or bytes that an interpreter runs and that can be replaced

// ADC counts -> the model's input, monotonic over 0 .. 1023, straight between points and beyond; where it has no value, any
// that the model refuses.
struct Sensor {
  std::vector<double> counts;  // strictly increasing, two at least
  std::vector<double> value;
  double operator()(double counts) const;
};

// What `reads` says at every knot of a board's table.
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
  ModelAs model_as = ModelAs::code;
  bool in_flash =
      false;  // a model that is data lies in flash also where EEPROM has room: larger ones can follow it
  bool track = false;    // strips are followed while the glove is worn
  bool assembly = true;  // products as the microcontroller has them; the same bits
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
  std::array<double, kFingers> lower_deg{};  // of the command
  std::array<double, kFingers> upper_deg{};
  std::array<double, kFingers> rest_deg{};
  double potentiometer_range_deg = 250;
  double proportional_per_deg = 0.05;
  double integral_per_deg_s = 0.28;
  double integral_limit = 0.25;
  double feed_forward_s_per_deg = 0;
  double speed_deg_s = 400;
  double careful_deg_s = 150;
  double duty = 1;
  double reach_deg = 1e9;  // a reading further outside of the limits is none
  HandMotor motor;
  double baud = 9600;
  Key key;
};

// Away from the joints' ends, which its limits are, and at bounded effort and speed, whatever it asks for.
Hand within_safe_limits(Hand hand);

// Everything below throws io::InputError, one line with the figure and the mend.

// Of 10, 20, 50 and 100 Hz.
int sample_rate_hz(const model::Model& model);

// How many samples make a frame, such that the radio carries the frames.
int samples_per_frame(const Glove& glove);

// Its button `calibrate` zeroes it: an open hand and a fist against the poses of the model. In VR that button is the
// driver's.
bool can_zero(const Glove& glove);

// What the tracker of each strip gets; without `track`, and for strips without poses, none is tracked.
std::array<glove::TrackedStrip, kFingers> tracked_strips(const Glove& glove);

// Throws io::InputError where `track` asks for what there is not: poses, a model that is compiled.
void check_tracking(const Glove& glove);

// The radio carries one direction at a time: after every `every`-th frame, twice a second, the glove leaves out
// `slots` more, so that the hand's longest frame has room; after every `seek_every`-th while it does not hear
// the hand.
struct Turns {
  int every;
  int seek_every;
  int slots;
};
Turns turns_of(const Glove& glove);

// UBRR0 at double speed, where the error is at most 2.5 %.
int uart_divisor(double baud);

// What the signal chain on the board gets, for each finger.
using model::GloveTables;
GloveTables glove_tables(const Glove& glove);

// A bit for each finger that a joint of the model moves, thumb first; names of those that none does.
std::uint8_t fingers_there(const model::Model& model);
std::vector<std::string> missing_fingers(const model::Model& model);

// The joints that the text for VR drivers names beside the fingers: those of the model that end in _mcp, _pip,
// _dip, of the thumb in _cmc, _mcp, _ip, and are not their finger's own. None with encoding alpha.
struct VrJoint {
  std::size_t joint;  // of the model
  glove::JointSettings settings;
};
std::vector<VrJoint> vr_joints(const Glove& glove);

// Of the chain that says what the board sends.
model::ChainParts chain_parts(const Glove& glove);

// Bytes of the longest line for VR drivers.
int line_bytes(const Glove& glove);

hand::FingerSettings finger_settings(const Hand& hand, int finger);

// The line of both configurations that holds the key's record.
std::string key_text(const Key& key);

// Texts of glove_config.hpp and hand_config.hpp.
std::string glove_config(const Glove& glove);
std::string hand_config(const Hand& hand);

}  // namespace flexor::deploy
