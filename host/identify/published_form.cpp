#include "host/identify/published_form.hpp"

#include <Eigen/Core>

#include "host/identify/fit.hpp"
#include "host/identify/structure_text.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// One row for each sample of all pairs.
struct Rows {
  VectorXd input;
  VectorXd angle;
  std::vector<Index> fitted;
  std::vector<Index> held_out;
  double period_s = 0;

  explicit Rows(const std::vector<const recording::Aligned*>& pairs) : period_s(pairs.front()->period_s) {
    std::vector<double> u;
    std::vector<double> y;
    for (const recording::Aligned* a : pairs) {
      const auto at = std::ssize(u);
      u.insert(u.end(), a->input.begin(), a->input.end());
      y.insert(y.end(), a->angle_deg.begin(), a->angle_deg.end());
      for (std::size_t k = 0; k < a->size(); ++k) {
        const auto row = at + static_cast<Index>(k);
        if (k >= a->holdout_begin) held_out.push_back(row);
        if (k < a->holdout_begin && !a->gap[k]) fitted.push_back(row);
      }
    }
    input = Eigen::Map<const VectorXd>(u.data(), std::ssize(u));
    angle = Eigen::Map<const VectorXd>(y.data(), std::ssize(y));
  }
};

}  // namespace

PublishedForm published_form(const std::vector<const recording::Aligned*>& pairs) {
  const Rows rows(pairs);
  Data data;
  data.channel = "published form";
  data.period_s = rows.period_s;
  data.input = rows.input;
  data.angle_deg = rows.angle;
  data.use.resize(static_cast<std::size_t>(rows.input.size()), 0);
  for (const Index k : rows.fitted) data.use[static_cast<std::size_t>(k)] = 1;
  try {
    const VectorXd part = fit(blocks_of(kPublishedForm), data).predicted_deg(rows.held_out);
    return {{part.begin(), part.end()}, ""};
  } catch (const io::JobError& error) {
    return {{}, error.what()};
  }
}

}  // namespace flexor::identify
