// SPDX-License-Identifier: GPL-3.0-or-later
// Choosing few cameras that cover enough: greedily at first, then by simulated annealing
// (Kirkpatrick, Gelatt and Vecchi 1983), which takes off the cameras that a greedy choice has too
// many. Sets are bits, so that a move costs a few hundred population counts.
#include "placing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "organbake/core/parallel.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

// Counts of how often each sample is seen, kept as bit planes: adding a set is a ripple-carry adder
// over words of 64 samples.

// How often each sample is seen, 64 of them at once: bit b of a sample's count is its bit in plane
// b, so that a set is added or taken away by the logic of an adder.
class SampleCounts {
 public:
  // Told apart: those below `enough` > 0, those one below it, and those at it. Never more than
  // `most_sets` sets at a time.
  SampleCounts(std::size_t samples, int enough, std::size_t most_sets);

  void add(const SampleBits& set) { change(set, true); }
  void remove(const SampleBits& set) { change(set, false); }  // one that was added

  const SampleBits& lacking() const { return lacking_; }
  const SampleBits& next() const { return next_; }
  const SampleBits& last() const { return last_; }
  std::size_t lacking_count() const { return lacking_count_; }

 private:
  void change(const SampleBits& set, bool add);
  void mark();

  std::size_t enough_;
  std::vector<SampleBits> planes_;
  SampleBits lacking_, next_, last_;
  std::size_t lacking_count_ = 0;
};

SampleCounts::SampleCounts(std::size_t samples, int enough, std::size_t most_sets)
    : enough_(static_cast<std::size_t>(enough)),
      planes_(static_cast<std::size_t>(std::bit_width(std::max(most_sets, enough_))),
              SampleBits(samples)),
      lacking_(samples),
      next_(samples),
      last_(samples) {
  mark();
}

// Digit by digit: adding carries where a 1 becomes 0, taking away borrows where a 0 becomes 1.
void SampleCounts::change(const SampleBits& set, bool add) {
  const std::uint64_t turned = add ? 0 : ~std::uint64_t{0};
  for (std::size_t w = 0; w < set.words().size(); ++w) {
    std::uint64_t carry = set.words()[w];
    for (std::size_t b = 0; b < planes_.size() && carry; ++b) {
      std::uint64_t& plane = planes_[b].words()[w];
      const std::uint64_t old = plane;
      plane ^= carry;
      carry &= old ^ turned;
    }
  }
  mark();
}

void SampleCounts::mark() {
  lacking_count_ = 0;
  const std::size_t words = lacking_.words().size();
  for (std::size_t w = 0; w < words; ++w) {
    // From the highest bit down: still like `enough`, like it less one, already below it.
    std::uint64_t like = ~std::uint64_t{0}, like_next = like, below = 0;
    for (std::size_t b = planes_.size(); b-- > 0;) {
      const std::uint64_t plane = planes_[b].words()[w];
      const bool bit = enough_ >> b & 1, bit_next = (enough_ - 1) >> b & 1;
      if (bit) below |= like & ~plane;
      like &= bit ? plane : ~plane;
      like_next &= bit_next ? plane : ~plane;
    }
    const std::size_t in_word =
        std::min(SampleBits::kWordBits, lacking_.size() - w * SampleBits::kWordBits);
    const std::uint64_t present = ~std::uint64_t{0} >> (SampleBits::kWordBits - in_word);
    lacking_.words()[w] = below & present;
    next_.words()[w] = like_next & present;
    last_.words()[w] = like & present;
    lacking_count_ += static_cast<std::size_t>(std::popcount(below & present));
  }
}

// What one more candidate gains: samples that it completes, and a quarter for those that it brings
// nearer.
std::size_t gain(const SampleBits& seen, const SampleCounts& counts) {
  return count_common(seen, counts.lacking()) + 3 * count_common(seen, counts.next());
}

using Indices = std::vector<std::uint32_t>;

// At the same time from the same start; the best is taken, whoever ends first.
constexpr std::size_t kChains = 2;
constexpr std::uint64_t kSeed = 3;
// Of the moves: so many try a candidate that sees a lacking sample, the others any one.
constexpr double kTowardsLacking = 0.9;

