// SPDX-License-Identifier: Apache-2.0
// A solver of one's own moves a baked organ: drive_organ BUNDLE PICTURE.ppm. Springs of the
// bundle's mesh, stepped by symplectic Euler; the player tells what a tool's contact pushes, and
// draws.
#include <organbake/player/embedded_player.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>

using organbake::EmbeddedPlayer;
using Point = EmbeddedPlayer::Point;

struct SpringSolver {
  EmbeddedPlayer::Mesh mesh;
  std::vector<Point> x = mesh.vertices_mm, velocity = std::vector<Point>(x.size());  // mm, mm/s

  // Under forces on the vertices (N): springs pull, a hundredth of the speed is lost, anchors stay.
  void step(std::vector<Point> force_n, double time_step_s) {
    for (std::size_t s = 0; s < mesh.spring_ends.size(); ++s) {
      const auto [a, b] = mesh.spring_ends[s];
      const double along[3] = {x[b][0] - x[a][0], x[b][1] - x[a][1], x[b][2] - x[a][2]};
      const double length = std::hypot(along[0], along[1], along[2]);
      const double pull_n =
          mesh.spring_stiffness_n_per_mm[s] * (length - mesh.spring_length_mm[s]) / length;
      for (int k = 0; k < 3; ++k)
        force_n[a][k] += pull_n * along[k], force_n[b][k] -= pull_n * along[k];
    }
    for (const auto anchor : mesh.vertex_anchors) force_n[anchor] = velocity[anchor] = {};
    for (std::size_t v = 0; v < x.size(); ++v) {
      for (int k = 0; k < 3; ++k) {
        velocity[v][k] = 0.99 * velocity[v][k] +
                         time_step_s * 1000 * force_n[v][k] / mesh.vertex_mass_kg[v];  // N: kg·m/s²
        x[v][k] += time_step_s * velocity[v][k];
      }
    }
  }
};

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: drive_organ BUNDLE PICTURE.ppm\n"), 2;
  EmbeddedPlayer organ(argv[1]);
  SpringSolver solver{organ.mesh()};
  constexpr int kWidth = 320, kHeight = 240, kSubsteps = 40;
  constexpr double kFrame_s = 1.0 / 60, kRadius_mm = 8;
  const auto camera = organ.camera_on_orbit(0, 0, kWidth, kHeight);
  const double* sight = &camera.camera_from_world[8];
  Point top = solver.x[0];  // the vertex nearest to the eye
  const auto depth = [&](const Point& p) {
    return sight[0] * p[0] + sight[1] * p[1] + sight[2] * p[2];
  };
  for (const Point& p : solver.x)
    if (depth(p) < depth(top)) top = p;

  EmbeddedPlayer::Tip tip{top, kRadius_mm};
  double most_n = 0;
  for (int frame = 0; frame < 40; ++frame) {
    for (int k = 0; k < 3; ++k) tip.position_mm[k] = top[k] + (0.3 * frame - kRadius_mm) * sight[k];
    organ.set_vertices(solver.x.front().data(), solver.x.size());
    const std::vector<Point> pushed_n = organ.contact_force_n({tip});
    for (const Point& f : pushed_n) most_n = std::max(most_n, std::hypot(f[0], f[1], f[2]));
    for (int i = 0; i < kSubsteps; ++i) solver.step(pushed_n, kFrame_s / kSubsteps);
  }

  organ.set_vertices(solver.x.front().data(), solver.x.size());
  std::vector<std::uint8_t> pixels(std::size_t{3} * kWidth * kHeight);
  organ.draw(camera, {tip}, pixels.data(), std::size_t{3} * kWidth);
  std::ofstream file(argv[2], std::ios::binary);
  file << "P6\n" << kWidth << " " << kHeight << "\n255\n";
  file.write(reinterpret_cast<const char*>(pixels.data()), static_cast<long>(pixels.size()));
  double moved_mm = 0;
  for (std::size_t v = 0; v < solver.x.size(); ++v) {
    const Point &a = solver.x[v], &b = solver.mesh.vertices_mm[v];
    moved_mm = std::max(moved_mm, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
  }
  std::printf("%.3f N at most on a vertex, moved %.3f mm\n", most_n, moved_mm);
  return file.good() ? 0 : 1;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "drive_organ: %s\n", error.what()), 1;
}
