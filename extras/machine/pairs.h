#pragma once

#include <cmath>

namespace upswing::machine {

/// Sums over pairs (x, y), for the regression y ≈ offset + gain x.
struct Pairs {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  void Add(double a, double b) { n += 1, x += a, y += b, xx += a * a, xy += a * b, yy += b * b; }
  double Sxx() const { return xx - x * x / n; }
  double Sxy() const { return xy - x * y / n; }
  double Syy() const { return yy - y * y / n; }
  double gain() const { return Sxx() > 0 ? Sxy() / Sxx() : 0; }
  double correlation() const {
    const double product = Sxx() * Syy();
    return product > 0 ? Sxy() / std::sqrt(product) : 0;
  }
};

}  // namespace upswing::machine
