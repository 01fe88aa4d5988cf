// SPDX-License-Identifier: Apache-2.0
#include "truth/moment.h"

#include "core/parallel.h"

namespace organbake {

void Moment::take(const Player& player, const View& from, const std::vector<Solid>& tools) {
  view = from;
  solids = tools;
  const RigidTransform& pose = view.camera.camera_from_world;
  bases.clear();
  for (std::size_t o = 0; o < player.organ_count(); ++o) bases.push_back(&player.bundle(o).base);
  shells.resize(player.organ_count());
  for (std::size_t o = 0; o < shells.size(); ++o) {
    const std::vector<ShellMatrix>& world = player.shell_matrices(o);
    std::vector<Columns>& placed = shells[o];
    placed.resize(world.size());
    constexpr std::size_t kGrain = 1 << 10;
    parallel_pieces(std::size_t{0}, world.size(), kGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t f = first; f < last; ++f) {
        ShellMatrix metric = pose.rotation * world[f];
        metric.col(0) += pose.translation;
        placed[f].topRows<3>() = metric.cast<float>();
        placed[f].row(3).setZero();
      }
    });
  }
}

}  // namespace organbake
