// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace organbake {

// The player for other programs, in one header that shows the standard library alone and stays as
// it is: load a baked organ, push it about, draw it into the caller's memory. World millimetres
// (LPS). One thread calls; drawing uses TBB's threads inside, with the same bytes for any number.
//
//   organbake::EmbeddedPlayer organ("out/liver");
//   organ.step({{.position_mm = tip}});
//   organ.draw(organ.camera_on_orbit(0.5, 0.2, 1280, 720), pixels.data(), 3 * 1280);
class EmbeddedPlayer {
 public:
  using Point = std::array<double, 3>;
  // A pinhole: x right, y down, z forward, the first pixel's centre at (0.5, 0.5).
  struct Camera {
    int width = 0, height = 0;  // px
    double fx = 0, fy = 0, cx = 0, cy = 0;
    std::array<double, 12> camera_from_world{};  // 3×4, row-major
  };
  struct Tip {
    std::array<double, 3> position_mm{};
    double radius_mm = 5;
    std::array<double, 3> axis_mm{};  // to a capsule's other end; zero: a sphere
    bool grabs = false;               // carries the tissue that it touches when it closes
    bool active = true;
    // A blade whose edge is the axis: cuts what it sweeps through, finite elements only.
    bool cuts = false;
    // Scissors whose axis leads from the closed blades' tips to their pivot: cut what lies between
    // the blades as the opening, from the one tip to the other, becomes less.
    bool snips = false;
    std::array<double, 3> opening_mm{};
    double cut_width_mm = 0;  // of the strip of tissue that a blade takes away
    // A needle from its point along its axis, as thick as its radius says.
    bool pierces = false;
  };
  struct Options {
    double time_step_s = 1.0 / 60;
    // Organs that all have tetrahedra are played by finite elements, others by springs, unless one
    // of the two is asked for; finite elements without tetrahedra are an error.
    bool finite_elements = false;
    // What the organs are drawn in: what they are meant for, what was baked, the same on the skin
    // as it lies now, or one light that travels with the camera. One that the bundles cannot show
    // is an error of the first frame.
    enum class Light : std::uint8_t { usual, baked, world, scope } light = Light::usual;
    bool springs = false;
  };
  struct StepResult {
    std::vector<std::array<double, 3>> force_n;  // on each tip, from the tissue
    double penetration_mm = 0;
    bool recovered = false;  // a lost state went back to rest
  };

  // What another solver needs of an organ, all at rest; numbers of each list are indices into the
  // others. Of an organ that blades have cut as it is now.
  struct Mesh {
    // The coarse proxy, which draws and touches.
    std::vector<Point> vertices_mm;
    std::vector<std::array<std::uint32_t, 3>> faces;  // counter-clockwise from outside
    std::vector<double> vertex_mass_kg;
    std::vector<std::uint32_t> vertex_anchors;  // that do not move
    std::vector<std::array<std::uint32_t, 2>> spring_ends;
    std::vector<double> spring_length_mm, spring_stiffness_n_per_mm, spring_damping_n_s_per_mm;
    // The solid, of bundles that were baked with tetrahedra; else empty.
    std::vector<Point> nodes_mm;
    std::vector<std::array<std::uint32_t, 4>> tetrahedra;  // of positive volume
    std::vector<double> fill;  // the share of each that is tissue, of stiffness and mass
    std::vector<double> node_mass_kg;
    std::vector<std::uint32_t> node_anchors;
    // Vertex v lies at Σ vertex_weights[v] · nodes of tetrahedra[vertex_tetrahedron[v]].
    std::vector<std::uint32_t> vertex_tetrahedron;
    std::vector<std::array<double, 4>> vertex_weights;
    // It moves by the sum over k = patch_first[v] … patch_first[v + 1] − 1 of patch_weights[k] ·
    // the motion of node patch_nodes[k]: that of the tissue under the skin about it. Empty: as the
    // tetrahedron in which it lies.
    std::vector<std::uint32_t> patch_first, patch_nodes;
    std::vector<double> patch_weights;
    // The smooth skin that hangs on the proxy; empty: the proxy itself. Its node n lies at the sum
    // over k = skin_first[n] … skin_first[n + 1] − 1 of skin_weights[k] · vertex skin_carriers[k].
    std::vector<std::uint32_t> skin_first, skin_carriers;
    std::vector<double> skin_weights;
    std::vector<std::array<std::uint32_t, 3>> skin_faces;
    // The tissue. Springs are a shell of that thickness; volume_stiffness 1 keeps its volume.
    double young_modulus_kpa = 0, density_kg_per_m3 = 0, thickness_mm = 0, volume_stiffness = 0;
    double poisson_ratio = 0, damping_s = 0;  // of the solid: Kelvin–Voigt
  };

