// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/choose_cover.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace organbake {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kWord = SampleBits::kWordBits;

bool contains(const std::vector<std::uint32_t>& chosen, std::uint32_t candidate) {
  return std::find(chosen.begin(), chosen.end(), candidate) != chosen.end();
}

// Dearest first.
std::vector<std::uint32_t> by_price(const SampleBits& among, const std::vector<double>& prices) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < among.size(); ++i) {
    if (among.test(i)) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return prices[a] > prices[b]; });
  return order;
}

// In 1/256 of the mean price; what is free still counts a little, for it must be covered, too.
std::vector<std::uint32_t> weights_of_words(const std::vector<std::uint32_t>& order,
                                            const std::vector<double>& prices) {
  constexpr double kOne = 256, kLeast = 0.1 * kOne, kMost = 1000 * kOne;
  double mean = 0;
  for (const std::uint32_t i : order) mean += prices[i] / static_cast<double>(order.size());
  std::vector<std::uint32_t> weights;
  for (std::size_t first = 0; first < order.size(); first += kWord) {
    const std::size_t end = std::min(first + kWord, order.size());
    double sum = 0;
    for (std::size_t k = first; k < end; ++k) sum += prices[order[k]];
    const double price = mean > 0 ? sum / static_cast<double>(end - first) / mean : 1;
    weights.push_back(static_cast<std::uint32_t>(std::clamp(kOne * price, kLeast, kMost)));
  }
  return weights;
}

}  // namespace

// How often each sample is seen, up to what matters.
class CoverSearch::Counts {
 public:
  explicit Counts(const CoverSearch& search)
      : search_(search),
        times_(search.seen_.empty() ? 0 : search.seen_[0].size()),
        enough_(times_.size()),
        last_(times_.size()),
        next_(times_.size()) {}
  Counts(const CoverSearch& search, const std::vector<std::uint32_t>& chosen) : Counts(search) {
    for (const std::uint32_t c : chosen) change(c, 1);
    mark();
  }

  void add(std::uint32_t candidate) {
    change(candidate, 1);
    mark();
  }
  void remove(std::uint32_t candidate) {
    change(candidate, -1);
    mark();
  }
  std::size_t covered() const { return enough_.count(); }

  // What one more gains: samples that it completes, and a quarter for those that it brings nearer.
  std::uint64_t gain(std::uint32_t candidate) const {
    const std::span<const std::uint64_t> seen = search_.seen_[candidate].words();
    std::uint64_t sum = 0;
    for (std::size_t w = 0; w < seen.size(); ++w) {
      const std::uint64_t lacking = seen[w] & ~enough_.words()[w];
      sum += search_.word_weights_[w] *
             (std::popcount(lacking) + 3u * std::popcount(lacking & next_.words()[w]));
    }
    return sum;
  }
  // What a chosen one taken away loses.
  std::uint64_t loss(std::uint32_t candidate) const {
    const std::span<const std::uint64_t> seen = search_.seen_[candidate].words();
    std::uint64_t sum = 0;
    for (std::size_t w = 0; w < seen.size(); ++w) {
      sum += search_.word_weights_[w] * (4u * std::popcount(seen[w] & last_.words()[w]) +
                                         std::popcount(seen[w] & ~enough_.words()[w]));
    }
    return sum;
  }

 private:
  void change(std::uint32_t candidate, int by) {
    const std::span<const std::uint64_t> seen = search_.seen_[candidate].words();
    for (std::size_t w = 0; w < seen.size(); ++w) {
      for (std::uint64_t bits = seen[w]; bits; bits &= bits - 1) {
        times_[w * kWord + std::countr_zero(bits)] += static_cast<std::int16_t>(by);
      }
    }
  }

