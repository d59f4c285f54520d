// A Python function as a policy.
#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/observation.h"
#include "python/src/bindings.h"

namespace upswing {
namespace {

namespace nb = nanobind;

class FunctionPolicy final : public Policy {
 public:
  FunctionPolicy(nb::callable function, int memory)
      : function_(std::move(function)), obs_size_(kObservationSize + memory * kMemorySize) {
    info_.control_period = kControlPeriod;
  }
  FunctionPolicy(const FunctionPolicy&) = delete;
  FunctionPolicy& operator=(const FunctionPolicy&) = delete;
  ~FunctionPolicy() override {
    const nb::gil_scoped_acquire lock;
    function_.reset();
  }

  std::string kind() const override { return "python-function"; }
  std::string description() const override { return "a function in Python"; }
  int obs_size() const override { return obs_size_; }
  int action_size() const override { return 1; }
  const PolicyInfo& info() const override { return info_; }
  std::unique_ptr<Memory> Start(int /*num_envs*/) const override {
    return std::make_unique<Memory>();
  }

  void Act(Matrix<const float> obs, Matrix<double> action, Memory& /*memory*/) const override {
    const nb::gil_scoped_acquire lock;
    const auto n = static_cast<size_t>(obs.rows());
    // A copy: the function may keep it.
    const auto array = NewArray<float>({n, static_cast<size_t>(obs.cols())});
    for (int i = 0; i < obs.rows(); ++i) {
      std::ranges::copy(obs.row(i), array.data() + static_cast<ptrdiff_t>(i) * obs.cols());
    }
    const nb::module_ numpy = nb::module_::import_("numpy");
    const nb::object returned = function_(array), numbers = numpy.attr("asarray")(returned);
    const auto kind = nb::cast<std::string>(numbers.attr("dtype").attr("kind"));
    if (std::string_view("fiub").find(kind) == std::string_view::npos) {
      throw BadInput(Concat("policy: expected numbers, got ",
                            nb::cast<std::string>(returned.type().attr("__name__"))));
    }
    const nb::object result = numpy.attr("ascontiguousarray")(numbers, "float64");
    const auto torque = nb::cast<nb::ndarray<const double, nb::c_contig, nb::device::cpu>>(result);
    const bool fits = torque.size() == n && torque.ndim() >= 1 && torque.ndim() <= 2;
    if (!fits) {
      throw BadInput(Concat("policy: expected a torque for each of ", n, " observations, got ",
                            torque.size(), " numbers"));
    }
    for (size_t i = 0; i < n; ++i) {
      if (!std::isfinite(torque.data()[i])) {
        throw BadInput(Concat("policy: expected finite torques, got ", torque.data()[i]));
      }
      action(static_cast<int>(i), 0) = torque.data()[i];
    }
  }

  Tensors ToTensors() const override {
    throw BadInput("policy: expected a policy that has a file, got a Python function");
  }

 private:
  nb::object function_;
  int obs_size_;
  PolicyInfo info_;
};

}  // namespace

LoadedPolicy MakeFunctionPolicy(nb::callable function, int memory) {
  const auto name = nb::cast<std::string>(
      nb::str(nb::getattr(nb::handle(function), "__name__", nb::str("a function in Python"))));
  return {Printable(name), "", std::make_shared<FunctionPolicy>(std::move(function), memory),
          kDoublePendulum, Plant()};
}

}  // namespace upswing
