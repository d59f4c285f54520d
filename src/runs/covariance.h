#pragma once

#include <toml++/toml.h>

#include <string>
#include <vector>

namespace upswing {

/// The covariance of a machine's uncertain values: the table [covariance] of a twin.
struct Covariance {
  std::vector<std::string> names;  // (n)
  std::vector<double> values;      // (n × n)
};

/// Removes the table [covariance] of a document, and parses it: for each value, a list with its
/// covariances with all values, in the order of the rows. Without the table, n is 0. Throws
/// BadInput, also for a name that is not one number of a machine.
Covariance TakeCovariance(toml::table& document, const std::string& where);

/// The covariance of the values that simulated tasks have, as Posterior::Parse reads it; empty if
/// there is none. Deviations of a machine's delay and lag add up to those of the sensors' latency.
std::string PosteriorText(const Covariance& covariance);

}  // namespace upswing
