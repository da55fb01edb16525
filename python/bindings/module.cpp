#include <nanobind/nanobind.h>

#include "host/io/io.hpp"
#include "python/bindings/rooms.hpp"

NB_MODULE(_flexor, m) {
  namespace io = flexor::io;
  namespace nb = nanobind;
  nb::exception<io::InputError>(m, "InputError", PyExc_ValueError);
  nb::exception<io::JobError>(m, "JobError", PyExc_RuntimeError);
  nb::exception<io::Cancelled>(m, "Cancelled", PyExc_RuntimeError);
  m.attr("version") = FLEXOR_VERSION;
  flexor::python::add_recording(m);
  flexor::python::add_model(m);
  flexor::python::add_identify(m);
  flexor::python::add_score(m);
  flexor::python::add_twin(m);
  flexor::python::add_posture(m);
}
