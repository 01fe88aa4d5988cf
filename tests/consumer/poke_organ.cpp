// SPDX-License-Identifier: Apache-2.0
// A simulator's loop in forty lines: poke_organ BUNDLE PICTURE.ppm presses a probe into the organ
// from the viewer's side and writes what the viewer then sees; the force is on stdout.
#include <organbake/player/embedded_player.h>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: poke_organ BUNDLE PICTURE.ppm\n"), 2;
  organbake::EmbeddedPlayer organ(argv[1]);
  constexpr int kWidth = 320, kHeight = 240;
  const auto camera = organ.camera_on_orbit(0, 0, kWidth, kHeight);

  // The proxy's vertex that is nearest to the viewer: its depth is the last row of the pose.
  const auto& pose = camera.camera_from_world;
  const auto depth = [&](const std::array<double, 3>& p) {
    return pose[8] * p[0] + pose[9] * p[1] + pose[10] * p[2] + pose[11];
  };
  std::array<double, 3> nearest = organ.vertex_mm(0);
  for (std::size_t v = 1; v < organ.vertex_count(); ++v)
    if (depth(organ.vertex_mm(v)) < depth(nearest)) nearest = organ.vertex_mm(v);

  constexpr double kRadius_mm = 5;
  double force_n = 0;
  for (int step = 0; step <= 60; ++step) {
    const double way_mm = -kRadius_mm - 20 + 0.7 * step;  // along the view, from outside
    organbake::EmbeddedPlayer::Tip tip{nearest, kRadius_mm};
    for (int k = 0; k < 3; ++k) tip.position_mm[k] += way_mm * pose[8 + k];
    const auto f = organ.step({tip}).force_n[0];
    force_n = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  }

  std::vector<std::uint8_t> pixels(std::size_t{3} * kWidth * kHeight);
  organ.draw(camera, pixels.data(), std::size_t{3} * kWidth);
  std::ofstream file(argv[2], std::ios::binary);
  file << "P6\n" << kWidth << " " << kHeight << "\n255\n";
  file.write(reinterpret_cast<const char*>(pixels.data()), static_cast<long>(pixels.size()));
  std::printf("%.3f\n", force_n);
  return file.good() ? 0 : 1;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "poke_organ: %s\n", error.what()), 1;
}