  // Bit sets of the samples seen often enough, just often enough, and once too few.
  void mark() {
    const int overlap = search_.overlap_;
    for (std::size_t w = 0; w < enough_.words().size(); ++w) {
      const std::size_t first = w * kWord, end = std::min(first + kWord, times_.size());
      std::uint64_t enough = 0, last = 0, next = 0;
      for (std::size_t i = first; i < end; ++i) {
        enough |= std::uint64_t{times_[i] >= overlap} << (i - first);
        last |= std::uint64_t{times_[i] == overlap} << (i - first);
        next |= std::uint64_t{times_[i] == overlap - 1} << (i - first);
      }
      enough_.words()[w] = enough;
      last_.words()[w] = last;
      next_.words()[w] = next;
    }
  }

  const CoverSearch& search_;
  std::vector<std::int16_t> times_;
  SampleBits enough_, last_, next_;
};

namespace {

// The candidate of the largest value, the lowest index at ties; kNone when none is allowed or all
// are worth nothing.
template <class Allowed, class Value>
std::uint32_t best_of(std::size_t candidates, const Allowed& allowed, const Value& value) {
  std::vector<std::uint64_t> values(candidates, 0);
  constexpr std::size_t kGrain = 128;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates, kGrain), [&](const auto& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      const auto candidate = static_cast<std::uint32_t>(c);
      if (allowed(candidate)) values[c] = value(candidate);
    }
  });
  const auto best = std::max_element(values.begin(), values.end());
  if (best == values.end() || *best == 0) return kNone;
  return static_cast<std::uint32_t>(best - values.begin());
}

template <class Allowed, class Loss>
std::uint32_t least_of(const std::vector<std::uint32_t>& chosen, const Allowed& allowed,
                       const Loss& loss) {
  std::uint32_t best = kNone;
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint32_t c : chosen) {
    if (!allowed(c)) continue;
    const std::uint64_t lost = loss(c);
    if (lost < least || (lost == least && c < best)) {
      least = lost;
      best = c;
    }
  }
  return best;
}

constexpr auto kAnyOne = [](std::uint32_t) { return true; };

}  // namespace

CoverSearch::CoverSearch(const std::vector<SampleBits>& seen, const SampleBits& among,
                         const CoverRelaxation& relaxation, int overlap)
    : seen_(seen.size()), rounded_(relaxation.rounded), overlap_(overlap) {
  constexpr double kUsed = 1e-3;
  for (std::uint32_t c = 0; c < relaxation.shares.size(); ++c) {
    if (relaxation.shares[c] > kUsed) used_.push_back(c);
  }
  const std::vector<std::uint32_t> order = by_price(among, relaxation.prices);
  word_weights_ = weights_of_words(order, relaxation.prices);
  tbb::parallel_for(std::size_t{0}, seen.size(), [&](std::size_t c) {
    seen_[c] = SampleBits(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      if (seen[c].test(order[k])) seen_[c].set(k);
    }
  });
}

std::size_t CoverSearch::covered(const std::vector<std::uint32_t>& chosen) const {
  return Counts(*this, chosen).covered();
}

ChosenCover CoverSearch::greedy(ChosenCover cover, const CoverGoal& goal, std::size_t most) const {
  Counts counts(*this, cover.chosen);
  cover.covered = counts.covered();
  while (cover.covered < goal.samples && cover.chosen.size() < most) {
    const std::uint32_t best = best_of(
        seen_.size(), [&](std::uint32_t c) { return !contains(cover.chosen, c); },
        [&](std::uint32_t c) { return counts.gain(c); });
    if (best == kNone) break;
    counts.add(best);
    cover.chosen.push_back(best);
    cover.covered = counts.covered();
  }
  std::sort(cover.chosen.begin(), cover.chosen.end());
  return cover;
}

ChosenCover CoverSearch::pruned(std::vector<std::uint32_t> start, const CoverGoal& goal) const {
  ChosenCover cover;
  cover.chosen = std::move(start);
  cover = greedy(std::move(cover), goal, seen_.size());
  Counts counts(*this, cover.chosen);
  while (cover.chosen.size() > 1) {
    const std::uint32_t out =
        least_of(cover.chosen, kAnyOne, [&](std::uint32_t c) { return counts.loss(c); });
    counts.remove(out);
    if (counts.covered() < goal.samples) break;
    std::erase(cover.chosen, out);
    cover.covered = counts.covered();
  }
  return cover;
}