  // Throws organbake's Error (a std::runtime_error) naming the file that is missing or bad, or the
  // time step.
  explicit EmbeddedPlayer(const std::string& bundle_folder, double time_step_s = 1.0 / 60);
  EmbeddedPlayer(const std::string& bundle_folder, const Options& options);
  // Several organs that push each other; orbits go round the first.
  EmbeddedPlayer(const std::vector<std::string>& bundle_folders, const Options& options);
  ~EmbeddedPlayer();
  EmbeddedPlayer(EmbeddedPlayer&&) noexcept;
  EmbeddedPlayer& operator=(EmbeddedPlayer&&) noexcept;

  // One time step under the tips; a tip keeps its place in the list from step to step. Throws for
  // a tip that makes no sense, such as one that both grabs and cuts.
  StepResult step(const std::vector<Tip>& tips);
  void reset();  // back to rest

  // Another solver's state: x y z of all vertices of an organ's proxy, or of all nodes of its
  // tetrahedra, world mm, copied and nothing else: no memory is taken but at the first calls.
  // draw() then shows what it would after a step() that ended with these vertices, to the byte;
  // nodes carry the vertices as mesh() tells. step() goes on from there: the tissue lies still in
  // that moment, anchors are back at rest, tips begin anew with what they touch; of vertices alone
  // finite elements take the smoothest inside that fits them. Throws an Error, and changes nothing,
  // for another count, for what is not finite, and for places that cannot be this organ's: another
  // organ's, or in another unit.
  void set_vertices(const float* xyz_mm, std::size_t vertices, std::size_t organ = 0);
  void set_vertices(const double* xyz_mm, std::size_t vertices, std::size_t organ = 0);
  void set_nodes(const float* xyz_mm, std::size_t nodes, std::size_t organ = 0);
  void set_nodes(const double* xyz_mm, std::size_t nodes, std::size_t organ = 0);
  Mesh mesh(std::size_t organ = 0) const;
  // For solvers without contact: the force (N, world) on each vertex, or each node, that keeps the
  // tissue off the tips for one time step, or carries it, as it lies now. It lies still afterwards,
  // where it was, and tips have let it go.
  std::vector<Point> contact_force_n(const std::vector<Tip>& tips, std::size_t organ = 0);
  std::vector<Point> contact_force_on_nodes_n(const std::vector<Tip>& tips, std::size_t organ = 0);

  // Round the organ's vertical axis from the first virtual camera, rad, with its angle of view.
  Camera camera_on_orbit(double azimuth_rad, double elevation_rad, int width, int height) const;
  // 8-bit sRGB, R G B, top row first; row_bytes ≥ 3 · width apart. The first frame waits for the
  // baked cameras that it needs alone, the others are read from then on by a thread of their own.
  // Throws for a camera that makes no sense, and for a bad file of a baked camera.
  void draw(const Camera& camera, std::uint8_t* pixels, std::size_t row_bytes);
  // The same with tools in the picture, which push nothing by that.
  void draw(const Camera& camera, const std::vector<Tip>& tools, std::uint8_t* pixels,
            std::size_t row_bytes);

  // Of an organ's coarse proxy, for collisions and haptics of the caller's own; x y z of each
  // vertex, mm. Once a blade has cut it, of its skin and the cuts' walls, which become more with
  // every step in which a cut grows. Throws for an organ or a vertex that there is not.
  std::size_t vertex_count(std::size_t organ = 0) const;
  std::array<double, 3> vertex_mm(std::size_t vertex, std::size_t organ = 0) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
