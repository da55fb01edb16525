#include "host/study/rendered_cameras.hpp"

#include "host/study/builtin.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {

RenderedCameras::RenderedCameras(std::filesystem::path program, Engine* inner)
    : workers_(std::move(program)), inner_(inner) {}

std::string RenderedCameras::name() const {
  return (inner_ != nullptr ? inner_->name() : std::string("twin")) + ", rendered cameras";
}

std::vector<twin::Trial> RenderedCameras::simulate(const twin::TrialInput& input, std::uint64_t first,
                                                   int count) const {
  twin::TrialInput exact = input;
  exact.parameters.camera_noise_deg = 0;
  std::vector<twin::Trial> trials =
      inner_ != nullptr ? inner_->simulate(exact, first, count) : twin::simulate(exact, first, count);
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const Json seen =
        workers_.run("see", {{"joints", Json::parse(builtin("joints/paper_hand.json"))},
                             {"seed", twin::seed_of(input.seed, first + t, twin::seed_of(1, 'f'))},
                             {"rate_hz", input.parameters.camera_rate_hz},
                             {"glove_deg", trials[t].glove_deg},
                             {"hand_deg", trials[t].hand_deg}});
    seen.at("glove_deg").get_to(trials[t].glove_deg);
    seen.at("hand_deg").get_to(trials[t].hand_deg);
  }
  return trials;
}

}  // namespace flexor::study
