// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbench/chart.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "pipelines/html_page.h"

namespace organbake {
namespace {

constexpr int kWidth = 680, kHeight = 340;
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
  // 1, 2, 5 of every decade within the axis, or 1 alone where their labels would touch.
  std::vector<double> ticks() const {
    constexpr double kLeastGap = 30;  // pixels between labels
    const double decade_px = std::abs(to_ - from_) / (high_ - low_);
    const bool crowded = decade_px < 3 * kLeastGap;
    std::vector<double> ticks;
    for (int decade = int(std::floor(low_)); decade <= int(std::ceil(high_)); ++decade) {
      for (const double digit : {1.0, 2.0, 5.0}) {
        if (crowded && digit > 1) break;
        const double value = digit * std::pow(10, decade), log = std::log10(value);
        if (log >= low_ - 1e-9 && log <= high_ + 1e-9) ticks.push_back(value);
      }
    }
    return ticks;
  }

 private:
  int from_, to_;
  double low_, high_;
};

// A logarithm needs something above zero: an error of 0 is drawn as one ten-millionth.
double drawn_error(const Point& p) { return std::max(p.errors.front().value, 1e-7); }
double drawn_time(const Point& p) { return std::max(p.timing.wall_ms.median, 1e-4); }
// What was not timed, a flat plane say, is a level that others are above or below.
bool timed(const Point& p) { return p.timing.runs > 0; }

constexpr int kDigits = 3;
std::string number(double value) { return page_number(value, kDigits); }

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return "<text x='" + to_text(x, 1) + "' y='" + to_text(y, 1) + "' text-anchor='" + anchor + "'>" +
         escape_html(text) + "</text>";
}

std::string axes(const LogAxis& x, const LogAxis& y, const std::string& error_title) {
  const double bottom = kHeight - kBottom, right = kWidth - kRight;
  std::string svg;
  for (const double tick : x.ticks()) {
    const std::string at = to_text(x.pixel(tick), 1);
    svg +=
        "<path class='grid' d='M" + at + " " + to_text(kTop, 0) + "V" + to_text(bottom, 0) + "'/>";
    svg += text_at(x.pixel(tick), bottom + 16, "middle", number(tick));
  }
  for (const double tick : y.ticks()) {
    const std::string at = to_text(y.pixel(tick), 1);
    svg +=
        "<path class='grid' d='M" + to_text(kLeft, 0) + " " + at + "H" + to_text(right, 0) + "'/>";
    svg += text_at(kLeft - 6, y.pixel(tick) + 4, "end", number(tick));
  }
  svg += text_at(0.5 * (kLeft + right), kHeight - 8, "middle", "time, ms (median)");
  svg += "<text transform='translate(14 " + to_text(0.5 * (kTop + bottom), 0) +
         ") rotate(-90)' text-anchor='middle'>" + escape_html(error_title) + "</text>";
  return svg;
}

std::string dot(double x, double y, const char* color, const Point& p, bool on_front) {
  const std::string at = "cx='" + to_text(x, 1) + "' cy='" + to_text(y, 1) + "'";
  std::string title = p.subject;
  for (const Quantity& knob : p.knobs) title += ", " + knob.name + " " + number(knob.value);
  title += ": " + number(p.timing.wall_ms.median) + " ms, " + number(p.errors.front().value) + " " +
           p.errors.front().unit;
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
  for (const Point& p : points) {
    if (timed(p)) times.push_back(drawn_time(p));
    errors.push_back(drawn_error(p));
    if (std::find(subjects.begin(), subjects.end(), p.subject) == subjects.end()) {
      subjects.push_back(p.subject);
    }
  }
  if (times.empty()) times = {1};
  const LogAxis x(times, kLeft, kWidth - kRight), y(errors, kHeight - kBottom, kTop);
  const Quantity& error = points.front().errors.front();
  const std::vector<std::size_t> front = pareto_front(points);

  std::string svg = "<svg viewBox='0 0 " + std::to_string(kWidth) + " " + std::to_string(kHeight) +
                    "' width='" + std::to_string(kWidth) + "' role='img'>" +
                    axes(x, y, error.name + ", " + error.unit);
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    const char* color = kColors[s % std::size(kColors)];
    std::string line, dots;
    bool peer = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].subject != subjects[s]) continue;
      peer = points[i].peer;
      const double py = y.pixel(errors[i]);
      if (!timed(points[i])) {
        line += "M" + to_text(kLeft, 0) + " " + to_text(py, 1) + "H" + to_text(kWidth - kRight, 0);
        continue;
      }
      const double px = x.pixel(drawn_time(points[i]));
      line += (line.empty() ? "M" : "L") + to_text(px, 1) + " " + to_text(py, 1);
      dots += dot(px, py, color, points[i], std::count(front.begin(), front.end(), i) > 0);
    }
    svg += "<path d='" + line + "' fill='none' stroke='" + color + "'" +
           (peer ? " stroke-dasharray='4 3'" : "") + "/>" + dots;
    const double row = kTop + 12 + 18 * double(s);
    svg += "<path d='M" + to_text(kWidth - kRight + 10, 0) + " " + to_text(row - 4, 0) +
           "h16' stroke='" + color + "' stroke-width='2'" +
           (peer ? " stroke-dasharray='4 3'" : "") + "/>" +
           text_at(kWidth - kRight + 32, row, "start", subjects[s]);
  }
  return svg + "</svg>";
}

}  // namespace organbake
