// SPDX-License-Identifier: GPL-3.0-or-later
// Time against error as inline SVG, and errors as pictures.
#include "organbake/pipelines/documents.h"
#include "report/report.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/text.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kChartWidth = 680, kHeight = 340;
constexpr int kLeft = 70, kRight = 250, kTop = 16, kBottom = 46;
// Told apart by people who don't see all colours (Okabe, Ito 2008).
constexpr const char* kColors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                   "#56b4e9", "#e69f00", "#000000", "#8c6d31"};

// One logarithmic axis: values between its ends become pixels.
class LogAxis {
 public:
  LogAxis(std::vector<double> values, int from, int to) : from_(from), to_(to) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    low_ = std::floor(4 * std::log10(*least) - 0.2) / 4;
    high_ = std::ceil(4 * std::log10(*most) + 0.2) / 4;
  }
  double pixel(double value) const {
    return from_ + (to_ - from_) * (std::log10(value) - low_) / (high_ - low_);
  }
  // As many of every decade as have room for their labels.
  std::vector<double> ticks() const {
    std::vector<double> ticks;
    for (int decade = int(std::floor(low_)); decade <= int(std::ceil(high_)); ++decade) {
      for (const double digit : digits()) {
        const double value = digit * std::pow(10, decade), log = std::log10(value);
        if (log >= low_ - 1e-9 && log <= high_ + 1e-9) ticks.push_back(value);
      }
    }
    return ticks;
  }

 private:
  std::vector<double> digits() const {
    constexpr double kLeastGap = 30;  // pixels between labels
    const double decade_px = std::abs(to_ - from_) / (high_ - low_);
    if (decade_px * std::log10(2 / 1.5) >= kLeastGap) return {1, 1.5, 2, 3, 5, 7};
    if (decade_px * std::log10(2.) >= kLeastGap) return {1, 2, 5};
    return {1};
  }

  int from_, to_;
  double low_, high_;
};

constexpr const char* kTimeTitle = "time, ms (median)";

// A logarithm needs something above zero: an error of 0 is drawn a little below the least other.
double drawn_zero(const std::vector<Point>& points) {
  double least = std::numeric_limits<double>::infinity();
  for (const Point& p : points)
    if (const double error = p.errors.front().value; error > 0) least = std::min(least, error);
  return std::isfinite(least) ? least / 4 : 1;
}
double drawn_time(const Point& p) { return std::max(p.timing.wall_ms.median, 1e-4); }
// What was not timed, a flat plane say, is a level that others are above or below.
bool timed(const Point& p) { return p.timing.runs > 0; }

constexpr int kDigits = 3;
std::string number(double value) { return page_number(value, kDigits); }

// Ticks are round, and of voxels large: 20 k, 5 M.
std::string tick_label(double value) {
  constexpr double kThousand = 1e3, kFromThousands = 1e4, kMillion = 1e6;
  if (value >= kMillion) return number(value / kMillion) + " M";
  if (value >= kFromThousands) return number(value / kThousand) + " k";
  return number(value);
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return "<text x='" + to_text(x, 1) + "' y='" + to_text(y, 1) + "' text-anchor='" + anchor + "'>" +
         escape_html(text) + "</text>";
}

std::string axes(const LogAxis& x, const LogAxis& y, const std::string& x_title,
                 const std::string& y_title, double y_zero = 0) {
  const double bottom = kHeight - kBottom, right = kChartWidth - kRight;
  std::string svg;
  for (const double tick : x.ticks()) {
    const std::string at = to_text(x.pixel(tick), 1);
    svg +=
        "<path class='grid' d='M" + at + " " + to_text(kTop, 0) + "V" + to_text(bottom, 0) + "'/>";
    svg += text_at(x.pixel(tick), bottom + 16, "middle", tick_label(tick));
  }
  for (const double tick : y.ticks()) {
    if (tick <= y_zero) continue;
    const std::string at = to_text(y.pixel(tick), 1);
    svg +=
        "<path class='grid' d='M" + to_text(kLeft, 0) + " " + at + "H" + to_text(right, 0) + "'/>";
    svg += text_at(kLeft - 6, y.pixel(tick) + 4, "end", tick_label(tick));
  }
  svg += text_at(0.5 * (kLeft + right), kHeight - 8, "middle", x_title);
  svg += "<text transform='translate(14 " + to_text(0.5 * (kTop + bottom), 0) +
         ") rotate(-90)' text-anchor='middle'>" + escape_html(y_title) + "</text>";
  return svg;
}

std::string begin_svg() {
  return "<svg viewBox='0 0 " + std::to_string(kChartWidth) + " " + std::to_string(kHeight) +
         "' width='" + std::to_string(kChartWidth) + "' role='img'>";
}

std::string named(const Quantity& q) { return q.unit.empty() ? q.name : q.name + ", " + q.unit; }

