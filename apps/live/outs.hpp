// Who hears the angles of the model that is worn: an OpenGloves driver, a stream, a file.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host/export/sink.hpp"
#include "host/model/model.hpp"

namespace flexor::live {

class Outs {
 public:
  using Open = std::function<std::unique_ptr<exports::Sink>(const model::Model&)>;
  using Failed =
      std::function<void(const std::exception&)>;  // one that can take no more ends, and nothing else

  Outs(std::vector<Open> open, Failed failed) : open_(std::move(open)), failed_(std::move(failed)) {}

  // They stay as long as the joints are the same, and are opened anew for others.
  void wear(const model::Model& model);
  void add(double t_s, const std::vector<double>& joints_deg);

 private:
  std::vector<Open> open_;
  Failed failed_;
  std::vector<std::string> joints_;
  std::vector<std::unique_ptr<exports::Sink>> sinks_;
};

}  // namespace flexor::live
