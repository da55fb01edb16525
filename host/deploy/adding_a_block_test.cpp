// The test of docs/adding-a-block.md, which adding_a_block_test.sh compiles with the page's kind of block in the list.
#include <gtest/gtest.h>

#include "host/deploy/model_block.hpp"
#include "runtime/compensator/graph.hpp"

namespace flexor::deploy {
namespace {

// One finger at 50 Hz, from a document; `last` is the block's signal.
model::Model with_block(const std::string& block, const std::string& last) {
  const std::string document =
      R"({"schema": "flexor-model", "schema_version": 2, "name": "page", "sample_period_s": 0.02, "inputs": [{"name": "index", "unit": "deg",
      "valid_min": 0, "valid_max": 100}], "blocks": [)" +
      block + R"(, {"type": "saturation", "from": ")" + last +
      R"(", "to": "angle", "lower_deg": 0, "upper_deg": 100}], "joints": [{"name": "index", "from": "angle", "rest_deg": 0}]})";
  return model::from_json(model::to_json(model::from_json(document, "page")), "written");
}

// In degrees: of the host, which the interpreter equals to the bit.
std::vector<double> angles_of(const model::Model& model, const std::vector<double>& readings) {
  Glove glove;
  glove.model = model;
  glove.sensor.fill(counts_as_they_are());
  const Bytes part = model_block(glove).bytes;
  const auto ids = calibration_ids(glove_tables(glove));
  compensator::Graph<core::Ram, 600> graph;
  EXPECT_EQ(graph.add(part.data(), static_cast<std::uint16_t>(part.size()), {ids.data(), 50}),
            compensator::Loaded::ok);
  model::HostCompensator host(model);
  std::vector<double> out;
  for (const double reading : readings) {
    host.alpha[1] = graph.alpha[1] = static_cast<std::int16_t>(32 * reading);
    EXPECT_EQ(host.step(), graph.step());
    EXPECT_EQ(host.angle[1], graph.angle[1]);
    out.push_back(graph.angle[1] / 16.0);
  }
  return out;
}

TEST(AddingABlock, ThePageIsRight) {
#include "page_test.inc"
}

}  // namespace
}  // namespace flexor::deploy