std::string dot(double x, double y, const char* color, const Point& p, bool on_front) {
  const std::string at = "cx='" + to_text(x, 1) + "' cy='" + to_text(y, 1) + "'";
  std::string title = p.subject;
  for (const Quantity& knob : p.knobs) title += ", " + knob.name + " " + number(knob.value);
  title += ": " + number(p.timing.wall_ms.median) + " ms";
  if (!p.errors.empty())
    title += ", " + number(p.errors.front().value) + " " + p.errors.front().unit;
  std::string svg = "<circle " + at + " r='4' fill='" + (p.peer ? "white" : color) + "' stroke='" +
                    color + "' stroke-width='1.5'><title>" + escape_html(title) +
                    "</title></circle>";
  if (on_front) svg += "<circle " + at + " r='8' class='front'/>";
  return svg;
}

}  // namespace

std::vector<std::size_t> pareto_front(const std::vector<Point>& points) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (timed(points[i])) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(points[a].timing.wall_ms.median, points[a].errors.front().value) <
           std::pair(points[b].timing.wall_ms.median, points[b].errors.front().value);
  });
  std::vector<std::size_t> front;
  for (const std::size_t i : order) {
    const double error = points[i].errors.front().value;
    if (front.empty() || error < points[front.back()].errors.front().value) front.push_back(i);
  }
  return front;
}

std::string time_error_chart(const std::vector<Point>& points) {
  std::vector<double> times, errors;
  std::vector<std::string> subjects;
  const double zero = drawn_zero(points);
  for (const Point& p : points) {
    if (timed(p)) times.push_back(drawn_time(p));
    errors.push_back(p.errors.front().value > 0 ? p.errors.front().value : zero);
    if (std::find(subjects.begin(), subjects.end(), p.subject) == subjects.end()) {
      subjects.push_back(p.subject);
    }
  }
  if (times.empty()) times = {1};
  const LogAxis x(times, kLeft, kChartWidth - kRight), y(errors, kHeight - kBottom, kTop);
  const Quantity& error = points.front().errors.front();
  const std::vector<std::size_t> front = pareto_front(points);

  std::string svg = begin_svg() + axes(x, y, kTimeTitle, named(error), zero);
  if (std::count(errors.begin(), errors.end(), zero) > 0) {
    svg += text_at(kLeft - 6, y.pixel(zero) + 4, "end", "0");
  }
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    const char* color = kColors[s % std::size(kColors)];
    std::string line, dots;
    bool peer = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].subject != subjects[s]) continue;
      peer = points[i].peer;
      const double py = y.pixel(errors[i]);
      if (!timed(points[i])) {
        line +=
            "M" + to_text(kLeft, 0) + " " + to_text(py, 1) + "H" + to_text(kChartWidth - kRight, 0);
        continue;
      }
      const double px = x.pixel(drawn_time(points[i]));
      line += (line.empty() ? "M" : "L") + to_text(px, 1) + " " + to_text(py, 1);
      dots += dot(px, py, color, points[i], std::count(front.begin(), front.end(), i) > 0);
    }
    svg += "<path d='" + line + "' fill='none' stroke='" + color + "'" +
           (peer ? " stroke-dasharray='4 3'" : "") + "/>" + dots;
    const double row = kTop + 12 + 18 * double(s);
    svg += "<path d='M" + to_text(kChartWidth - kRight + 10, 0) + " " + to_text(row - 4, 0) +
           "h16' stroke='" + color + "' stroke-width='2'" +
           (peer ? " stroke-dasharray='4 3'" : "") + "/>" +
           text_at(kChartWidth - kRight + 32, row, "start", subjects[s]);
  }
  return svg + "</svg>";
}

bool shows_growth(const std::vector<Point>& points) {
  constexpr std::size_t kFewest = 2;
  return points.size() >= kFewest && std::all_of(points.begin(), points.end(), [](const Point& p) {
           return timed(p) && p.errors.empty() && p.knobs.size() == 1 && p.knobs[0].value > 0;
         });
}

std::string time_work_chart(const std::vector<Point>& points) {
  std::vector<double> work, times;
  for (const Point& p : points) {
    work.push_back(p.knobs.front().value);
    times.push_back(drawn_time(p));
  }
  const LogAxis x(work, kLeft, kChartWidth - kRight), y(times, kHeight - kBottom, kTop);
  std::string line, dots;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double px = x.pixel(work[i]), py = y.pixel(times[i]);
    line += (i == 0 ? "M" : "L") + to_text(px, 1) + " " + to_text(py, 1);
    dots += dot(px, py, kColors[0], points[i], false);
  }
  return begin_svg() + axes(x, y, named(points.front().knobs.front()), kTimeTitle) + "<path d='" +
         line + "' fill='none' stroke='" + kColors[0] + "'/>" + dots + "</svg>";
}

Eigen::Vector3f heat_color(double share_of_scale) {
  if (!std::isfinite(share_of_scale)) return {0.1f, 0.2f, 0.8f};
  // A third of the scale each for red, green and blue.
  const auto ramp = [&](int third) {
    return float(std::clamp(3 * share_of_scale - third, 0.0, 1.0));
  };
  return {ramp(0), ramp(1), ramp(2)};
}

Rgb8Image heat_map(const std::vector<double>& values, int width, double scale) {
  Rgb8Image image(width, static_cast<int>(values.size()) / width);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Eigen::Vector3f color = heat_color(values[i] / scale);
    for (int c = 0; c < 3; ++c) image.pixels[3 * i + c] = srgb8_from_linear(color[c]);
  }
  return image;
}

}  // namespace organbake
