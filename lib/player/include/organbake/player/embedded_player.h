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
    bool finite_elements = false;  // in the springs' place; the bundles must have been baked so
    // What the organs are drawn in: what they are meant for, what was baked, the same on the skin
    // as it lies now, or one light that travels with the camera. One that the bundles cannot show
    // is an error of the first frame.
    enum class Light : std::uint8_t { usual, baked, world, scope } light = Light::usual;
  };
  struct StepResult {
    std::vector<std::array<double, 3>> force_n;  // on each tip, from the tissue
    double penetration_mm = 0;
    bool recovered = false;  // a lost state went back to rest
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

  // Round the organ's vertical axis from the first virtual camera, rad, with its angle of view.
  Camera camera_on_orbit(double azimuth_rad, double elevation_rad, int width, int height) const;
  // 8-bit sRGB, R G B, top row first; row_bytes ≥ 3 · width apart. The first frame waits for the
  // baked cameras that it needs alone, the others are read from then on by a thread of their own.
  // Throws for a camera that makes no sense, and for a bad file of a baked camera.
  void draw(const Camera& camera, std::uint8_t* pixels, std::size_t row_bytes);

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
