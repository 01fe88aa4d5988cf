// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/product_manifold.h>
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "appearance/prediction.h"
#include "depth/depth_alignment.h"
#include "organbake/registration/register_photo.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

// ObjectPose as Ceres moves it: a unit quaternion and a place.
using PoseManifold =
    ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
// d motion / d the seven numbers: a derivative by the motion times this is one by the numbers.
Eigen::Matrix<double, 6, 7, Eigen::RowMajor> motion_by_numbers(const double* pose);

// The numbers that the solver moves. A longer lens takes the organ farther away: what is left of
// the picture's change is then perspective alone, and focal length and distance, which otherwise
// hardly differ, hardly trade against each other.
struct SolverState {
  std::array<double, 7> pose{};  // ObjectPose's, its z as it were with the given focal length
  ShadingBasis::Weights light = ShadingBasis::Weights::Zero();
  double log_focal = 0;        // of the scale of the given focal lengths
  double log_depth_scale = 0;  // of what the photograph's depth, where there is one, falls short by

  ObjectPose object_pose() const {
    ObjectPose found = ObjectPose::from_array(pose.data());
    found.center_camera_mm.z() *= std::exp(log_focal);
    return found;
  }
};

// At most how far the surface moves in the picture between two states, in pixels of the level.
double pixels_moved(const PhotoLevel& level, const RegisteredSurface& surface,
                    const SolverState& from, const SolverState& to);

// Draws the prediction once for every state that the solver visits; all cost functions of a problem
// read from it. What is seen and what is hidden is thereby always that of the very pose.
class LivePrediction : public ceres::EvaluationCallback {
 public:
  LivePrediction(const RegisteredSurface& surface, const PhotoLevel& level,
                 const ShadingBasis& basis, const PredictionSettings& settings,
                 const SolverState& state)
      : surface_(surface), level_(level), basis_(basis), settings_(settings), state_(state) {}

  // At most so many linearisations, and none within this many pixels of the last.
  void stop_after(int linearisations, double motion_px) {
    most_derivations_ = linearisations;
    settled_px_ = motion_px;
  }

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;

  // The last linearisation led to a state so near that another would gain nothing. Cost functions
  // then answer with slopes of zero, and Ceres stops where it stands: its own tolerances would drop
  // the last step, or ask for the slopes of a whole photograph to find that they are small.
  bool settled() const { return settled_; }

  const PhotoLevel& level() const { return level_; }
  const ShadingBasis& basis() const { return basis_; }
  const Prediction& prediction() const { return prediction_; }

  // Of a pixel of the level, inside the prediction's window or not.
  double radiance(int x, int y) const;
  PixelDerivative derivative(int x, int y) const;  // after evaluate_jacobians
  double phi(int x, int y, int j) const;

 private:
  void derive();
  bool settles() const;

  const RegisteredSurface& surface_;
  const PhotoLevel& level_;
  const ShadingBasis& basis_;
  PredictionSettings settings_;
  const SolverState& state_;
  Prediction prediction_;
  SolverState drawn_state_, traced_state_, derived_state_;
  bool drawn_ = false, derived_ = false, settled_ = false;
  int derivations_ = 0, most_derivations_ = std::numeric_limits<int>::max();
  double settled_px_ = 0;
  std::vector<std::array<float, 7>> derivatives_;
};

// Weighted normalised cross-correlation R of fixed values a with predicted values b (the paper's
// R, 2.1.1, with a weight per pixel), as a least-squares residual: with â, b̂ of weighted mean zero
// and unit norm,
//   r = â − b̂   and   ½‖r‖² = 1 − R exactly.
// b that is constant correlates with nothing: R = 0, b̂ = 0, no derivative.
class NccBlock {
 public:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  // Equal lengths; weights ≥ 0.
  NccBlock(const std::vector<double>& a, const std::vector<double>& weights);

  int size() const { return static_cast<int>(a_hat_.size()); }
  // False when a is constant, so that nothing can be told.
  bool usable() const { return usable_; }
  // R in −1…1. `residual` (size() numbers) may be null.
  double correlate(const Eigen::VectorXd& b, double* residual) const;
  // d b / d p (size() rows) becomes d r / d p: db̂ = (I − b̂ b̂ᵀ) C db / ‖C b‖ with C the weighted
  // centring; rank-1 updates, never formed.
  void to_residual_derivative(const Eigen::VectorXd& b, RowMajor& derivative) const;

