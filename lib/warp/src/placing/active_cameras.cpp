// SPDX-License-Identifier: Apache-2.0
// The shell as it is posed, and the cameras that draw it in a view: their patches placed, culled
// and counted.
#include <algorithm>
#include <mutex>
#include <utility>

#include "organbake/core/parallel.h"
#include "placing/placing.h"

namespace organbake {
namespace {

// What makes a face two-sided: a corner pushed by more than this share of the organ's size, and a
// normal farther from the mean of its corners' than 6°.
constexpr double kPushedShare = 0.02, kBentCosine = 0.995;

// 1 at 0, 0 from 1 on.
double bell(double x) { return std::abs(x) < 1 ? (1 - x * x) * (1 - x * x) : 0; }

// Where a fold brings a point of skin that is drawn by points `apart_mm` apart: a narrower one
// would fall between those. To its sides skin comes nearer to the ridge, which rises about as high
// as the skin that it is made of reaches: so that is hardly stretched. It ends softly along the
// ridge, and in depth, where an organ's other side lies.
Eigen::Vector3d folded(const Eigen::Vector3d& point, const SkinFold& fold, double apart_mm) {
  constexpr double kDrawn = 0.75, kHeight = 1.2;  // shares of the way to the ridge; of its reach
  constexpr double kWide = 3, kSteep = 1.6, kLong = 2.2, kDeep = 2.5;  // where it ends, in reaches
  const double reach = std::max(fold.reach_mm, apart_mm);
  const Eigen::Vector3d from = (point - fold.middle_mm) / reach;
  const double up = from.dot(fold.outward), on = from.dot(fold.along);
  const double share = fold.closed * reach * bell(on / kLong) * bell(up / kDeep);
  const Eigen::Vector3d aside = from - up * fold.outward - on * fold.along;
  const double far = aside.norm();
  return point +
         share * (kHeight * bell(far / kSteep) * fold.outward - kDrawn * bell(far / kWide) * aside);
}

}  // namespace

PosedShell::PosedShell(ShellSurface shell)
    : shell_(std::move(shell)),
      pushed_mm_(kPushedShare * bounds(at_rest()).diagonal()),
      proxy_positions_(shell_.proxy().vertices),
      posed_(at_rest()),
      normals_(vertex_normals(posed_)),
      matrices_(posed_.faces.size()),
      revisions_(posed_.faces.size(), 0),
      two_sided_(posed_.faces.size(), 0),
      faces_of_(posed_.faces, posed_.vertices.size()) {
  for (std::uint32_t f = 0; f < matrices_.size(); ++f)
    matrices_[f] = shell_matrix(posed_, normals_, f);
  if (!shell_.skin()) return;
  for (const Face& face : at_rest().faces)
    edge_mm_ += (at_rest().vertices[face[1]] - at_rest().vertices[face[0]]).norm();
  edge_mm_ /= static_cast<double>(at_rest().faces.size());
}

bool PosedShell::pose(const std::vector<Eigen::Vector3d>& proxy_positions,
                      const std::vector<SkinFold>& folds) {
  if (proxy_positions == proxy_positions_ && folds == folds_) return false;
  ++poses_;
  proxy_positions_ = proxy_positions;
  folds_ = folds;
  shell_.pose(proxy_positions_, next_vertices_);
  if (shell_.skin() && !gradients_) {  // at rest nobody asks for them
    gradients_.emplace(at_rest());
    gradient_changes_.assign(normals_.size(), Eigen::Matrix3d::Zero());
  }
  if (gradients_)
    for (const SkinFold& fold : folds_)
      for (Eigen::Vector3d& point : next_vertices_) point = folded(point, fold, edge_mm_);
  std::swap(posed_.vertices, next_vertices_);
  const bool first = corner_normals_.empty();
  corner_normals_.resize(posed_.faces.size());
  face_changed_.resize(posed_.faces.size());
  vertex_changed_.resize(posed_.vertices.size());
  const auto faces = static_cast<std::uint32_t>(posed_.faces.size());
  constexpr std::uint32_t kGrain = 256;  // faces or vertices
  // Moved vertices change their faces, those all their corners' normals, and these their faces.
  parallel_each(0u, faces, kGrain, [&](std::uint32_t f) {
    const Face& face = posed_.faces[f];
    face_changed_[f] = std::any_of(face.begin(), face.end(), [this](std::uint32_t v) {
      return posed_.vertices[v] != next_vertices_[v];
    });
    if (face_changed_[f] || first) corner_normals_[f] = corner_normals(posed_, f);
  });
  parallel_each(
      0u, static_cast<std::uint32_t>(posed_.vertices.size()), kGrain, [this](std::uint32_t v) {
        const auto around = faces_of_.of(v);
        vertex_changed_[v] = std::any_of(around.begin(), around.end(),
                                         [this](std::uint32_t f) { return face_changed_[f] != 0; });
        if (vertex_changed_[v]) set_vertex(v);
      });
  parallel_each(0u, faces, kGrain, [this](std::uint32_t f) {
    const Face& face = posed_.faces[f];
    if (std::any_of(face.begin(), face.end(),
                    [this](std::uint32_t v) { return vertex_changed_[v] != 0; }))
      set_face(f);
  });
  return true;
}

void PosedShell::set_vertex(std::uint32_t vertex) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // as vertex_normals() has it
  for (const std::uint32_t f : faces_of_.of(vertex)) {
    const Face& face = posed_.faces[f];
    sum += corner_normals_[f][face[0] == vertex ? 0 : face[1] == vertex ? 1 : 2];
  }
  const double length = sum.norm();
  normals_[vertex] = length > 0 ? Eigen::Vector3d(sum / length) : Eigen::Vector3d::UnitZ();
  if (!gradients_) return;
  gradient_changes_[vertex] = shell_.skin()->is_creased(vertex)
                                  ? unknown_change()
                                  : gradients_->change(vertex, posed_.vertices, normals_);
}

