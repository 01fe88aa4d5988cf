// SPDX-License-Identifier: GPL-3.0-or-later
// A tighter bound for surfaces on which few deep samples decide: cutting planes on the relaxation,
// solved by GLPK's dual simplex, which goes on from the last solution when inequalities join.
#include "simplex_cover_bound.h"

#include <glpk.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numeric>

#include "gradient_cover_bound.h"

namespace organbake {
namespace {

using Indices = std::vector<std::uint32_t>;

// Demands join the program as a solution violates them: of so many stretches of the surface the
// most violated one, at first; later more.
constexpr std::size_t kFewestStretches = 64;
constexpr double kViolated = 1e-6;

// Samples that the same candidates see.
struct SampleGroup {
  Indices candidates;
  double samples = 0;
};

// In order of their first samples, so that neighbours on the surface are neighbours here.
std::vector<SampleGroup> groups_of(const std::vector<SampleBits>& seen) {
  std::vector<Indices> candidates(seen[0].size());
  for (std::uint32_t c = 0; c < seen.size(); ++c)
    seen[c].for_each([&](std::size_t sample) { candidates[sample].push_back(c); });
  std::map<Indices, std::size_t> known;
  std::vector<SampleGroup> groups;
  for (std::uint32_t i = 0; i < candidates.size(); ++i) {
    const auto [at, is_new] = known.try_emplace(candidates[i], groups.size());
    if (is_new) groups.push_back({std::move(candidates[i])});
    ++groups[at->second].samples;
  }
  return groups;
}

// What a group asks of the candidates that see it, without some of them: Σ x ≥ times · z.
struct Demand {
  std::uint32_t group = 0;
  Indices without;
  int times = 0;  // overlap − without
  int idle = 0;   // solutions that it did not bind, up to now
};

struct DeleteProblem {
  void operator()(glp_prob* problem) const { glp_delete_prob(problem); }
};

// The relaxation with u = 1 − z, how much of a group is given up:
//   min Σ x_c,  Σ_c x_c + times · u ≥ times for each demand,  Σ samples · u ≤ spare,  0 ≤ x, u ≤ 1.
// At prices of cost ≥ 0 it is dual feasible from the start, and stays so when demands join: every
// solve is some pivots of the dual simplex method from the last one.
class Program {
 public:
  Program(std::vector<SampleGroup> groups, std::size_t candidates, int overlap, std::size_t spare,
          const RunContext& context)
      : context_(context),
        groups_(std::move(groups)),
        given_up_(groups_.size(), 0),
        shares_(candidates, 0.0),
        overlap_(overlap),
        spare_(static_cast<double>(spare)),
        problem_(glp_create_prob()) {
    glp_prob* const p = problem_.get();
    glp_add_cols(p, static_cast<int>(candidates));
    for (int c = 1; c <= static_cast<int>(candidates); ++c) {
      glp_set_col_bnds(p, c, GLP_DB, 0, 1);
      glp_set_obj_coef(p, c, 1);
    }
    glp_add_rows(p, 1);
    glp_set_row_bnds(p, kSpareRow, GLP_UP, 0, spare_);
  }

  // To the end by the demands that have joined. False when the pivots are used up.
  bool pivot(int& pivots) {
    context_.throw_if_cancelled();
    glp_smcp how;
    glp_init_smcp(&how);
    how.msg_lev = GLP_MSG_OFF;
    how.meth = GLP_DUAL;
    how.it_lim = std::max(pivots, 0);
    const int before = glp_get_it_cnt(problem_.get());
    const int trouble = glp_simplex(problem_.get(), &how);
    pivots -= glp_get_it_cnt(problem_.get()) - before;
    for (std::uint32_t c = 0; c < shares_.size(); ++c)
      shares_[c] = std::clamp(glp_get_col_prim(problem_.get(), column_of(c)), 0.0, 1.0);
    return trouble == 0 && glp_get_status(problem_.get()) == GLP_OPT;
  }

  // By all demands, or till the pivots are used up.
  void solve(int pivots) {
    while (pivot(pivots) && join_violated()) {
    }
  }

  // False when nothing is violated.
  bool join_violated() {
    const std::vector<Demand> violated = violated_demands();
    if (violated.empty()) return false;
    drop_idle();
    for (const Demand& demand : violated) add(demand);
    return true;
  }

  // What the prices prove: they are worth Σ price · times − the most that giving up `spare` samples
  // saves, and a candidate is paid by the demands that it answers.
  double proved_bound() const {
    std::vector<double> saved(groups_.size(), 0.0), paid(shares_.size(), 0.0);
    for (std::size_t d = 0; d < demands_.size(); ++d) {
      const Demand& demand = demands_[d];
      saved[demand.group] += price(d) * demand.times;
      for (const std::uint32_t c : answering(demand)) paid[c] += price(d);
    }
    const double worth = std::accumulate(saved.begin(), saved.end(), 0.0) - most_saved(saved);
    return best_scaled_bound(worth, std::move(paid));
  }

 private:
  static constexpr int kSpareRow = 1;
  static int row_of(std::size_t demand) { return kSpareRow + 1 + static_cast<int>(demand); }
  static int column_of(std::uint32_t candidate) { return static_cast<int>(candidate) + 1; }

  double price(std::size_t demand) const {
    return std::max(0.0, glp_get_row_dual(problem_.get(), row_of(demand)));
  }

