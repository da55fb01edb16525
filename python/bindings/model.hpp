// A model document and the compensator that it describes.
#pragma once

#include <memory>
#include <string>
#include <variant>

#include "host/identify/estimator.hpp"
#include "host/model/model.hpp"
#include "python/bindings/recording.hpp"

namespace flexor::python {

using Estimator =
    std::variant<identify::Estimator<model::DoubleArithmetic>, identify::Estimator<model::FloatArithmetic>,
                 identify::Estimator<model::FixedArithmetic>>;

// Readings in, angles out, on the model's own grid. In one thread at a time.
class Compensator {
 public:
  // `arithmetic`: double, float, or fixed, as in the glove. Throws io::InputError.
  explicit Compensator(model::Model model, std::string arithmetic = "double");

  const model::Model& model() const { return model_; }
  const std::string& arithmetic() const { return arithmetic_; }

  // (angles, status), a row for each of `readings`, which are a sample period apart; what was stepped before is remembered.
  nb::tuple step(const Matrix& readings);
  void reset();

 private:
  model::Model model_;
  std::string arithmetic_;
  std::shared_ptr<Estimator> estimator_;
  std::uint64_t next_ = 0;
};

}  // namespace flexor::python
