// SPDX-License-Identifier: Apache-2.0
#include "dataset_plan.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>

#include "organbake/core/random.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

std::string name_of(std::filesystem::path bundle, std::size_t number) {
  bundle = bundle.lexically_normal();
  if (!bundle.has_filename()) bundle = bundle.parent_path();
  std::string name = bundle.filename().string();
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
  return padded(number, 2) + "_" + name;
}

void choose_tests(const DatasetSpec& spec, std::vector<DatasetOrgan>& organs) {
  const std::size_t count = organs.size();
  if (count < 2 || spec.test_share == 0) return;
  const auto wanted = static_cast<std::size_t>(std::lround(spec.test_share * double(count)));
  const std::size_t tests = std::clamp<std::size_t>(wanted, 1, count - 1);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  RandomStream random(spec.seed, ~std::uint64_t{0});
  for (std::size_t i = count - 1; i > 0; --i) std::swap(order[i], order[random.below(i + 1)]);
  for (std::size_t i = 0; i < tests; ++i) organs[order[i]].test = true;
}

}  // namespace

DatasetPlan plan_dataset(const DatasetSpec& spec,
                         const std::vector<std::filesystem::path>& bundles) {
  DatasetPlan plan;
  for (const auto& bundle : bundles)
    plan.organs.push_back({bundle, name_of(bundle, plan.organs.size()), false});
  choose_tests(spec, plan.organs);
  const int organs = static_cast<int>(bundles.size());
  const int clips = (spec.frames + spec.clip_frames - 1) / spec.clip_frames;
  const int clips_of_shard = spec.shard_frames / spec.clip_frames;
  plan.frames = clips * spec.clip_frames;
  int before = 0;
  for (int o = 0; o < organs; ++o) {
    const int own = clips / organs + (o < clips % organs ? 1 : 0);
    for (int first = 0, shard = 0; first < own; first += clips_of_shard, ++shard) {
      const DatasetOrgan& organ = plan.organs[o];
      const int in_shard = std::min(clips_of_shard, own - first);
      plan.shards.push_back({std::size_t(o), first, in_shard,
                             std::string(organ.test ? "test/" : "train/") + organ.name + "_" +
                                 padded(std::size_t(shard), 4),
                             double(before) / clips, double(before + in_shard) / clips});
      before += in_shard;
    }
  }
  return plan;
}

}  // namespace organbake
