// Mutated model documents through the one loader and what commands do with a model: one verdict each.
// FLEXOR_MUTANTS=20000 asks for more of them.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "host/deploy/images.hpp"
#include "host/identify/estimator.hpp"
#include "host/io/fuzz_json.hpp"
#include "host/io/json.hpp"
#include "host/model/random_model.hpp"
#include "host/study/boards.hpp"
#include "host/study/catalogue.hpp"

namespace flexor::study {
namespace {

Json shipped(const char* name) {
  return io::parse_json(io::read_file(std::string(FLEXOR_SOURCE_DIR "/models/") + name), name);
}

// With everything that identify writes.
Json identified() {
  Json json =
      io::parse_json(model::to_json(model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json")), "hw");
  json["max_gap_s"] = 0.5;
  for (Json& input : json["inputs"]) {
    input["poses"] = {{"open", 100}, {"fist", 400}};
    input["turns"] = {{"open", 120}, {"fist", 380}};
    input["readings"] = {{"share", {0.1, 0.5, 0.9}}, {"reading", {100, 200, 400}}};
    input["donnings"] = {{"recordings", 3}, {"shift_sd", 4}, {"log_gain_sd", 0.1}};
  }
  for (Json& joint : json["joints"])
    joint["accuracy"] = {{"angle_deg", {30, 90}}, {"standard_error_deg", {2, 3}}};
  json["training"] = {{"output_column", "index_deg"}, {"sensor", {{"file", "a.csv"}}}};
  json["fit"] = {{"parameters", Json::array()}, {"holdout", {{"rmse_deg", 2.5}, {"samples", 100}}}};
  return json;
}

// Three seconds at 20 Hz from below each input's range to above it.
template <class Arithmetic>
void apply(const model::Model& m) {
  identify::Estimator<Arithmetic> estimator(m);
  std::vector<double> reading(m.inputs.size());
  for (int k = 0; k < 60; ++k) {
    for (std::size_t i = 0; i < reading.size(); ++i) {
      const model::Input& in = m.inputs[i];
      reading[i] = in.valid_min + (in.valid_max - in.valid_min) * (k - 3) / 50.0;
    }
    estimator.push(0.05 * k, reading, [&](const identify::Estimate& e) {
      for (std::size_t j = 0; j < m.joints.size(); ++j) {
        ASSERT_TRUE(std::isfinite(e.angle_deg[j]));
        if (m.joints[j].accuracy) {
          ASSERT_TRUE(std::isfinite(m.joints[j].accuracy->at(e.angle_deg[j])));
        }
      }
    });
  }
}

void deploy_it(const model::Model& m) {
  const deploy::Glove glove = deploy::glove_for({}, m, bench_key());
  (void)deploy::glove_flash(glove);
  (void)deploy::hand_flash(deploy::safe_hand({}, glove.model, bench_key()));
}

void experiment(model::Model m, const twin::Motion& motion) {
  m.sample_period_s = 0.1;
  model::check(m);
  const twin::TrialInput input{twin::Parameters(), motion, m};
  twin::check(input);
  const twin::Trial trial = twin::simulate(input, 0, 1).front();
  for (const auto& finger : trial.hand_deg) {
    for (const float angle : finger) ASSERT_TRUE(std::isfinite(angle));
  }
}

// Whether a command takes it: anything but an InputError ends the test.
template <class Command>
bool takes(const model::Model& m, Command&& command) {
  try {
    command(m);
    return true;
  } catch (const io::InputError&) {
    return false;
  }
}

struct Verdicts {
  int loaded = 0;
  int deployed = 0;
  int simulated = 0;
};

void judge(const std::string& text, const twin::Motion& motion, Verdicts& verdicts) {
  std::optional<model::Model> m;
  try {
    m = model::from_json(text, "mutant");
  } catch (const io::InputError&) {
    return;
  }
  ++verdicts.loaded;
  const std::string shown = model::diagram(*m);
  EXPECT_EQ(shown.find("nan"), std::string::npos) << shown;
  EXPECT_EQ(model::from_json(model::to_json(*m), "again"), *m);
  EXPECT_NO_THROW(apply<model::DoubleArithmetic>(*m)) << text;
  (void)takes(*m, apply<model::FixedArithmetic>);
  if (takes(*m, deploy_it)) ++verdicts.deployed;
  // A trial takes longer than all of the rest: one of ten.
  if (verdicts.loaded % 10 == 0 && takes(*m, [&](const model::Model& one) { experiment(one, motion); }))
    ++verdicts.simulated;
}

TEST(Mutants, OfAModelGetOneVerdictFromAllCommands) {
  const char* more = std::getenv("FLEXOR_MUTANTS");
  const int count = more != nullptr ? std::atoi(more) : 3000;
  std::vector<Json> documents = {shipped("published_hw.json"), shipped("published_wiener.json"), identified(),
                                 identified()};
  for (unsigned seed = 1; seed <= 4; ++seed)
    documents.push_back(io::parse_json(model::to_json(model::RandomModel(seed).make()), "random"));
  const twin::Motion motion = twin::Motion::from_json(shipped("gestures/1.json").dump(), "1.json");
  Verdicts verdicts;
  for (int k = 0; k < count; ++k) {
    SCOPED_TRACE(k);
    std::mt19937 random(static_cast<unsigned>(k));
    Json mutant = documents[static_cast<std::size_t>(k) % documents.size()];
    io::fuzz::change_anything(mutant, random);
    judge(mutant.dump(-1, ' ', false, Json::error_handler_t::replace), motion, verdicts);
    if (HasFailure()) break;
  }
  // Neither all nor none: the mutants reach each command.
  EXPECT_GT(verdicts.loaded, count / 20);
  EXPECT_LT(verdicts.loaded, count * 3 / 4);
  EXPECT_GT(verdicts.deployed, 0);
  EXPECT_GT(verdicts.simulated, 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 1'000'000) << "kilobytes";
#endif
}

TEST(Mutants, WhatCommandsReadOfProvenanceIsCheckedByTheLoader) {
  for (const auto& [where, wrong] :
       std::vector<std::pair<const char*, Json>>{{"/fit/holdout", Json::array({1})},
                                                 {"/fit/holdout/rmse_deg", "2"},
                                                 {"/fit/holdout/rmse_deg", 1e308},
                                                 {"/training/output_column", 3}}) {
    Json json = identified();
    json[Json::json_pointer(where)] = wrong;
    EXPECT_THROW((void)model::from_json(json.dump(), "x.json"), io::InputError) << where;
  }
  EXPECT_NO_THROW((void)model::from_json(identified().dump(), "x.json"));
}

}  // namespace
}  // namespace flexor::study
