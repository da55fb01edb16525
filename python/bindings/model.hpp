// A model document and the compensator that it describes.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "host/identify/estimator.hpp"
#include "host/model/model.hpp"
#include "python/bindings/recording.hpp"

namespace flexor::python {

// Readings in, angles out, on the model's own grid or as a log has them. In one thread at a time.
class Compensator {
 public:
  // `arithmetic`: double, float, or fixed, as in the glove. Throws io::InputError.
  Compensator(model::Model model, const std::string& arithmetic);

  const model::Model& model() const { return model_; }

  // (angles, status), a row for each of `readings`, which are a sample period apart; what was stepped before is remembered.
  nb::tuple step(const Matrix& readings);
  void reset();

 private:
  class Stepper;
  template <class Arithmetic>
  class StepperOf;

  model::Model model_;
  std::string arithmetic_;
  std::shared_ptr<Stepper> stepper_;
};

}  // namespace flexor::python
