// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a label sits on the tissue that it claims to mark, by the Hounsfield units below it, and
// where along the slices it would fit better.
#include "organbake/volume/read_volume.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "grid/grids.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

using VoxelIndex = std::array<int, 3>;

// A search needs the organ's shape, not every voxel of it.
constexpr std::size_t kMostSamples = 40000;
// A move that leaves this share of the label outside the CT proves nothing.
constexpr double kLeastOverlap = 0.98;
// A label that lies on soft tissue as it is moves only for the sake of a spread this much smaller.
constexpr double kFarBetter = 0.6;

// A solid organ's tissue, with and without contrast agent, and the fat in it; the share of a label
// that must be such; and its standard deviation over the label.
constexpr double kSoftTissueMin_hu = -150, kSoftTissueMax_hu = 300;
constexpr double kLeastSoftTissue = 0.95, kMostDeviation_hu = 120;

constexpr double kNotMeasured_hu = -1000;

struct Sum {
  std::size_t count = 0, soft = 0;
  double values = 0, squares = 0;

  void add(double hu) {
    ++count;
    if (std::isnan(hu)) hu = kNotMeasured_hu;
    soft += hu >= kSoftTissueMin_hu && hu <= kSoftTissueMax_hu;
    values += hu;
    squares += hu * hu;
  }
  MaskFit fit() const {
    if (count == 0) return {};
    const double n = static_cast<double>(count), mean = values / n;
    return {static_cast<double>(soft) / n, mean,
            std::sqrt(std::max(0.0, squares / n - mean * mean))};
  }
};

// CT voxels (possibly outside the CT) nearest to the label's voxels.
std::vector<VoxelIndex> label_in_ct(const Volume& ct, const Volume& mask, int label) {
  const IndexMap ct_from_mask(ct, mask);
  std::vector<VoxelIndex> found;
  const LabelBox box = bounding_box(mask, label);
  std::vector<std::vector<VoxelIndex>> slices(static_cast<std::size_t>(box.size[2]));
  parallel_for(std::size_t{0}, slices.size(), [&](std::size_t slice) {
    const int k = box.first[2] + static_cast<int>(slice);
    for (int j = box.first[1]; j < box.first[1] + box.size[1]; ++j) {
      for (int i = box.first[0]; i < box.first[0] + box.size[0]; ++i) {
        if (mask.at(i, j, k) != label) continue;
        const Eigen::Vector3d index = ct_from_mask(Eigen::Vector3d(i, j, k));
        // Clamped far outside, where no shift brings it back: a wild affine must not overflow.
        VoxelIndex& nearest = slices[slice].emplace_back();
        for (int axis = 0; axis < 3; ++axis)
          nearest[axis] = static_cast<int>(std::clamp(std::floor(index[axis] + 0.5), -1e6, 1e6));
      }
    }
  });
  found.reserve(box.label_voxels);
  for (const auto& slice : slices) found.insert(found.end(), slice.begin(), slice.end());
  return found;
}

Sum sum_at(const Volume& ct, const std::vector<VoxelIndex>& label, int shift, std::size_t step) {
  Sum sum;
  for (std::size_t n = 0; n < label.size(); n += step) {
    const auto [i, j, k0] = label[n];
    const int k = k0 + shift;
    if (i < 0 || j < 0 || k < 0 || i >= ct.size[0] || j >= ct.size[1] || k >= ct.size[2]) continue;
    sum.add(ct.at(i, j, k));
  }
  return sum;
}

bool plausible(const MaskFit& fit) {
  return fit.soft_tissue_share >= kLeastSoftTissue && fit.deviation_hu <= kMostDeviation_hu;
}

std::size_t step_through(const std::vector<VoxelIndex>& label) {
  return (label.size() + kMostSamples - 1) / kMostSamples;
}

// `sum` is of samples of the label.
bool fits(const Sum& sum, const std::vector<VoxelIndex>& label) {
  const std::size_t step = step_through(label), samples = (label.size() + step - 1) / step;
  // Air is more uniform than any organ: only places that are plausible compete.
  return static_cast<double>(sum.count) >= kLeastOverlap * static_cast<double>(samples) &&
         plausible(sum.fit());
}

std::optional<BetterPlace> search_better(const Volume& ct, const std::vector<VoxelIndex>& label,
                                         const MaskFit& now) {
  const std::size_t step = step_through(label);
  std::optional<BetterPlace> best;
  for (int shift = 1 - ct.size[2]; shift < ct.size[2]; ++shift) {
    const Sum sum = sum_at(ct, label, shift, step);
    if (!fits(sum, label)) continue;
    const MaskFit fit = sum.fit();
    if (best && fit.deviation_hu >= best->fit.deviation_hu) continue;
    best = BetterPlace{shift, ct.direction.col(2) * ct.spacing_mm[2] * shift, fit};
  }
  if (!best || best->slices == 0) return std::nullopt;
  const bool on_tissue = now.soft_tissue_share >= kLeastSoftTissue;
  if (on_tissue && best->fit.deviation_hu > kFarBetter * now.deviation_hu) return std::nullopt;
  return best;
}

