#!/usr/bin/env python3
"""Watches a study's folder until all runs are done, then draws which worker trained which run when.

    tools/results/draw_workers.py runs/my workers.svg
"""

import json
import sys
import time
from pathlib import Path
from xml.sax.saxutils import escape

COLOURS = ["#4477aa", "#cc6677", "#228833", "#ccbb44", "#66ccee", "#aa3377"]
LEFT, WIDTH, ROW, TOP = 90, 620, 22, 34


def read(path):
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""


def size(path):
    try:
        return path.stat().st_size
    except OSError:
        return 0


def watch(folder):
    """The runs in order, each with its spans (worker, begin, last progress, end) in seconds. A
    run's last span ends when the run is done."""
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    seeds = [seed for part in plan["seeds"].strip("[]").split(",")
             for low, _, high in [part.strip().partition("-")]
             for seed in range(int(low), int(high or low) + 1)]
    spans = {f"{variant['name']}/seed{seed}": [] for seed in seeds for variant in plan["variants"]}
    sizes = dict.fromkeys(spans, 0)
    done = set()
    begin = time.monotonic()
    while len(done) < len(spans):
        now = time.monotonic() - begin
        for run, of_run in spans.items():
            if run in done:
                continue
            holder = read(folder / f"{run}.claim").strip()  # host and process
            grown = size(folder / run / "metrics.csv")
            if holder and (not of_run or of_run[-1][0] != holder or of_run[-1][3] < now - 2):
                of_run.append([holder, now, now, now])
            if holder:
                of_run[-1][3] = now
                if grown != sizes[run]:
                    of_run[-1][2] = now
            sizes[run] = grown
            if (folder / f"{run}.done").exists():
                if of_run:
                    of_run[-1][2:] = [now, now]
                done.add(run)
        time.sleep(0.1)
    return spans


def draw(spans):
    """The spans as SVG: full colour while a run makes progress, pale while it is only claimed."""
    end = max([span[3] for of_run in spans.values() for span in of_run] + [1])
    hosts = sorted({span[0].split()[0] for of_run in spans.values() for span in of_run})
    colour = {host: COLOURS[i % len(COLOURS)] for i, host in enumerate(hosts)}
    height = TOP + ROW * len(spans) + 40

    def x(seconds):
        return LEFT + WIDTH * seconds / end

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + WIDTH + 30} {height}" '
             'font-family="sans-serif" font-size="12">',
             f'<rect width="{LEFT + WIDTH + 30}" height="{height}" fill="white"/>']
    for i, host in enumerate(hosts):
        parts.append(f'<rect x="{LEFT + 110 * i}" y="9" width="12" height="12" fill="{colour[host]}"/>'
                     f'<text x="{LEFT + 110 * i + 18}" y="19">{escape(host)}</text>')
    bottom = TOP + ROW * len(spans)
    step = next(s for s in (1, 5, 10, 30, 60, 300, 600, 3600, 36000, 360000) if end / s <= 12)
    for second in range(0, int(end) + 1, step):
        parts.append(f'<line x1="{x(second):.1f}" y1="{TOP - 4}" x2="{x(second):.1f}" y2="{bottom}" '
                     'stroke="#dddddd"/>'
                     f'<text x="{x(second):.1f}" y="{bottom + 15}" text-anchor="middle">{second}</text>')
    parts.append(f'<text x="{LEFT + WIDTH / 2}" y="{bottom + 33}" text-anchor="middle">seconds</text>')
    for row, (run, of_run) in enumerate(spans.items()):
        y = TOP + ROW * row
        parts.append(f'<text x="{LEFT - 8}" y="{y + 14}" text-anchor="end">{escape(run)}</text>')
        for i, (holder, first, progress, last) in enumerate(of_run):
            fill = colour[holder.split()[0]]
            for a, b, opacity in ((first, progress, 1), (progress, last, 0.25)):
                if b > a:
                    parts.append(f'<rect x="{x(a):.1f}" y="{y + 3}" width="{x(b) - x(a):.1f}" '
                                 f'height="{ROW - 7}" fill="{fill}" fill-opacity="{opacity}"/>')
            if i + 1 == len(of_run):
                parts.append(f'<circle cx="{x(last):.1f}" cy="{y + 10.5}" r="4" fill="black"/>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: draw_workers.py FOLDER FILE.svg")
    Path(sys.argv[2]).write_text(draw(watch(Path(sys.argv[1]))), encoding="utf-8")


if __name__ == "__main__":
    main()
