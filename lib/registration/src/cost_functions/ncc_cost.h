// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include "appearance/ncc.h"
#include "cost_functions/live_prediction.h"
#include "organbake/registration/similarity.h"

namespace organbake {

struct WeightedPixel {
  int x = 0, y = 0;
  double weight = 1;
  double trust = 1;  // before anything is known of the photograph: the weight's largest value
};

// 1 − R over some pixels of one level: the whole picture, or one patch of it with a robust loss
// around (a loss acts on a whole block). Parameters: pose (7), light (basis size), log focal (1).
//
// Ceres is handed the residual r and its derivative J turned by an orthogonal matrix, so that all
// of r lies in the first row and J in the first few: [r J] = Q U, U upper triangular. Cost,
// gradient and JᵀJ are the same; a photograph's worth of rows is not copied about; and sums no
// longer depend on where in memory they start (Eigen adds in another order there), so that equal
// input gives equal bytes.
class NccCost : public ceres::CostFunction {
 public:
  NccCost(const LivePrediction& live, std::vector<WeightedPixel> pixels, Similarity similarity);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;
  // False when the photograph is constant here.
  bool usable() const { return block_.usable(); }
  double correlation() const { return block_.correlate(predicted(), nullptr); }

  // r and its derivative by motion (6), ln f (1) and light (basis size), a row each pixel (two for
  // gradients), as they are.
  struct Linearization {
    Eigen::VectorXd residual;
    NccBlock::RowMajor derivative;
  };
  Linearization linearization() const;

 private:
  Eigen::VectorXd predicted() const;

  const LivePrediction& live_;
  std::vector<WeightedPixel> pixels_;
  Similarity similarity_;
  NccBlock block_;
};

}  // namespace organbake