// A header moves all labels alike, so that a better place must suit most of the others: gas in a
// stomach is no displacement. The largest tell.
bool suits_others(const Volume& ct, const Volume& mask, int label, int shift) {
  constexpr std::size_t kAsked = 12;
  std::vector<LabelCount> others = count_labels(mask);
  std::erase_if(others, [&](const LabelCount& one) { return one.label == label; });
  std::stable_sort(others.begin(), others.end(),
                   [](const LabelCount& a, const LabelCount& b) { return a.voxels > b.voxels; });
  others.resize(std::min(kAsked, others.size()));
  int content = 0, moving = 0;
  for (const LabelCount& other : others) {
    const std::vector<VoxelIndex> voxels = label_in_ct(ct, mask, other.label);
    const std::size_t step = step_through(voxels);
    const Sum here = sum_at(ct, voxels, 0, step), there = sum_at(ct, voxels, shift, step);
    const bool fits_here = fits(here, voxels);
    const bool far_better = there.fit().deviation_hu < kFarBetter * here.fit().deviation_hu;
    if (fits(there, voxels) && (!fits_here || far_better)) {
      ++moving;
    } else if (fits_here) {
      ++content;
    }
  }
  return moving > content || content == 0;  // bones fit nowhere and tell nothing
}

std::string vector_text(const Eigen::Vector3d& vector) {
  const Eigen::Vector3d v = vector + Eigen::Vector3d::Zero();  // −0 becomes 0
  return "(" + to_text(v.x(), 1) + ", " + to_text(v.y(), 1) + ", " + to_text(v.z(), 1) + ")";
}

std::string verdict(const MaskCheck& check, const Volume& ct, const Volume& mask, int label) {
  if (check.plausible) return {};
  const std::string name = name_of_label(mask, label);
  if (check.overlap_share == 0)
    return "no voxel of " + name + " lies inside the CT: the mask covers " +
           world_range_text(mask) + ", the CT " + world_range_text(ct) +
           " mm (LPS); they are not of one scan, or one header is wrong.";
  std::string text = check.better ? "the mask looks misplaced on this CT: "
                                  : "the mask may not belong to this CT: ";
  if (check.overlap_share < kLeastOverlap)
    text += "only " + percent(check.overlap_share) + " of " + name + " lies inside the CT. ";
  text += percent(check.fit.soft_tissue_share) + " of " + name + " lies on soft tissue (mean " +
          to_text(check.fit.mean_hu, 0) + " HU, spread " + to_text(check.fit.deviation_hu, 0) +
          " HU).";
  if (!check.better)
    return text +
           " That is right for bone, lung or gut; for a solid organ, check that mask, label "
           "and CT belong together.";
  const BetterPlace& better = *check.better;
  text += " Moved by " + std::to_string(better.slices) +
          " slices it fits: " + percent(better.fit.soft_tissue_share) + " soft tissue (mean " +
          to_text(better.fit.mean_hu, 0) + " HU, spread " + to_text(better.fit.deviation_hu, 0) +
          " HU).";
  const bool shares_origin = (mask.origin_mm - ct.origin_mm).norm() < ct.spacing_mm.minCoeff();
  if (shares_origin && mask.size[2] < ct.size[2])
    text += " Its header repeats the CT's origin although it holds " +
            std::to_string(mask.size[2]) + " of the CT's " + std::to_string(ct.size[2]) +
            " slices.";
  const Eigen::Vector3d origin = mask.origin_mm + better.shift_world_mm;
  return text + " Correct the mask's origin to " + vector_text(origin) + " mm (LPS), " +
         vector_text(better.shift_world_mm) + " mm from where it is.";
}

}  // namespace

MaskCheck check_mask(const Volume& ct, const Volume& mask, int label) {
  const std::vector<VoxelIndex> voxels = label_in_ct(ct, mask, label);
  if (voxels.empty()) throw_label_absent(mask, label);
  const Sum here = sum_at(ct, voxels, 0, 1);
  MaskCheck check;
  check.grids_equal = same_grid(ct, mask);
  check.overlap_share = static_cast<double>(here.count) / static_cast<double>(voxels.size());
  check.fit = here.fit();
  check.plausible = check.overlap_share >= kLeastOverlap && plausible(check.fit);
  // On the CT's own grid the mask was made in place: bone, lung and gut would only be led astray.
  if (!check.plausible && !check.grids_equal) {
    check.better = search_better(ct, voxels, check.fit);
    if (check.better && !suits_others(ct, mask, label, check.better->slices)) check.better.reset();
  }
  check.message = verdict(check, ct, mask, label);
  return check;
}

}  // namespace organbake