 private:
  // Centred and scaled b, and the norm it had.
  Eigen::VectorXd normalised(const Eigen::VectorXd& b, double& norm) const;

  Eigen::VectorXd a_hat_, weight_, root_weight_;
  double weight_sum_ = 0;
  bool usable_ = false;
};

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
  NccCost(const LivePrediction& live, std::vector<WeightedPixel> pixels);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;
  // False when the photograph is constant here.
  bool usable() const { return block_.usable(); }
  double correlation() const { return block_.correlate(predicted(), nullptr); }

  // r and its derivative by motion (6), ln f (1) and light (basis size), a row each pixel.
  struct Linearization {
    Eigen::VectorXd residual;
    NccBlock::RowMajor derivative;
  };
  Linearization linearization() const;

 private:
  Eigen::VectorXd predicted() const;

  const LivePrediction& live_;
  std::vector<WeightedPixel> pixels_;
  NccBlock block_;
};

// Half the weighted squares of the depth's distances to the surface, with what is expected of its
// scale, times a factor. Parameters: pose (7), log scale (1). The matches stand while it is solved.
class DepthCost : public ceres::CostFunction {
 public:
  // All but the factor outlive the cost.
  DepthCost(const SeenDepth& depth, const WeighedDepth& weighed, const ScalePrior& prior,
            const Eigen::Vector3d& center_world_mm, double factor);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const SeenDepth& depth_;
  const WeighedDepth& weighed_;
  const ScalePrior& prior_;
  Eigen::Vector3d center_world_mm_;
  double factor_;
};

// What the solver climbs on one level of a photograph: R of the whole overlap, or of its patches,
// by pose, light and, when it is free, focal length. Moves `state`, as `live` draws it.
class LevelProblem {
 public:
  LevelProblem(LivePrediction& live, SolverState& state, bool free_focal);

  // False when the photograph is constant there.
  [[nodiscard]] bool add_whole(const std::vector<WeightedPixel>& pixels) {
    return add(pixels, nullptr);
  }
  // Each patch, a square of `side` pixels, has its own loss and counts by its contrast, so that the
  // sum is 1 − R's again when all fit. Patches of fewer than `least_weight` pixels are left out.
  [[nodiscard]] bool add_patches(const std::vector<WeightedPixel>& pixels, int side,
                                 double least_weight);
  // What else is known of the pose, in units of the photograph's 1 − R: by pose and depth's scale.
  void add_depth(std::unique_ptr<ceres::CostFunction> cost);
  void solve(int iterations);

 private:
  bool add(const std::vector<WeightedPixel>& pixels, ceres::LossFunction* loss);
  void add_light_prior();

  LivePrediction& live_;
  SolverState& state_;
  bool split_ = false;  // into patches
  PoseManifold manifold_;
  ceres::Problem problem_;
};

// The overlap T of one prediction with a photograph: pixels of the organ and of a band beside it,
// fixed while the solver runs, so that it cannot raise R by showing less.
// band: pixels beyond the outline. Nothing for an organ outside the picture. Of an open surface the
// pixels at and beyond its cuts are no part of it, and those near them count less: what lies there
// is not known.
std::vector<WeightedPixel> overlap(const PhotoLevel& level, const Prediction& prediction, int band);

struct Appearance {
  ShadingBasis::Weights light = ShadingBasis::Weights::Zero();  // in the photograph's luminance
  double offset = 0;
  double noise = 0;         // robust standard deviation of what is left
  double inlier_share = 0;  // of T's pixels on the organ
};

// Least squares of the photograph over T by the basis and an offset; pixels far off (instruments,
// highlights, a cluttered background) get less weight, which is also written into T. A light that
// would turn bright into dark is refused: the basis' first weights then stand.
Appearance fit_appearance(const PhotoLevel& level, const Prediction& prediction,
                          const ShadingBasis& basis, std::vector<WeightedPixel>& pixels);

// Photograph less prediction of T's pixels on the organ, by a light that is fitted to the other
// half of the picture's squares of `side` pixels: the white squares predict the black ones and the
// other way round. Weights as they are.
std::vector<double> held_out_residuals(const PhotoLevel& level, const Prediction& prediction,
                                       const ShadingBasis& basis,
                                       const std::vector<WeightedPixel>& pixels, int side);

// Geman & McClure 1987: the weight of a residual whose square is `off2` times that of the cutoff. 1
// for what fits, a quarter at the cutoff, nothing far beyond.
inline double robust_weight(double off2) { return 1 / ((1 + off2) * (1 + off2)); }

}  // namespace organbake