// The candidates that see each sample.
class CandidatesOfSamples {
 public:
  explicit CandidatesOfSamples(const CandidateVisibility& seen) : first_(seen[0].size() + 1, 0) {
    for (const SampleBits& sight : seen)
      sight.for_each([&](std::size_t sample) { ++first_[sample + 1]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    candidates_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t c = 0; c < seen.size(); ++c)
      seen[c].for_each([&](std::size_t sample) { candidates_[next[sample]++] = c; });
  }

  std::span<const std::uint32_t> of(std::size_t sample) const {
    return {candidates_.data() + first_[sample], first_[sample + 1] - first_[sample]};
  }

 private:
  std::vector<std::size_t> first_;
  Indices candidates_;
};

// A candidate's words that hold anything: hard samples are few in any one sight.
struct NonzeroWord {
  std::uint32_t word;
  std::uint64_t bits;
};
using NonzeroWords = std::vector<NonzeroWord>;

std::vector<NonzeroWords> nonzero_words_of(const CandidateVisibility& seen) {
  std::vector<NonzeroWords> words(seen.size());
  for (std::size_t c = 0; c < seen.size(); ++c) {
    for (std::uint32_t w = 0; w < seen[c].words().size(); ++w)
      if (seen[c].words()[w]) words[c].push_back({w, seen[c].words()[w]});
  }
  return words;
}

// What all chains work on.
struct CoverProblem {
  explicit CoverProblem(const CandidateVisibility& visibility)
      : seen(visibility), words(nonzero_words_of(visibility)), candidates(visibility) {}

  std::size_t samples() const { return seen[0].size(); }

  const CandidateVisibility& seen;
  std::vector<NonzeroWords> words;
  CandidatesOfSamples candidates;
};

// One of a set that is not empty; what stands alone in its word comes more often.
std::size_t any_of(const SampleBits& set, RandomStream& random) {
  for (;;) {
    const std::size_t w = random.below(set.words().size());
    std::uint64_t bits = set.words()[w];
    if (bits == 0) continue;
    for (std::uint64_t n = random.below(static_cast<std::uint64_t>(std::popcount(bits))); n > 0;
         --n)
      bits &= bits - 1;
    return w * SampleBits::kWordBits + static_cast<std::size_t>(std::countr_zero(bits));
  }
}

class Chain {
 public:
  Chain(const CoverProblem& problem, const ChosenCover& start, const CoverGoal& goal,
        std::uint64_t number)
      : problem_(problem),
        seen_(problem.seen),
        may_lack_(problem.samples() - std::min(problem.samples(), goal.samples)),
        random_(kSeed, number),
        counts_(problem.samples(), goal.overlap, start.chosen.size() + 1),
        chosen_(start.chosen),
        is_chosen_(seen_.size(), false) {
    for (const std::uint32_t c : chosen_) {
      counts_.add(seen_[c]);
      is_chosen_[c] = true;
    }
    forget_losses();
    keep();
    thin();
  }

  ChosenCover run(const Annealing& annealing, const RunContext& context) {
    const double unit =
        std::max(1.0, static_cast<double>(may_lack_) / static_cast<double>(best_.chosen.size()));
    const double moves = static_cast<double>(annealing.moves);
    double heat = 0;
    for (std::size_t move = 0; move < annealing.moves && !chosen_.empty(); ++move) {
      constexpr std::size_t kSameHeat = 1024;
      if (move % kSameHeat == 0) {
        context.throw_if_cancelled();
        heat = unit * annealing.hot *
               std::pow(annealing.cold / annealing.hot, static_cast<double>(move) / moves);
      }
      try_move(heat);
    }
    std::sort(best_.chosen.begin(), best_.chosen.end());
    return best_;
  }

 private:
  void try_move(double heat) {
    const std::uint32_t in = newcomer();
    if (is_chosen_[in]) return;
    const std::size_t place = random_.below(chosen_.size());
    const double most = -heat * std::log(1 - random_.uniform());
    if (!(more_lacking(place, in, most) <= most)) return;
    const std::uint32_t out = chosen_[place];
    counts_.remove(seen_[out]);
    counts_.add(seen_[in]);
    is_chosen_[out] = false;
    is_chosen_[in] = true;
    chosen_[place] = in;
    forget_losses();
    keep();
    thin();
  }

  std::uint32_t newcomer() {
    if (counts_.lacking_count() > 0 && random_.uniform() < kTowardsLacking) {
      const auto candidates = problem_.candidates.of(any_of(counts_.lacking(), random_));
      if (!candidates.empty()) return candidates[random_.below(candidates.size())];
    }
    return static_cast<std::uint32_t>(random_.below(seen_.size()));
  }

