// A table of sensed angles to a table of all 23 joints, row for row, whatever its clock does; malformed rows are left out.
//
// Inputs: columns NAME_deg of joints (`from`), and sums of joints (`bends`), "index=index_mcp+index_pip": its
// column is index_deg where the table has one, else the sum of its joints' columns, of which then only the sum is used.
//
// The first `rest_s` seconds show the person: every NAME_deg that the table has is read there, later only the
// inputs. The hand rests first; what it does after that within these seconds is learnt as it is seen.
//
// Flexion of fingers is negative, as in a posture document, or positive, as flexor apply writes it: then MCP, PIP, IP and DIP have
// the other sign in the table and in what is written. Its bends show whether the table has the sign that is stated.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "host/posture/complete.hpp"
#include "host/recording/csv.hpp"

namespace flexor::posture {

struct CompleteOptions {
  std::vector<std::string> from;
  std::vector<std::string> bends;
  double rest_s = 0;
  bool flexion_is_positive = false;
  // Of columns by name, without the unit: angles at the open hand and at the fist. Where there are any, every input's column
  // is one of them, and its angles become positive flexion, 0 at the open hand.
  std::map<std::string, std::pair<double, double>> ends_deg = {};
};

struct Completion {
  std::size_t rows = 0;
  struct OfInput {
    std::string name;
    std::array<std::size_t, kQualities> rows{};  // by Quality
    std::size_t extended = 0;  // rows that read further extended than a straight finger does
  };
  std::vector<OfInput> inputs;
  std::vector<std::string> extended;  // inputs that mostly do: has the table the other sign?
  double shown_s = 0;
  bool rest_ended = false;  // a row came after it
  std::size_t shown_joints = 0;
  Hand mean_se_deg = Hand::Zero();
  Shape shape;
  double left_out_rmse_deg = 0;    // of the posture's people, each from the others
  std::vector<std::string> notes;  // of the table
};

// Writes a header and a row for each of the table's through `sink`. Throws io::InputError.
Completion complete_table(const Posture& posture, recording::LogReader& table, const CompleteOptions& options,
                          const std::function<void(const std::string&)>& sink,
                          const std::function<void(std::size_t rows)>& progress);

}  // namespace flexor::posture
