// SPDX-License-Identifier: GPL-3.0-or-later
// A lower bound of the number of cameras by the linear relaxation, solved by the primal-dual hybrid
// gradient with diagonal steps and restarts (Pock & Chambolle 2011; Applegate et al. 2021): the
// relaxation has millions of entries, of which it needs products only. Any prices prove a bound, so
// that it may end early.
#include "gradient_cover_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr int kFirstSteps = 12, kMostGradientSteps = 100, kMostRounds = 1000;
// Of candidates in a step, worked on at the same time; fixed, so that sums don't hang on threads.
constexpr std::size_t kPieces = 4;
// Primal against dual steps: at first the candidates have far to go, in the end the prices of deep
// places do. Measured on organs.
constexpr float kFirstBalance = 10, kBalanceFades = 0.9f;
// Within a round only candidates take part that nearly pay, and samples that are nearly short.
constexpr float kNearlyPays = 0.8f, kNearlyShort = 1.4f;

using Indices = std::vector<std::uint32_t>;

double entries_of(const std::vector<Indices>& columns) {
  double sum = 0;
  for (const Indices& column : columns) sum += static_cast<double>(column.size());
  return sum;
}

// Rows = samples, columns = candidates.
struct Columns {
  std::vector<Indices> rows;
  std::size_t row_count = 0;
};

// One candidate's or sample's values over the steps of a round.
struct Primal {
  std::vector<float> value, step, sum;
};

// The steps of one round on the part of the relaxation that is at work in it.
class ActivePart {
 public:
  ActivePart(Columns columns, float overlap, double needed)
      : columns_(std::move(columns)), overlap_(overlap), needed_(needed) {
    for (std::vector<float>& piece : times_) piece.resize(columns_.row_count);
    x.sum.assign(columns_.rows.size(), 0);
    z.sum.assign(columns_.row_count, 0);
    y.sum.assign(columns_.row_count, 0);
  }

  Primal x, z, y;
  float lambda = 0;  // price of one covered sample
  double lambda_step = 0, lambda_sum = 0;

  double entries() const { return entries_of(columns_.rows); }

  void run(int steps) {
    for (int i = 0; i < steps; ++i) step();
    const auto mean = [steps](Primal& p) {
      for (std::size_t i = 0; i < p.value.size(); ++i) {
        p.value[i] = p.sum[i] / static_cast<float>(steps);
      }
    };
    mean(x);
    mean(z);
    mean(y);
    lambda = static_cast<float>(lambda_sum / steps);
  }

 private:
  // Candidates of one piece; what they show goes to the piece's own row of times_.
  void step_columns(std::size_t piece) {
    std::vector<float>& times = times_[piece];
    std::fill(times.begin(), times.end(), 0.0f);
    const std::size_t count = columns_.rows.size();
    for (std::size_t c = piece * count / kPieces; c < (piece + 1) * count / kPieces; ++c) {
      float paid = 0;
      for (const std::uint32_t r : columns_.rows[c]) paid += y.value[r];
      const float next = std::clamp(x.value[c] - x.step[c] * (1 - paid), 0.0f, 1.0f);
      const float ahead = 2 * next - x.value[c];
      x.value[c] = next;
      x.sum[c] += next;
      if (ahead == 0) continue;
      for (const std::uint32_t r : columns_.rows[c]) times[r] += ahead;
    }
  }

  void step() {
    parallel_for(std::size_t{0}, kPieces, [&](std::size_t piece) { step_columns(piece); });
    double covered = 0;
    for (std::size_t r = 0; r < columns_.row_count; ++r) {
      float times = 0;  // pieces in order: the same for any number of threads
      for (const std::vector<float>& piece : times_) times += piece[r];
      const float next =
          std::clamp(z.value[r] - z.step[r] * (overlap_ * y.value[r] - lambda), 0.0f, 1.0f);
      const float ahead = 2 * next - z.value[r];
      z.value[r] = next;
      covered += ahead;
      y.value[r] = std::max(0.0f, y.value[r] - y.step[r] * (times - overlap_ * ahead));
      z.sum[r] += next;
      y.sum[r] += y.value[r];
    }
    lambda = std::max(0.0f, lambda + static_cast<float>(lambda_step * (needed_ - covered)));
    lambda_sum += lambda;
  }

  Columns columns_;
  float overlap_;
  double needed_;
  std::array<std::vector<float>, kPieces> times_;
};

class Relaxation {
 public:
  Relaxation(const std::vector<SampleBits>& seen, const CoverGoal& goal)
      : columns_(seen.size()),
        needed_(goal.samples),
        overlap_(static_cast<float>(goal.overlap)),
        x_(seen.size(), 0),
        z_(seen[0].size(), 1),
        y_(seen[0].size(), 0),
        y_step_(seen[0].size(), overlap_) {
    parallel_for(std::size_t{0}, seen.size(), [&](std::size_t c) {
      seen[c].for_each(
          [&](std::size_t i) { columns_[c].push_back(static_cast<std::uint32_t>(i)); });
    });
    for (const Indices& column : columns_) {
      for (const std::uint32_t r : column) y_step_[r] += 1;
    }
    for (float& step : y_step_) step = 1 / step;
  }

  // Returns the work done: entries of the matrix that the steps went over.
  double run_round(int steps, float balance) {
    const Indices rows = active_rows(), columns = active_columns();
    ActivePart part = part_of(rows, columns, balance);
    part.run(steps);
    const double work = steps * part.entries();
    for (std::size_t k = 0; k < columns.size(); ++k) x_[columns[k]] = part.x.value[k];
    for (std::size_t k = 0; k < rows.size(); ++k) {
      z_[rows[k]] = part.z.value[k];
      y_[rows[k]] = part.y.value[k];
    }
    lambda_ = part.lambda;
    first_round_ = false;
    return work;
  }

