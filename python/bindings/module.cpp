#include "python/bindings/bindings.hpp"

NB_MODULE(_flexor, m) {
  namespace io = flexor::io;
  namespace nb = nanobind;
  if (PyInterpreterState_GetID(PyInterpreterState_Get()) != 0) {
    PyErr_SetString(PyExc_ImportError, "flexor cannot be used in a subinterpreter: start a process instead");
    throw nb::python_error();
  }
  nb::exception<io::InputError>(m, "InputError", PyExc_ValueError).doc() =
      "What was given is wrong: what, where, and the mend.";
  auto job_error = nb::exception<io::JobError>(m, "JobError", PyExc_RuntimeError);
  job_error.doc() = "What was given is well-formed, but tells too little.";
  nb::exception<io::Doubt>(m, "Doubt", job_error);
  m.attr("version") = FLEXOR_VERSION;
  flexor::python::add_recording(m);
  flexor::python::add_model(m);
  flexor::python::add_identify(m);
  flexor::python::add_twin(m);
}
