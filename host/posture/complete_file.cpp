#include "host/posture/complete_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/io/io.hpp"

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

  std::size_t place(const std::string& column) {
    const auto it = std::ranges::find(columns, column);
    if (it != columns.end()) return static_cast<std::size_t>(it - columns.begin());
    columns.push_back(column);
    return columns.size() - 1;
  }
};

void add_bend(Plan& plan, const Input& bend, const TableReader& table) {
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

Plan plan_of(const CompleteOptions& options, const TableReader& table) {
  Plan plan;
  std::vector<Input> bends;
  for (const std::string& text : options.bends) bends.push_back(bend_of(text));
  for (const Input& bend : bends) add_bend(plan, bend, table);
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

std::string text_of(const std::string& time, const Estimate& estimate) {
  fmt::memory_buffer out;
  fmt::format_to(std::back_inserter(out), "{}", time);
  for (int j = 0; j < kJoints; ++j) {
    fmt::format_to(std::back_inserter(out), ",{:.3f},{:.3f}", estimate.angle_deg[j], estimate.se_deg[j]);
  }
  for (const Quality quality : estimate.quality) {
    fmt::format_to(std::back_inserter(out), ",{}", static_cast<int>(quality));
  }
  out.push_back('\n');
  return fmt::to_string(out);
}

Eigen::VectorXd readings_of(const Plan& plan, const TableRow& row) {
  Eigen::VectorXd readings = Eigen::VectorXd::Zero(static_cast<Index>(plan.parts.size()));
  for (std::size_t i = 0; i < plan.parts.size(); ++i) {
    for (const std::size_t part : plan.parts[i]) readings[static_cast<Index>(i)] += row.value[part];
  }
  return readings;
}

// Empty where a shown joint is missing in this row.
std::optional<Hand> shown_hand(const Plan& plan, const TableRow& row) {
  Hand hand = Hand::Constant(std::numeric_limits<double>::quiet_NaN());
  for (const auto& [joint, column] : plan.shown) {
    if (std::isnan(row.value[column])) return std::nullopt;
    hand[joint] = row.value[column];
  }
  return hand;
}

void count(const Estimate& estimate, Completion& completion) {
  ++completion.rows;
  completion.mean_se_deg += estimate.se_deg;
  for (std::size_t i = 0; i < estimate.quality.size(); ++i) {
    ++completion.quality[i][static_cast<std::size_t>(estimate.quality[i])];
  }
}

}  // namespace

Completion complete_table(const Posture& posture, TableReader& table, const CompleteOptions& options,
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
  double elapsed_s = 0;
  double last_s = 0;
  for (TableRow row; table.next(row); last_s = row.t_s) {
    const double step = completion.rows > 0 ? step_s(last_s, row.t_s) : 0;
    elapsed_s += step;
    if (elapsed_s < options.rest_s) {
      completion.shown_s = elapsed_s;
      if (const auto hand = shown_hand(plan, row)) completer.show(*hand, step);
    }
    const Estimate estimate = completer.complete(readings_of(plan, row));
    count(estimate, completion);
    sink(text_of(row.time, estimate));
    progress(completion.rows);
  }
  if (completion.rows == 0) throw io::InputError(fmt::format("{}: no row below the header", table.source()));
  completion.mean_se_deg /= static_cast<double>(completion.rows);
  completion.shape = completer.shape();
  completion.left_out_rmse_deg = completer.left_out_rmse_deg();
  return completion;
}

}  // namespace flexor::posture
