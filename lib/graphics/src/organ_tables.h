// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "gl_names.h"
#include "organbake/warp/warper.h"
#include "program.h"
#include "table.h"

namespace organbake {

// One camera's samples in one table, texel by texel: the slots (place, confidence, colour), what
// smooth colours need of each, and the patches, four texels each.
struct SampleTable {
  Table table{Table::Texel::words};
  int first_smooth = 0, first_patch = 0, patches = 0;
  double texel_mm = 0;

  // Uploads what it has not: of an organ that is cut further, the patches on parted faces.
  void take(const SampleSource& source, std::span<const std::uint8_t> parted);

 private:
  void put(const SampleSource& source, std::size_t first, std::size_t last);

  std::size_t room_ = 0;              // patches
  std::vector<std::uint8_t> parted_;  // by patch
};

// What graphics hardware holds of an organ, whole or as blades have cut it.
class OrganTables {
 public:
  // Of samples: those of a view are there in any case, and others that fit stay for the next views.
  static constexpr std::size_t kKept_bytes = 48'000'000;
  explicit OrganTables(const OrganSource& source, std::size_t kept_bytes = kKept_bytes);

  std::uint64_t id() const { return id_; }
  std::uint64_t whole_id() const { return whole_id_; }
  const Eigen::Vector3d& origin() const { return origin_; }
  int faces() const { return faces_; }
  int steps() const { return steps_; }
  bool is_posed(const std::vector<Eigen::Vector3d>& positions) const { return posed_ == positions; }
  // Begins a picture, whose samples() are asked for next. Uploads what is cut since the last one,
  // and the pose unless it is the last one; how normals turn only where they are lit.
  void pose(const OrganSource& source, const std::vector<Eigen::Vector3d>& positions, bool lit);
  // Until the next picture.
  const SampleTable& samples(Warper& warper, std::size_t camera);
  // For the programs that read the shell, the base layer's nodes, and the turns.
  void bind_shell(const Program& program) const;
  void bind_nodes(const Program& program) const;
  std::size_t bytes() const;

 private:
  void make_room();
  void take_nodes(const OrganSource& source);
  void put_nodes(const OrganSource& source, std::size_t first, std::size_t last);
  void fill_shells(const OrganSource& source);

  std::uint64_t id_ = 0, whole_id_;
  Eigen::Vector3d origin_;  // of the shell's numbers, world: they are small round it
  int faces_ = 0, steps_, knots_ = 3, first_knot_ = 0;
  std::size_t node_room_ = 0;              // faces
  std::vector<std::uint8_t> node_parted_;  // by face
  std::span<const std::uint8_t> parted_;   // of the picture
  Table nodes_{Table::Texel::words}, shells_{Table::Texel::floats}, turns_{Table::Texel::floats};
  struct Camera {
    SampleTable samples;
    std::uint64_t of = 0, used_in = 0;  // which id(); the last picture that asked for it
  };
  std::map<std::size_t, Camera> cameras_;
  std::size_t kept_bytes_;
  std::uint64_t picture_ = 0;
  std::vector<Eigen::Vector3d> posed_;
  bool turned_ = false;  // turns_ is of the pose
  std::vector<float> numbers_;
};

}  // namespace organbake
