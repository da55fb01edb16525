// The experiment on simulated boards: takes the twin's place trial by trial, and measures images.
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "cosim/simulation.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {

class Engine : public study::Boards {
 public:
  std::string name() const override { return "avr"; }
  int batch() const override { return 1; }
  // Builds both images, once for each compensator and hand.
  void prepare(const twin::Setup& setup) override;
  std::vector<twin::Trial> simulate(const twin::Setup& setup, std::uint64_t first, int count) const override;

  study::GloveFigures run_glove(const std::filesystem::path& elf, const deploy::Glove& glove,
                                const study::Counts& counts) const override;
  study::HandFigures run_hand(const std::filesystem::path& elf, const deploy::Glove& glove,
                              double seconds) const override;
  std::vector<study::Latency> latency(const twin::Parameters& parameters, const model::Model& model,
                                      int edges, std::uint64_t seed) const override;
  void trace(const twin::Setup& setup, const std::filesystem::path& vcd) override;

 private:
  const Images& images_of(const twin::Setup& setup) const;

  std::map<std::string, std::unique_ptr<Images>> images_;
};

// Builds both images and loads them.
std::unique_ptr<Images> build_images(const deploy::Glove& glove, const deploy::Hand& hand);

}  // namespace flexor::cosim