  // By a newcomer in the place of a chosen one; where it is more than `most`, perhaps less than it
  // is. Most newcomers are turned away by what the chosen one alone would leave lacking less all
  // that the newcomer could do about it.
  double more_lacking(std::size_t place, std::uint32_t in, double most) {
    const std::uint32_t out = chosen_[place];
    const std::uint64_t* const by_out = seen_[out].words().data();
    const std::uint64_t* const next = counts_.next().words().data();
    const std::uint64_t* const last = counts_.last().words().data();
    std::int64_t gained = 0, might_keep = 0;
    for (const auto& [w, bits] : problem_.words[in]) {
      gained += std::popcount(bits & next[w] & ~by_out[w]);
      might_keep += std::popcount(bits & last[w]);
    }
    const std::int64_t lost = loss(place);
    const auto at_least = static_cast<double>(lost - might_keep - gained);
    if (at_least > most) return at_least;
    std::int64_t kept = 0;
    for (const auto& [w, bits] : problem_.words[in])
      kept += std::popcount(bits & last[w] & by_out[w]);
    return static_cast<double>(lost - kept - gained);
  }

  // What would be lacking without a chosen one.
  std::int64_t loss(std::size_t place) {
    std::int64_t& known = losses_[place];
    if (known >= 0) return known;
    known = 0;
    for (const auto& [w, bits] : problem_.words[chosen_[place]])
      known += std::popcount(bits & counts_.last().words()[w]);
    return known;
  }
  void forget_losses() { losses_.assign(chosen_.size(), -1); }

  bool reached() const { return counts_.lacking_count() <= may_lack_; }

  // The best: first the goal, then few candidates, then many samples.
  void keep() {
    const std::size_t covered = problem_.samples() - counts_.lacking_count();
    if (chosen_.size() < best_.chosen.size() ? reached()
                                             : best_.chosen.empty() || covered > best_.covered)
      best_ = {chosen_, covered};
  }

  // One less for good, as long as the goal is reached.
  void thin() {
    while (reached() && !chosen_.empty()) {
      std::size_t least = 0;
      for (std::size_t place = 1; place < chosen_.size(); ++place)
        if (loss(place) < loss(least)) least = place;
      counts_.remove(seen_[chosen_[least]]);
      is_chosen_[chosen_[least]] = false;
      chosen_[least] = chosen_.back();
      chosen_.pop_back();
      forget_losses();
      keep();
    }
  }

  const CoverProblem& problem_;
  const CandidateVisibility& seen_;
  std::size_t may_lack_;
  RandomStream random_;
  SampleCounts counts_;
  Indices chosen_;
  std::vector<bool> is_chosen_;
  std::vector<std::int64_t> losses_;  // by place, −1: not known
  ChosenCover best_;
};

}  // namespace

ChosenCover greedy_cover(const CandidateVisibility& seen, ChosenCover cover, const CoverGoal& goal,
                         std::size_t most) {
  if (seen.empty()) return cover;
  const std::size_t samples = seen[0].size();
  most = std::min(most, seen.size());
  SampleCounts counts(samples, goal.overlap, std::max(most, cover.chosen.size()));
  std::vector<bool> taken(seen.size(), false);
  const auto take = [&](std::uint32_t c) {
    counts.add(seen[c]);
    taken[c] = true;
    cover.covered = samples - counts.lacking_count();
  };
  cover.covered = 0;
  for (const std::uint32_t c : cover.chosen) take(c);
  std::vector<std::size_t> gains(seen.size());
  while (cover.covered < goal.samples && cover.chosen.size() < most) {
    constexpr std::size_t kGrain = 128;
    parallel_each(std::size_t{0}, seen.size(), kGrain,
                  [&](std::size_t c) { gains[c] = taken[c] ? 0 : gain(seen[c], counts); });
    const auto best = std::max_element(gains.begin(), gains.end());
    if (*best == 0) break;
    const auto c = static_cast<std::uint32_t>(best - gains.begin());
    take(c);
    cover.chosen.push_back(c);
  }
  std::sort(cover.chosen.begin(), cover.chosen.end());
  return cover;
}

ChosenCover annealed_cover(const CandidateVisibility& seen, const ChosenCover& start,
                           const CoverGoal& goal, const Annealing& annealing,
                           const RunContext& context) {
  if (seen.empty() || start.chosen.empty()) return start;
  const CoverProblem problem(seen);
  std::array<ChosenCover, kChains> found;
  parallel_for(std::size_t{0}, kChains, [&](std::size_t k) {
    found[k] = Chain(problem, start, goal, k).run(annealing, context);
  });
  return *std::min_element(found.begin(), found.end(),
                           [](const ChosenCover& a, const ChosenCover& b) {
                             if (a.chosen.size() != b.chosen.size())
                               return a.chosen.size() < b.chosen.size();
                             return a.covered > b.covered;
                           });
}

}  // namespace organbake
