// Converts the library's errors to Python exceptions, and handles signals during long work.
#include <algorithm>
#include <regex>

#include "base/error.h"
#include "base/text.h"
#include "python/src/bindings.h"

namespace upswing {
namespace {

namespace nb = nanobind;

/// Classes of the exceptions; they live as long as the interpreter.
PyObject* error_class = nullptr;
PyObject* input_error_class = nullptr;
PyObject* failure_class = nullptr;

PyObject* MakeClass(nb::module_& m, const char* name, const char* doc, PyObject* bases) {
  const auto full = nb::cast<std::string>(m.attr("__name__")) + "." + name;
  PyObject* made = PyErr_NewExceptionWithDoc(full.c_str(), doc, bases, nullptr);
  if (made == nullptr) throw nb::python_error();
  m.attr(name) = nb::handle(made);
  return made;
}

/// The message with Python's names: a flag at its beginning or in its advice becomes an argument.
/// The message must be short, because std::regex calls itself for each character of a match.
std::string PythonMessage(std::string message) {
  static const std::regex kFlag("(^|with |another )--(set )?([a-z0-9-]+)");
  for (std::smatch match; std::regex_search(message, match, kFlag);) {
    std::string name = match[3];
    std::ranges::replace(name, '-', '_');
    message = match.prefix().str() + match[1].str() + name + match.suffix().str();
  }
  return message;
}

void Translate(const std::exception_ptr& exception, void* /*unused*/) {
  try {
    std::rethrow_exception(exception);
  } catch (const Error& error) {
    PyErr_SetString(error.exit_code() == 2 ? input_error_class : failure_class,
                    PythonMessage(OneLine(error.what())).c_str());
  }
}

}  // namespace

bool Interrupts::due() {
  constexpr std::chrono::milliseconds kBetween(50);
  if (std::this_thread::get_id() != thread_) return false;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < kBetween) return false;
  last_ = now;
  return true;
}

std::optional<Error> OwnError(const nb::python_error& error) {
  if (!error.matches(error_class)) return std::nullopt;
  const auto message = Printable(nb::cast<std::string>(nb::str(error.value())));
  return error.matches(input_error_class) ? BadInput(message) : Failure(message);
}

void CheckSignals() {
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

void BindErrors(nb::module_& m) {
  error_class = MakeClass(m, "Error", "Base class of Upswing's exceptions.", PyExc_Exception);
  input_error_class =
      MakeClass(m, "InputError",
                "Wrong input: the message names the argument, the expected and the given value.",
                nb::make_tuple(nb::handle(error_class), nb::handle(PyExc_ValueError)).ptr());
  failure_class =
      MakeClass(m, "Failure", "The work itself failed: a full disk, a number that is not finite.",
                nb::make_tuple(nb::handle(error_class), nb::handle(PyExc_RuntimeError)).ptr());
  nb::register_exception_translator(Translate);
}

}  // namespace upswing