ChosenCover CoverSearch::swapped(ChosenCover start, const CoverGoal& goal, int swaps) const {
  // What was just moved rests for a while, or the search would run in circles; now and then what
  // stayed longest goes, or it would stay for ever.
  constexpr int kOldestEvery = 7;
  const int rest = static_cast<int>(start.chosen.size()) / 3 + 1;
  std::vector<int> rests_until(seen_.size(), -1);
  Counts counts(*this, start.chosen);
  ChosenCover best = start, now = std::move(start);
  for (int swap = 0; swap < swaps && best.covered < goal.samples; ++swap) {
    const auto rested = [&](std::uint32_t c) { return rests_until[c] < swap; };
    const std::uint32_t out = least_of(now.chosen, rested, [&](std::uint32_t c) -> std::uint64_t {
      if (swap % kOldestEvery != kOldestEvery - 1) return counts.loss(c);
      return static_cast<std::uint64_t>(rests_until[c] + 1);
    });
    if (out == kNone) break;
    counts.remove(out);
    const std::uint32_t in = best_of(
        seen_.size(),
        [&](std::uint32_t c) { return c != out && rested(c) && !contains(now.chosen, c); },
        [&](std::uint32_t c) { return counts.gain(c); });
    if (in == kNone) break;
    counts.add(in);
    std::replace(now.chosen.begin(), now.chosen.end(), out, in);
    rests_until[out] = swap + 2 * rest;
    rests_until[in] = swap + rest;
    now.covered = counts.covered();
    if (now.covered > best.covered) best = now;
  }
  std::sort(best.chosen.begin(), best.chosen.end());
  return best;
}

ChosenCover CoverSearch::with_one_less(const ChosenCover& start, const CoverGoal& goal,
                                       int swaps) const {
  if (start.chosen.size() < 2) return {};
  ChosenCover fewer = start;
  Counts counts(*this, start.chosen);
  const std::uint32_t out =
      least_of(start.chosen, kAnyOne, [&](std::uint32_t c) { return counts.loss(c); });
  counts.remove(out);
  std::erase(fewer.chosen, out);
  fewer.covered = counts.covered();
  fewer = swapped(std::move(fewer), goal, swaps);
  return fewer.covered >= goal.samples ? fewer : ChosenCover{};
}

ChosenCover CoverSearch::repaired(const ChosenCover& start, const CoverGoal& goal, std::size_t most,
                                  int swaps) const {
  ChosenCover cover = start;
  cover.covered = covered(cover.chosen);
  for (;;) {
    cover = swapped(std::move(cover), goal, swaps);
    if (cover.covered >= goal.samples || cover.chosen.size() >= most) return cover;
    const std::size_t before = cover.chosen.size();
    cover = greedy(std::move(cover), goal, before + 1);
    if (cover.chosen.size() == before) return cover;
  }
}

ChosenCover CoverSearch::fewest(const CoverGoal& goal, std::size_t most, int swaps) const {
  ChosenCover best = greedy({}, goal, std::min(most, seen_.size()));
  if (best.covered < goal.samples) return best;
  for (const auto& start : {used_, rounded_}) {
    ChosenCover relaxed = pruned(start, goal);
    if (relaxed.covered >= goal.samples && relaxed.chosen.size() < best.chosen.size())
      best = std::move(relaxed);
  }
  return thinned(std::move(best), goal, swaps);
}

ChosenCover CoverSearch::thinned(ChosenCover cover, const CoverGoal& goal, int swaps) const {
  for (ChosenCover fewer = with_one_less(cover, goal, swaps); !fewer.chosen.empty();
       fewer = with_one_less(cover, goal, swaps)) {
    cover = std::move(fewer);
  }
  return cover;
}

}  // namespace organbake
