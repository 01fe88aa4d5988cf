// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/filtered_detail.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// Texels of 0.25 mm at 100 mm, as a map of 1024² has them.
constexpr int kSide = 160;
constexpr double kTexel_mm = 0.25, kDepth_mm = 100;
const Intrinsics kLens = {kSide,       kSide,      kDepth_mm / kTexel_mm, kDepth_mm / kTexel_mm,
                          0.5 * kSide, 0.5 * kSide};
constexpr MicroSplit kFilters[] = {MicroSplit::gaussian, MicroSplit::bilateral, MicroSplit::guided};

template <class Depth, class Light>
CameraMaps maps_of(Depth&& depth, Light&& light) {
  CameraMaps maps;
  maps.width = maps.height = kSide;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      maps.depth_mm.push_back(static_cast<float>(depth(x, y)));
      maps.color.push_back(Eigen::Vector3f::Constant(static_cast<float>(light(x, y))));
      maps.face.push_back(std::isfinite(maps.depth_mm.back()) ? 0 : kNoFace);
    }
  }
  return maps;
}

double ripple(int x, int y) {  // waves of 2 mm
  const double turns = 2 * std::numbers::pi * kTexel_mm / 2;
  return std::sin(turns * x) * std::sin(turns * y);
}
const auto kEvenDepth = [](int, int) { return kDepth_mm; };
const auto kEvenLight = [](int, int) { return 0.5; };

// Where no border reaches.
template <class Visit>
void each_inner(Visit&& visit) {
  for (int y = kSide / 3; y < 2 * kSide / 3; ++y)
    for (int x = kSide / 3; x < 2 * kSide / 3; ++x) visit(x, y, std::size_t(y) * kSide + x);
}

TEST(FilteredDetail, IsTheRippleAndNotTheSlopeBelowIt) {
  constexpr double kAmplitude_mm = 0.2;
  const CameraMaps maps = maps_of(
      [&](int x, int y) { return kDepth_mm + 0.3 * kTexel_mm * x + kAmplitude_mm * ripple(x, y); },
      kEvenLight);
  for (const MicroSplit split : kFilters) {
    const ChannelImage detail = filtered_detail(maps, kLens, {split});
    const auto& micro = detail.find("Y")->floats();
    double worst = 0;
    each_inner([&](int x, int y, std::size_t i) {
      worst = std::max(worst, std::abs(micro[i] - kAmplitude_mm * ripple(x, y)));
    });
    EXPECT_LT(worst, 0.1 * kAmplitude_mm) << "filter " << static_cast<int>(split);
  }
}

TEST(FilteredDetail, AJumpIsNoDetailToTheFiltersThatKeepEdges) {
  const CameraMaps maps =
      maps_of([](int x, int) { return kDepth_mm + (x < kSide / 2 ? 0 : 40); }, kEvenLight);
  const auto worst = [&](MicroSplit split) {
    const ChannelImage detail = filtered_detail(maps, kLens, {split});
    double most = 0;
    each_inner([&](int, int, std::size_t i) {
      most = std::max(most, std::abs(double(detail.find("Y")->floats()[i])));
    });
    return most;
  };
  EXPECT_GT(worst(MicroSplit::gaussian), 15);
  EXPECT_LT(worst(MicroSplit::bilateral), 0.1);
  EXPECT_LT(worst(MicroSplit::guided), 2.5);
}

TEST(FilteredDetail, IntensityIsAQuotientThatNoLampChanges) {
  const auto picture = [](double lamp) {
    return maps_of(kEvenDepth, [lamp](int x, int y) {
      return lamp * (0.2 + 0.001 * x) * std::exp(0.1 * ripple(x, y));
    });
  };
  for (const MicroSplit split : kFilters) {
    const ChannelImage dim = filtered_detail(picture(0.5), kLens, {split}),
                       bright = filtered_detail(picture(1), kLens, {split});
    each_inner([&](int x, int y, std::size_t i) {
      EXPECT_NEAR(dim.find("intensity")->floats()[i], bright.find("intensity")->floats()[i], 1e-4);
      EXPECT_NEAR(std::log(dim.find("intensity")->floats()[i]), 0.1 * ripple(x, y), 0.015);
    });
  }
}

TEST(FilteredDetail, TheBackgroundTakesNoPart) {
  const auto disc = [](int x, int y) {
    return std::hypot(x - kSide / 2, y - kSide / 2) < kSide / 3
               ? kDepth_mm
               : std::numeric_limits<double>::infinity();
  };
  const CameraMaps maps = maps_of(disc, kEvenLight);
  for (const MicroSplit split : kFilters) {
    const ChannelImage detail = filtered_detail(maps, kLens, {split});
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      EXPECT_NEAR(detail.find("Y")->floats()[i], 0, 1e-3);
      EXPECT_NEAR(detail.find("intensity")->floats()[i], 1, 1e-4);
    }
  }
}

TEST(FilteredDetail, AnEmptyMapHasNone) {
  const CameraMaps maps =
      maps_of([](int, int) { return std::numeric_limits<double>::infinity(); }, kEvenLight);
  const ChannelImage detail = filtered_detail(maps, kLens, {MicroSplit::guided});
  EXPECT_EQ(detail.find("Y")->floats(), std::vector<float>(maps.face.size(), 0.0f));
}

TEST(FilteredDetail, RefusesWhatIsNoFilter) {
  const CameraMaps maps = maps_of(kEvenDepth, kEvenLight);
  EXPECT_THROW(filtered_detail(maps, kLens, {MicroSplit::proxy}), UsageError);
  EXPECT_THROW(filtered_detail(maps, kLens, {MicroSplit::gaussian, 0}), UsageError);
  EXPECT_THROW(filtered_detail(maps, kLens, {MicroSplit::gaussian, NAN}), UsageError);
}

}  // namespace
}  // namespace organbake
