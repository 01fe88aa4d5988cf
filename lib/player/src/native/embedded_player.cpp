// SPDX-License-Identifier: Apache-2.0
// The player behind a header that shows the standard library alone, for programs that must not see
// Eigen or our types: every call changes the caller's types into ours and back.
#include "organbake/player/embedded_player.h"

#include <cstring>
#include <filesystem>
#include <optional>
#include <span>

#include "organbake/core/error.h"
#include "organbake/player/embedded_types.h"
#include "organbake/player/held_tools.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"

namespace organbake {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

DeformOptions options_for(const EmbeddedPlayer::Options& given) {
  DeformOptions options;
  options.time_step_s = given.time_step_s;
  if (given.springs) options.solver = TissueSolver::springs;
  if (given.finite_elements) options.solver = TissueSolver::fem;
  options.check();  // before a bundle is read
  return options;
}

View view_of(const EmbeddedPlayer::Camera& camera) {
  View view;
  view.camera.intrinsics = {camera.width, camera.height, camera.fx,
                            camera.fy,    camera.cx,     camera.cy};
  const Eigen::Map<const Matrix34> pose(camera.camera_from_world.data());
  view.camera.camera_from_world = {pose.leftCols<3>(), pose.col(3)};
  return view;
}

// Those behind `usual` stand in the order of DrawnLight.
std::optional<DrawnLight> light_of(EmbeddedPlayer::Options::Light light) {
  if (light == EmbeddedPlayer::Options::Light::usual) return std::nullopt;
  return static_cast<DrawnLight>(static_cast<int>(light) - 1);
}

template <class Number>
std::span<const Number> numbers_at(const Number* xyz, std::size_t points) {
  if (xyz == nullptr) throw UsageError("there are no positions: the pointer to them is null");
  return {xyz, 3 * points};
}

}  // namespace

struct EmbeddedPlayer::Impl {
  Player player;
  std::optional<DrawnLight> light;
  double time_step_s;
  double time_s = 0;                    // of all steps
  std::optional<HeldTools> tools = {};  // once some were drawn
  Frame frame = {};
};

EmbeddedPlayer::EmbeddedPlayer(const std::string& bundle_folder, double time_step_s)
    : EmbeddedPlayer(bundle_folder, Options{.time_step_s = time_step_s}) {}
EmbeddedPlayer::EmbeddedPlayer(const std::string& bundle_folder, const Options& options)
    : EmbeddedPlayer(std::vector{bundle_folder}, options) {}
EmbeddedPlayer::EmbeddedPlayer(const std::vector<std::string>& bundle_folders,
                               const Options& options)
    : impl_(new Impl{
          Player(std::vector<std::filesystem::path>(bundle_folders.begin(), bundle_folders.end()),
                 options_for(options)),
          light_of(options.light), options.time_step_s}) {}
EmbeddedPlayer::~EmbeddedPlayer() = default;
EmbeddedPlayer::EmbeddedPlayer(EmbeddedPlayer&&) noexcept = default;
EmbeddedPlayer& EmbeddedPlayer::operator=(EmbeddedPlayer&&) noexcept = default;

EmbeddedPlayer::StepResult EmbeddedPlayer::step(const std::vector<Tip>& tips) {
  const StepReport report = impl_->player.step(instruments_from(tips));
  impl_->time_s += impl_->time_step_s;
  StepResult result{{}, report.penetration_mm, report.recovered};
  result.force_n = points_of(report.tip_force_n);
  return result;
}

void EmbeddedPlayer::reset() { impl_->player.reset(); }

