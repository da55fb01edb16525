#include "host/posture/complete_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "host/io/io.hpp"
#include "host/recording/stream.hpp"

namespace flexor::posture {
namespace {

using Eigen::Index;

constexpr std::string_view kUnit = "_deg";

std::string column_of(std::string_view name) { return fmt::format("{}{}", name, kUnit); }

std::string without_unit(const std::string& column) {
  return column.ends_with(kUnit) ? column.substr(0, column.size() - kUnit.size()) : column;
}

int joint_of(const std::string& name, const std::string& where) {
  const auto joint = find_joint(name);
  if (joint) return *joint;
  throw io::InputError(
      fmt::format("{}: \"{}\" is no joint; joints are: {}", where, name, fmt::join(kJointNames, ", ")));
}

Input bend_of(const std::string& text) {
  const std::string where = fmt::format("--bends {}", text);
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw io::InputError(fmt::format("{}: write NAME=JOINT+JOINT, as index=index_mcp+index_pip", where));
  }
  Input bend{text.substr(0, equals), {}};
  for (std::size_t begin = equals + 1; begin <= text.size();) {
    const std::size_t end = std::min(text.find('+', begin), text.size());
    bend.joints.push_back(joint_of(without_unit(text.substr(begin, end - begin)), where));
    begin = end + 1;
  }
  std::ranges::sort(bend.joints);
  if (std::ranges::adjacent_find(bend.joints) != bend.joints.end()) {
    throw io::InputError(fmt::format("{}: a joint twice; a strip bends over it once", where));
  }
  return bend;
}

// What is read, and from which of the table's columns each input is the sum.
struct Plan {
  std::vector<Input> inputs;
  std::vector<std::vector<std::size_t>> parts;
  std::vector<std::string> columns;
  std::vector<std::pair<int, std::size_t>> shown;  // joint and its column
  Hand sign = Hand::Ones();                        // of the table's angles, against the document's

  std::size_t place(const std::string& column) {
    const auto it = std::ranges::find(columns, column);
    if (it != columns.end()) return static_cast<std::size_t>(it - columns.begin());
    columns.push_back(column);
    return columns.size() - 1;
  }
};

// Joints whose flexion has a sign: MCP, PIP, DIP and the thumb's IP.
bool flexes(int joint) {
  const std::string_view name = kJointNames[static_cast<std::size_t>(joint)];
  return name.ends_with("_mcp") || name.ends_with("_pip") || name.ends_with("_dip") || name.ends_with("_ip");
}

double sign_of(const Plan& plan, const Input& input) { return plan.sign[input.joints.front()]; }

void require_one_sign(const Plan& plan, const Input& bend) {
  for (const int joint : bend.joints) {
    if (plan.sign[joint] == sign_of(plan, bend)) continue;
    throw io::InputError(
        fmt::format("--bends {}: with --flexion positive only joints that flex can be summed", bend.name));
  }
}

// A bend is sensed where --from names it, or the columns of all of its joints.
void require_named(const Input& bend, const CompleteOptions& options) {
  const auto named = [&](std::string_view name) {
    return std::ranges::any_of(options.from, [&](const std::string& c) { return without_unit(c) == name; });
  };
  if (named(bend.name)) return;
  for (const int joint : bend.joints) {
    const std::string_view name = kJointNames[static_cast<std::size_t>(joint)];
    if (named(name)) continue;
    throw io::InputError(
        fmt::format("--bends {0}: --from names neither {0}_deg nor {1}_deg: name the bend, or all of its "
                    "joints' columns",
                    bend.name, name));
  }
}

void add_bend(Plan& plan, const Input& bend, const recording::CsvReader& table) {
  std::vector<std::size_t> parts;
  if (table.has(column_of(bend.name)) && !find_joint(bend.name)) {
    parts.push_back(plan.place(column_of(bend.name)));
  } else {
    for (const int joint : bend.joints) {
      parts.push_back(plan.place(column_of(kJointNames[static_cast<std::size_t>(joint)])));
    }
  }
  plan.inputs.push_back(bend);
  plan.parts.push_back(parts);
}

Plan plan_of(const CompleteOptions& options, const recording::CsvReader& table) {
  Plan plan;
  std::vector<Input> bends;
  for (int joint = 0; joint < kJoints; ++joint) {
    if (options.flexion_is_positive && flexes(joint)) plan.sign[joint] = -1;
  }
  for (const std::string& text : options.bends) bends.push_back(bend_of(text));
  for (const Input& bend : bends) {
    require_named(bend, options);
    require_one_sign(plan, bend);
    add_bend(plan, bend, table);
  }
  for (const std::string& column : options.from) {
    const std::string name = without_unit(column);
    if (std::ranges::count(bends, name, &Input::name) > 0) continue;
    const int joint = joint_of(name, "--from");
    const bool in_bend = std::ranges::any_of(
        bends, [&](const Input& bend) { return std::ranges::count(bend.joints, joint) > 0; });
    if (in_bend) continue;
    plan.inputs.push_back({name, {joint}});
    plan.parts.push_back({plan.place(column_of(name))});
  }
  if (options.rest_s <= 0) return plan;
  for (int joint = 0; joint < kJoints; ++joint) {
    const std::string column = column_of(kJointNames[static_cast<std::size_t>(joint)]);
    if (table.has(column)) plan.shown.emplace_back(joint, plan.place(column));
  }
  return plan;
}

std::string header_of(const Plan& plan) {
  std::string text = "t_s";
  for (const std::string_view name : kJointNames) text += fmt::format(",{0}_deg,{0}_se_deg", name);
  for (const Input& input : plan.inputs) text += fmt::format(",{}_quality", input.name);
  return text + "\n";
}

std::string text_of(const Plan& plan, double t_s, const Estimate& estimate) {
  fmt::memory_buffer out;
  fmt::format_to(std::back_inserter(out), "{}", t_s);
  for (int j = 0; j < kJoints; ++j) {
    fmt::format_to(std::back_inserter(out), ",{:.3f},{:.3f}", plan.sign[j] * estimate.angle_deg[j],
                   estimate.se_deg[j]);
  }
  for (const Quality quality : estimate.quality) {
    fmt::format_to(std::back_inserter(out), ",{}", static_cast<int>(quality));
  }
  out.push_back('\n');
  return fmt::to_string(out);
}

Eigen::VectorXd readings_of(const Plan& plan, const recording::Row& row) {
  Eigen::VectorXd readings = Eigen::VectorXd::Zero(static_cast<Index>(plan.parts.size()));
  for (std::size_t i = 0; i < plan.parts.size(); ++i) {
    for (const std::size_t part : plan.parts[i])
      readings[static_cast<Index>(i)] += sign_of(plan, plan.inputs[i]) * row.value[part];
  }
  return readings;
}

// Empty where a shown joint is missing in this row.
std::optional<Hand> shown_hand(const Plan& plan, const recording::Row& row) {
  Hand hand = Hand::Constant(std::numeric_limits<double>::quiet_NaN());
  for (const auto& [joint, column] : plan.shown) {
    if (std::isnan(row.value[column])) return std::nullopt;
    hand[joint] = plan.sign[joint] * row.value[column];
  }
  return hand;
}

// Of each shown joint the middle one of three rows, so that a single wrong angle shows nothing. None of the first two.
class MiddleOfThree {
 public:
  std::optional<Hand> of(const Hand& hand) {
    last_.push_back(hand);
    if (last_.size() < 3) return std::nullopt;
    const Hand low = last_[0].min(last_[1]);
    const Hand high = last_[0].max(last_[1]);
    last_.pop_front();
    return hand.max(low).min(high);
  }

