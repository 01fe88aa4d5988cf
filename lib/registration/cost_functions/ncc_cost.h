// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include "registration/cost_functions/live_prediction.h"
#include "registration/ncc.h"
#include "registration/similarity.h"

namespace organbake {

struct WeightedPixel {
  int x = 0, y = 0;
  double weight = 1;
};

// 1 − R over some pixels of one level: the whole picture, or one patch of it with a robust loss
// around (a loss acts on a whole block). Parameters: pose (7), light (basis size), log focal (1).
class NccCost : public ceres::CostFunction {
 public:
  NccCost(const LivePrediction& live, std::vector<WeightedPixel> pixels, Similarity similarity);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;
  // False when the photograph is constant here.
  bool usable() const { return block_.usable(); }
  double correlation() const { return block_.correlate(predicted(), nullptr); }

 private:
  Eigen::VectorXd predicted() const;
  void fill(NccBlock::RowMajor& derivative, bool by_light) const;

  const LivePrediction& live_;
  std::vector<WeightedPixel> pixels_;
  Similarity similarity_;
  NccBlock block_;
};

}  // namespace organbake