  // Demands that have been met with room to spare for some time: pivots cost by all that are there.
  void drop_idle() {
    constexpr int kPatience = 3;
    std::vector<int> rows = {0};
    std::size_t kept = 0;
    for (std::size_t d = 0; d < demands_.size(); ++d) {
      const int row = row_of(d);
      Demand& demand = demands_[d];
      demand.idle = glp_get_row_stat(problem_.get(), row) == GLP_BS ? demand.idle + 1 : 0;
      if (demand.idle >= kPatience)
        rows.push_back(row);
      else if (kept != d)
        demands_[kept] = std::move(demand);
      kept += demand.idle < kPatience;
    }
    if (rows.size() == 1) return;
    demands_.resize(kept);
    glp_del_rows(problem_.get(), static_cast<int>(rows.size()) - 1, rows.data());
  }

  // The demand of a group that the shares violate most, and by how much. A camera does for a group
  // what it does once: without the k that have the largest shares, the others must still see it
  // overlap − k times. With shares of 0 and 1 these demands are exact.
  double most_violated(std::uint32_t group, Demand& demand) const {
    const Indices& candidates = groups_[group].candidates;
    const double kept =
        given_up_[group] ? 1 - glp_get_col_prim(problem_.get(), given_up_[group]) : 1;
    double left = 0;
    for (const std::uint32_t c : candidates) left += shares_[c];
    demand = {group, {}, overlap_};
    double most = demand.times * kept - left;
    Indices without;
    for (int times = overlap_ - 1; times > 0 && without.size() < candidates.size(); --times) {
      std::uint32_t largest = ~std::uint32_t{0};
      for (const std::uint32_t c : candidates) {
        if (std::find(without.begin(), without.end(), c) != without.end()) continue;
        if (largest == ~std::uint32_t{0} || shares_[c] > shares_[largest]) largest = c;
      }
      without.push_back(largest);
      left -= shares_[largest];
      if (times * kept - left <= most) continue;
      most = times * kept - left;
      demand = {group, without, times};
    }
    return most;
  }

  // Of every stretch of groups the one that is violated most.
  std::vector<Demand> violated_demands() const {
    const std::size_t stretches = std::max(kFewestStretches, demands_.size() / 2);
    std::vector<Demand> violated;
    for (std::size_t s = 0; s < stretches; ++s) {
      double most = kViolated;
      Demand worst, demand;
      for (std::size_t p = s * groups_.size() / stretches; p < (s + 1) * groups_.size() / stretches;
           ++p) {
        const double by = most_violated(static_cast<std::uint32_t>(p), demand);
        if (by > most) most = by, worst = demand;
      }
      if (most > kViolated) violated.push_back(worst);
    }
    return violated;
  }

  Indices answering(const Demand& demand) const {
    Indices candidates = groups_[demand.group].candidates;
    for (const std::uint32_t c : demand.without) std::erase(candidates, c);
    return candidates;
  }

  void add(const Demand& demand) {
    glp_prob* const p = problem_.get();
    int& given_up = given_up_[demand.group];
    if (given_up == 0) {
      given_up = glp_add_cols(p, 1);
      glp_set_col_bnds(p, given_up, GLP_DB, 0, 1);
      const int row[] = {0, kSpareRow};
      const double samples[] = {0, groups_[demand.group].samples};
      glp_set_mat_col(p, given_up, 1, row, samples);
    }
    std::vector<int> columns = {0, given_up};
    std::vector<double> values = {0, double(demand.times)};
    for (const std::uint32_t c : answering(demand)) {
      columns.push_back(column_of(c));
      values.push_back(1);
    }
    const int row = glp_add_rows(p, 1);
    glp_set_row_bnds(p, row, GLP_LO, demand.times, 0);
    glp_set_mat_row(p, row, static_cast<int>(columns.size()) - 1, columns.data(), values.data());
    demands_.push_back(demand);
  }

  // By giving up groups, the last one in part, of `spare` samples in all.
  double most_saved(const std::vector<double>& saved) const {
    std::vector<std::pair<double, double>> by_sample;  // saved per sample, samples
    for (std::size_t p = 0; p < saved.size(); ++p) {
      if (saved[p] > 0) by_sample.push_back({saved[p] / groups_[p].samples, groups_[p].samples});
    }
    std::sort(by_sample.begin(), by_sample.end(), std::greater<>());
    double sum = 0, left = spare_;
    for (const auto& [each, samples] : by_sample) {
      sum += each * std::min(samples, left);
      left -= std::min(samples, left);
    }
    return sum;
  }

  const RunContext& context_;
  std::vector<SampleGroup> groups_;
  std::vector<int> given_up_;    // column of each group, 0 = none yet
  std::vector<Demand> demands_;  // rows of the program after the first
  std::vector<double> shares_;
  int overlap_;
  double spare_;  // samples that may be given up
  std::unique_ptr<glp_prob, DeleteProblem> problem_;
};

}  // namespace

double simplex_cover_bound(const std::vector<SampleBits>& seen, const CoverGoal& goal,
                           int most_pivots, const RunContext& context) {
  if (goal.samples == 0 || seen.empty()) return 0;
  glp_term_out(GLP_OFF);
  const std::size_t all = seen[0].size();
  Program program(groups_of(seen), seen.size(), goal.overlap, all - std::min(all, goal.samples),
                  context);
  program.solve(most_pivots);
  return program.proved_bound();
}

}  // namespace organbake
