#!/usr/bin/env python3
"""Draws a rollout of `upswing simulate` as SVG: the two links at many moments, early ones faint, and
the torque and the height of the tip over time.

  ./upswing simulate runs/d3qn-seed1 --seconds 5 --csv rollout.csv
  tools/draw_rollout.py rollout.csv docs/swing-up.svg
"""

import csv
import math
import sys

WIDTH, HEIGHT = 820, 380
CENTER_X, CENTER_Y, SCALE = 200, 190, 165  # pivot, and pixels to a metre
PLOT_X, PLOT_WIDTH = 450, 340


def links(row, length=0.5):
    """Pivot, elbow and tip on the page. Positive angles turn clockwise, seen along +y."""
    q1, q12 = float(row["qpos0"]), float(row["qpos0"]) + float(row["qpos1"])
    elbow = (-length * math.sin(q1), length * math.cos(q1))
    tip = (elbow[0] - length * math.sin(q12), elbow[1] + length * math.cos(q12))
    return [(CENTER_X + SCALE * x, CENTER_Y + SCALE * y) for x, y in ((0, 0), elbow, tip)]


def polyline(points, style):
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{text}" fill="none" {style}/>'


def strobe(rows, every=4):
    """The links at every few rows, from faint to full, and the path of the tip."""
    parts = [polyline([links(row)[2] for row in rows], 'stroke="#e07a1f" stroke-width="1.2"')]
    shown = rows[::every]
    for i, row in enumerate(shown):
        opacity = 0.08 + 0.5 * i / len(shown)
        parts.append(polyline(links(row), f'stroke="#2b6cb0" stroke-width="4" '
                              f'stroke-linecap="round" stroke-linejoin="round" '
                              f'opacity="{opacity:.2f}"'))
    parts.append(polyline(links(rows[-1]), 'stroke="#1a365d" stroke-width="6" '
                          'stroke-linecap="round" stroke-linejoin="round"'))
    parts.append(f'<circle cx="{CENTER_X}" cy="{CENTER_Y}" r="6" fill="#1a365d"/>')
    return parts


def plot(rows, column, label, top, low, high, color):
    """One column over time, between two labelled values."""
    height, seconds = 120, float(rows[-1]["t"])
    x = lambda t: PLOT_X + PLOT_WIDTH * t / seconds
    y = lambda v: top + height * (high - v) / (high - low)
    parts = [f'<rect x="{PLOT_X}" y="{top}" width="{PLOT_WIDTH}" height="{height}" '
             f'fill="none" stroke="#a0aec0"/>',
             f'<text x="{PLOT_X}" y="{top - 8}">{label}</text>']
    for value in (low, 0, high):
        parts.append(f'<text x="{PLOT_X - 6}" y="{y(value) + 4:.1f}" '
                     f'text-anchor="end">{value:g}</text>')
    for t in range(int(seconds) + 1):
        parts.append(f'<text x="{x(t):.1f}" y="{top + height + 16}" '
                     f'text-anchor="middle">{t}{" s" if t == int(seconds) else ""}</text>')
    points = [(x(float(row["t"])), y(float(row[column]))) for row in rows]
    return parts + [polyline(points, f'stroke="{color}" stroke-width="1.6"')]


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
             f'font-family="sans-serif" font-size="12" fill="#4a5568">',
             f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    parts += strobe(rows)
    parts += plot(rows, "height", "height of the tip, m", 40, -1, 1, "#e07a1f")
    parts += plot(rows, "torque", "torque at the first joint, N·m", 220, -5, 5, "#2b6cb0")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write("\n".join(parts + ["</svg>", ""]))


if __name__ == "__main__":
    main()