  // What the present prices prove: they are worth overlap · (the cheapest `needed` of them).
  double lower_bound() const {
    std::vector<double> cheapest(y_.begin(), y_.end());
    const auto needed = static_cast<std::ptrdiff_t>(needed_);
    std::nth_element(cheapest.begin(), cheapest.begin() + (needed - 1), cheapest.end());
    const double worth =
        overlap_ * std::accumulate(cheapest.begin(), cheapest.begin() + needed, 0.0);
    return best_scaled_bound(worth, payments());
  }

  // Of the primal, scaled up until it reaches the goal (an estimate: x ≤ 1 is not asked again).
  double primal_value() const {
    const std::vector<double> times = times_seen();
    const double sum = std::accumulate(x_.begin(), x_.end(), 0.0);
    double low = 0.5, high = 4;
    for (int i = 0; i < 30; ++i) {
      const double scale = 0.5 * (low + high);
      double covered = 0;
      for (const double t : times) covered += std::min(1.0, scale * t / overlap_);
      (covered >= static_cast<double>(needed_) ? high : low) = scale;
    }
    return high * sum;
  }

  double entries() const { return entries_of(columns_); }

 private:
  std::vector<double> payments() const {
    std::vector<double> sums(columns_.size(), 0.0);
    parallel_for(std::size_t{0}, columns_.size(), [&](std::size_t c) {
      for (const std::uint32_t r : columns_[c]) sums[c] += y_[r];
    });
    return sums;
  }

  std::vector<double> times_seen() const {
    std::vector<double> times(y_.size(), 0.0);
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      if (x_[c] == 0) continue;
      for (const std::uint32_t r : columns_[c]) times[r] += x_[c];
    }
    return times;
  }

  Indices active_rows() const {
    const std::vector<double> times = times_seen();
    Indices rows;
    for (std::uint32_t r = 0; r < y_.size(); ++r) {
      if (y_[r] > 0 || z_[r] < 1 || times[r] < kNearlyShort * overlap_) rows.push_back(r);
    }
    return rows;
  }

  Indices active_columns() const {
    const std::vector<double> paid = payments();
    Indices columns;
    for (std::uint32_t c = 0; c < columns_.size(); ++c) {
      if (x_[c] > 0 || paid[c] > kNearlyPays || first_round_) columns.push_back(c);
    }
    return columns;
  }

  ActivePart part_of(const Indices& rows, const Indices& columns, float balance) const {
    constexpr std::uint32_t kIdle = ~std::uint32_t{0};
    std::vector<std::uint32_t> place(y_.size(), kIdle);
    for (std::uint32_t k = 0; k < rows.size(); ++k) place[rows[k]] = k;
    Columns active{std::vector<Indices>(columns.size()), rows.size()};
    parallel_for(std::size_t{0}, columns.size(), [&](std::size_t k) {
      for (const std::uint32_t r : columns_[columns[k]]) {
        if (place[r] != kIdle) active.rows[k].push_back(place[r]);
      }
    });
    // Idle samples are covered.
    const std::size_t idle = y_.size() - rows.size();
    ActivePart part(std::move(active), overlap_,
                    static_cast<double>(needed_) - static_cast<double>(idle));
    for (const std::uint32_t c : columns) {
      part.x.value.push_back(x_[c]);
      part.x.step.push_back(balance / std::max(1.0f, static_cast<float>(columns_[c].size())));
    }
    for (const std::uint32_t r : rows) {
      part.z.value.push_back(z_[r]);
      part.y.value.push_back(y_[r]);
      part.y.step.push_back(y_step_[r] / balance);
    }
    part.z.step.assign(rows.size(), balance / (overlap_ + 1));
    part.lambda = lambda_;
    part.lambda_step = 1 / (balance * static_cast<double>(y_.size()));
    return part;
  }

  std::vector<Indices> columns_;  // samples seen by each candidate
  std::size_t needed_;
  float overlap_;
  bool first_round_ = true;
  std::vector<float> x_, z_, y_, y_step_;
  float lambda_ = 0;
};

}  // namespace

double best_scaled_bound(double worth, std::vector<double> paid) {
  std::sort(paid.begin(), paid.end(), std::greater<>());
  double best = 0, larger = 0;
  for (std::size_t c = 0; c < paid.size() && paid[c] > 0 && larger <= worth; ++c) {
    best = std::max(best, (worth - larger) / paid[c] + static_cast<double>(c));
    larger += paid[c];
  }
  constexpr double kRoundingOfSums = 1e-9;
  return best * (1 - kRoundingOfSums);
}

double gradient_cover_bound(const std::vector<SampleBits>& seen, const CoverGoal& goal,
                            double most_steps) {
  if (goal.samples == 0 || seen.empty()) return 0;
  Relaxation relaxation(seen, goal);
  int steps = kFirstSteps;
  double work = 0, best = 0;
  float balance = kFirstBalance;
  for (int round = 0; round < kMostRounds && work < most_steps * relaxation.entries(); ++round) {
    work += relaxation.run_round(steps, balance);
    balance = 1 + kBalanceFades * (balance - 1);
    steps = std::min(2 * steps, kMostGradientSteps);
    best = std::max(best, relaxation.lower_bound());
    // A better bound would be the same whole number.
    constexpr double kRounding = 1e-3;
    if (std::ceil(relaxation.primal_value() - kRounding) <= std::ceil(best)) break;
  }
  return best;
}

}  // namespace organbake