void EmbeddedPlayer::set_vertices(const float* xyz_mm, std::size_t vertices, std::size_t organ) {
  impl_->player.set_vertices(numbers_at(xyz_mm, vertices), organ);
}
void EmbeddedPlayer::set_vertices(const double* xyz_mm, std::size_t vertices, std::size_t organ) {
  impl_->player.set_vertices(numbers_at(xyz_mm, vertices), organ);
}
void EmbeddedPlayer::set_nodes(const float* xyz_mm, std::size_t nodes, std::size_t organ) {
  impl_->player.set_nodes(numbers_at(xyz_mm, nodes), organ);
}
void EmbeddedPlayer::set_nodes(const double* xyz_mm, std::size_t nodes, std::size_t organ) {
  impl_->player.set_nodes(numbers_at(xyz_mm, nodes), organ);
}

EmbeddedPlayer::Mesh EmbeddedPlayer::mesh(std::size_t organ) const {
  return organ_mesh(impl_->player.bundle_now(organ));
}

std::vector<EmbeddedPlayer::Point> EmbeddedPlayer::contact_force_n(const std::vector<Tip>& tips,
                                                                   std::size_t organ) {
  return points_of(impl_->player.contact_force_n(instruments_from(tips), organ));
}
std::vector<EmbeddedPlayer::Point> EmbeddedPlayer::contact_force_on_nodes_n(
    const std::vector<Tip>& tips, std::size_t organ) {
  return points_of(forces_on_nodes(impl_->player.bundle_now(organ),
                                   impl_->player.contact_force_n(instruments_from(tips), organ)));
}

EmbeddedPlayer::Camera EmbeddedPlayer::camera_on_orbit(double azimuth_rad, double elevation_rad,
                                                       int width, int height) const {
  const View view =
      orbit_view(impl_->player.bundle().cameras, {azimuth_rad, elevation_rad}, width, height);
  const Intrinsics& lens = view.camera.intrinsics;
  Camera camera{width, height, lens.fx, lens.fy, lens.cx, lens.cy, {}};
  const RigidTransform& pose = view.camera.camera_from_world;
  Eigen::Map<Matrix34>(camera.camera_from_world.data()) << pose.rotation, pose.translation;
  return camera;
}

void EmbeddedPlayer::draw(const Camera& camera, std::uint8_t* pixels, std::size_t row_bytes) {
  draw(camera, {}, pixels, row_bytes);
}

void EmbeddedPlayer::draw(const Camera& camera, const std::vector<Tip>& tools, std::uint8_t* pixels,
                          std::size_t row_bytes) {
  if (pixels == nullptr) throw UsageError("a frame needs memory to be drawn into");
  const View view = view_of(camera);
  view.check();
  const std::size_t width_bytes = std::size_t{3} * camera.width;
  if (row_bytes < width_bytes) {
    throw UsageError("rows of " + std::to_string(camera.width) + " pixels take " +
                     std::to_string(width_bytes) + " bytes, the caller's are " +
                     std::to_string(row_bytes) + " apart");
  }
  DrawOptions options;
  options.light = impl_->light;
  const std::vector<Instrument> instruments = instruments_from(tools);
  check_instruments(instruments);
  if (!tools.empty()) {
    if (!impl_->tools) impl_->tools.emplace(impl_->player);
    options.solids = impl_->tools->solids(instruments, view, impl_->time_s);
  }
  impl_->player.draw(view, options, impl_->frame);
  impl_->player.load_ahead();  // the first frame doesn't wait for it, the next views won't either
  for (int y = 0; y < camera.height; ++y)
    std::memcpy(pixels + y * row_bytes, impl_->frame.color.at(0, y), width_bytes);
}

std::size_t EmbeddedPlayer::vertex_count(std::size_t organ) const {
  return impl_->player.proxy_positions(organ).size();
}

std::array<double, 3> EmbeddedPlayer::vertex_mm(std::size_t vertex, std::size_t organ) const {
  const std::vector<Eigen::Vector3d>& positions = impl_->player.proxy_positions(organ);
  if (vertex >= positions.size()) {
    throw UsageError("there is no vertex " + std::to_string(vertex) + " of " +
                     std::to_string(positions.size()));
  }
  const Eigen::Vector3d& v = positions[vertex];
  return {v.x(), v.y(), v.z()};
}

}  // namespace organbake