void PosedShell::set_face(std::uint32_t face) {
  matrices_[face] = shell_matrix(posed_, normals_, face);
  if (gradients_) bend_face(at_rest(), face, gradient_changes_, matrices_[face]);
  two_sided_[face] = bent_over(face);
  ++revisions_[face];
}

bool PosedShell::bent_over(std::uint32_t f) const {
  const Face& face = posed_.faces[f];
  const bool pushed = std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
    return (posed_.vertices[v] - at_rest().vertices[v]).norm() > pushed_mm_;
  });
  if (!pushed) return false;
  const Eigen::Vector3d skin = normals_[face[0]] + normals_[face[1]] + normals_[face[2]];
  return face_normal(posed_, f).dot(skin) < kBentCosine * skin.norm();
}

void ActiveCameras::choose(SampleStore& store, const ViewWeights& weights) {
  count_ = 0;
  for (int i = 0; i < 3; ++i) {
    if (weights.weights[i] <= 0) continue;
    cameras_[count_].set = &store.made(weights.cameras[i]);
    cameras_[count_++].weight = static_cast<float>(weights.weights[i]);
  }
}

float ActiveCameras::texel_mm() const {
  double sum = 0, shares = 0;
  for (const ActiveCamera& camera : all()) {
    if (camera.set->sample_count == 0) continue;
    sum += camera.weight * camera.set->texel_mm;
    shares += camera.weight;
  }
  return shares > 0 ? static_cast<float>(sum / shares) : 1;
}

VisibilitySummary ActiveCameras::place(const PlacedFaces& faces, const View& view,
                                       const TileGrid& grid, DirtyCells& cells,
                                       DrawReport& report) {
  VisibilitySummary visibility;
  visibility.shown.assign(faces.size(), 0);
  std::mutex mutex;
  parallel_for(std::size_t{0}, count_, [&](std::size_t number) {
    ActiveCamera& camera = cameras_[number];
    const PatchTable& patches = camera.set->patches;
    camera.chunks.resize(camera.set->chunks.size());
    const auto mark_moved = [&](std::size_t c, std::size_t last) {
      if (!faces.continued()) return;
      for (; c < last; ++c)
        if (faces.moved(patches.face(c))) cells.mark(camera.chunks[c].box);
    };
    const auto place_batch = [&](std::size_t first, std::size_t last) {
      if (!faces.any_moved(patches, first, last)) return;
      mark_moved(first, last);
      place_patches(patches, first, static_cast<int>(last - first), faces.all(), view,
                    &camera.chunks[first]);
      mark_moved(first, last);
    };
    const auto count_chunks = [&](std::size_t c, std::size_t last) {
      // In registers: a box in memory is a chain of loads that wait for stores.
      PixelBox box;
      std::size_t samples = 0;
      for (; c < last; ++c) {
        const ChunkFrame& chunk = camera.chunks[c];
        if (chunk.visibility != ChunkVisibility::drawn) continue;
        // From any thread: faces of several chunks may be the same.
        __atomic_store_n(&visibility.shown[patches.face(c)], std::uint8_t{1}, __ATOMIC_RELAXED);
        samples += camera.set->chunks[c].count;
        box = united(box, chunk.box);
      }
      const std::lock_guard lock(mutex);  // whole numbers: in any order
      visibility.box = united(visibility.box, box);
      report.samples_drawn += samples;
    };
    constexpr std::size_t kGrain = 4 * kPatchBatch;
    parallel_pieces(std::size_t{0}, camera.chunks.size(), kGrain,
                    [&](std::size_t first, std::size_t last) {
                      for (std::size_t c = first; c < last; c += kPatchBatch)
                        place_batch(c, std::min(last, c + kPatchBatch));
                      count_chunks(first, last);
                    });
    // From near, or from within the organ, chunks that face away would hang before what lies behind
    // as loose texels; the base layer draws what of their faces does not.
    camera.tiles.build(grid, static_cast<std::uint32_t>(camera.chunks.size()),
                       [&](std::uint32_t c) {
                         return camera.chunks[c].left_to_base ? PixelBox() : camera.chunks[c].box;
                       });
  });
  return visibility;
}

}  // namespace organbake