 private:
  std::deque<Hand> last_;
};

// Rows of each input that read further extended than a straight finger does.
class Extended {
 public:
  explicit Extended(std::size_t inputs) : rows_(inputs, 0), known_(inputs, 0) {}

  void add(const Plan& plan, const Eigen::VectorXd& readings) {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const double reading = readings[static_cast<Index>(i)];
      if (!std::ranges::all_of(plan.inputs[i].joints, flexes) || std::isnan(reading)) continue;
      ++known_[i];
      if (reading > kStraight_deg) ++rows_[i];
    }
  }

  std::vector<std::string> names(const Plan& plan) const {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (2 * rows_[i] > known_[i]) out.push_back(plan.inputs[i].name);
    }
    return out;
  }

 private:
  static constexpr double kStraight_deg = 15;
  std::vector<std::size_t> rows_;
  std::vector<std::size_t> known_;
};

void count(const Estimate& estimate, Completion& completion) {
  ++completion.rows;
  completion.mean_se_deg += estimate.se_deg;
  for (std::size_t i = 0; i < estimate.quality.size(); ++i) {
    ++completion.quality[i][static_cast<std::size_t>(estimate.quality[i])];
  }
}

}  // namespace

Completion complete_table(const Posture& posture, recording::CsvReader& table, const CompleteOptions& options,
                          const std::function<void(const std::string&)>& sink,
                          const std::function<void(std::size_t rows)>& progress) {
  Plan plan = plan_of(options, table);
  table.choose(plan.columns);
  Completer completer(posture, plan.inputs, !plan.shown.empty());
  Completion completion;
  for (const Input& input : plan.inputs) completion.inputs.push_back(input.name);
  completion.quality.resize(plan.inputs.size());
  completion.shown_joints = plan.shown.size();
  sink(header_of(plan));
  Extended extended(plan.inputs.size());
  MiddleOfThree shown;
  double elapsed_s = 0;
  double last_s = 0;
  for (recording::Row row; table.next(row); last_s = row.t_s) {
    const double step = completion.rows > 0 ? step_s(last_s, row.t_s) : 0;
    if (completion.rows > 0)
      elapsed_s += step_s(last_s, row.t_s, recording::kJump_s);  // slow tables too, but no jump
    if (elapsed_s < options.rest_s) {
      completion.shown_s = elapsed_s;
      if (const auto hand = shown_hand(plan, row)) {
        if (const auto sound = shown.of(*hand)) completer.show(*sound, step);
      }
    } else {
      completion.rest_ended = true;
    }
    const Eigen::VectorXd readings = readings_of(plan, row);
    const Estimate estimate = completer.complete(readings);
    extended.add(plan, readings);
    count(estimate, completion);
    sink(text_of(plan, row.t_s, estimate));
    progress(completion.rows);
  }
  if (completion.rows == 0) throw io::InputError(fmt::format("{}: no row below the header", table.name()));
  completion.mean_se_deg /= static_cast<double>(completion.rows);
  completion.extended = extended.names(plan);
  completion.shape = completer.shape();
  completion.notes = table.notes();
  completion.left_out_rmse_deg = completer.left_out_rmse_deg();
  return completion;
}

}  // namespace flexor::posture
