// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/grid.h"

namespace organbake {

// Normal equations of a linearised first-order equation with a bending penalty, on a grid of
// spacing step_x × step_y:
//   minimise  Σ w (2 δ + b_x δ_x + b_y δ_y − e)²  +  μ Σ ((v+δ)_xx² + 2 (v+δ)_xy² + (v+δ)_yy²)
// Differences of δ are central (one-sided at the border). Slopes are stored per pixel of
// difference, that is b / (span · step).
class FirstOrderEquations {
 public:
  FirstOrderEquations(int width, int height, double step_x, double step_y);

  Plane slope_x, slope_y, weight;
  Plane target;  // w · e; overwritten by apply()
  Plane anchor;  // a of a term a (v+δ−h)²: holds pixels near h; all 0 at first

  // Sets the anchors and what they hold to, which is 0 else.
  void hold(const Plane& at, const Plane& weight);
  // μ per pixel of area step_x · step_y.
  void set_bending(double mu);
  // Span in pixels of the difference at index i of n: 2 inside, 1 at the ends (or 1 when n is 1).
  static int span(int i, int n) { return n < 3 ? 1 : (i > 0) + (i + 1 < n); }

  // What bending costs v, and the anchors that the last solve() had.
  double penalty(const Plane& v);

  // Minimises over δ by preconditioned conjugate gradients from zero; returns the steps taken.
  int solve(const Plane& v, int most_steps, Plane& delta);

 private:
  int before(int i) const { return i > 0 ? i - 1 : i; }
  static int after(int i, int n) { return i + 1 < n ? i + 1 : i; }
  void apply(const Plane& delta, Plane& out);
  void data_forward(const Plane& delta);
  void data_adjoint(Plane& out) const;
  void add_bending(const Plane& v, float factor, Plane& out);
  void add_bending_rows(const Plane& v, float factor, Plane& out);
  void add_bending_columns(const Plane& v, float factor, Plane& out) const;
  void add_bending_twist(const Plane& v, float factor, Plane& out);
  void fill_diagonal();

  int width_, height_;
  double step_x_, step_y_;
  bool anchored_ = false;
  float bend_xx_ = 0, bend_yy_ = 0, bend_xy_ = 0;
  Plane diagonal_, residual_, scaled_, direction_, image_;
  Plane held_;  // h; empty = 0
  std::vector<float> row_;
};

}  // namespace organbake
