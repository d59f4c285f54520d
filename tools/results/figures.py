#!/usr/bin/env python3
"""Draw the figures of the documentation, as SVG in docs/figures/.

    python3 tools/results/figures.py                  draw all figures
    python3 tools/results/figures.py pareto maps      draw these
    python3 tools/results/figures.py --measure        run the program for the data of episode, poses, maps, lqr-catch and machine-learn

Each figure is a function with @figure. It reads docs/results/data/*.json or docs/figures/**/*.csv. Drawing
needs matplotlib (tools/docs-requirements.txt) and no built program. Draw again when a data file changes:
tools/results/figures_test.py compares. Ink and background are CSS variables with a dark variant. Colours of agents
are the same in both.
"""
import argparse
import csv
import io
import json
import math
import re
import subprocess
import sys
from pathlib import Path

from results import DATA, ROOT
from seeds.wilson import wilson

FIGURES = ROOT / "docs/figures"
CSV = FIGURES / "data"

# The colour of each agent and controller in every figure, with a contrast of 3 or more on both
# backgrounds.
AGENTS = {
    "d3qn": "#2f7de0", "dqn": "#8c8c3a", "double-dqn": "#b06ac8", "dueling-dqn": "#2a9d9d", "fast": "#d9662a",
    "sac": "#1a9b6c", "sac-fast": "#6f9a24", "ppo": "#d0478f",
    "d3qn-randomized": "#8a6fe0", "d3qn-adaptive": "#b98200",
    "lqr": "#7f8794", "energy": "#a8764a", "pfl": "#8f8072", "tvlqr": "#5b88ad", "mpc": "#d84a4a", "hybrid": "#2b96b8",
}
POSES = {"up-up": (math.pi, 0), "up-down": (math.pi, math.pi), "down-up": (0, math.pi), "down-down": (0, 0)}  # q1, q2
CONTROLLERS = {"lqr", "energy", "pfl", "tvlqr", "mpc", "hybrid"}

# Colours that change in dark mode: name: (placeholder for matplotlib, light, dark).
VARIABLES = {
    "ink": ("#010101", "#1d2333", "#e6e8ee"),
    "muted": ("#020202", "#565c6e", "#a6abba"),
    "grid": ("#030303", "#dfe2e8", "#333a4a"),
    "paper": ("#040404", "#ffffff", "#14171f"),
    "link1": ("#050505", "#2456c4", "#7aa5ff"),  # as in pendulum.svg
    "link2": ("#060606", "#c8500f", "#ff9a5c"),
    "torque": ("#070707", "#0b7a6e", "#4fd1c0"),
}
INK, MUTED, GRID, PAPER, LINK1, LINK2, TORQUE = (placeholder for placeholder, _, _ in VARIABLES.values())

# Colours of figures without agents.
REWARD = {"energy": "#2f7de0", "height": "#2a9d9d", "balance": "#b98200", "velocity penalty": "#b06ac8",
          "torque penalty": "#d84a4a"}

DRAWN = {}  # figure name: function that returns a matplotlib figure, or raises NoData


class NoData(Exception):
    """A figure's data file does not exist or is empty."""


def figure(name):
    def register(function):
        DRAWN[name] = function
        return function
    return register


# --- Style ---

def style():
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcdefaults()
    matplotlib.rcParams.update({
        "svg.fonttype": "none", "svg.hashsalt": "upswing", "font.family": "DejaVu Sans", "font.size": 13,
        "text.color": INK, "axes.labelcolor": INK, "axes.edgecolor": MUTED, "axes.facecolor": "none",
        "figure.facecolor": PAPER, "xtick.color": MUTED, "ytick.color": MUTED, "xtick.labelcolor": INK,
        "ytick.labelcolor": INK, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
        "grid.color": GRID, "grid.linewidth": 1, "axes.axisbelow": True, "axes.linewidth": 1, "lines.linewidth": 2,
        "legend.frameon": False, "legend.fontsize": 13, "figure.dpi": 72, "savefig.dpi": 144, "path.simplify": True,
        "xtick.major.size": 4, "ytick.major.size": 4, "lines.solid_capstyle": "round",
    })


def canvas(width, height):
    from matplotlib.figure import Figure
    return Figure(figsize=(width / 72, height / 72))


def panel(fig, left, top, width, height, **options):
    """Axes at this position, in pixels from the top left."""
    w, h = fig.get_size_inches() * 72
    return fig.add_axes((left / w, 1 - (top + height) / h, width / w, height / h), **options)


def note(fig, x, y, text, **options):
    """Adds text at this position, in pixels from the top left."""
    w, h = fig.get_size_inches() * 72
    return fig.text(x / w, 1 - y / h, text, va=options.pop("va", "center_baseline"), **options)


def svg(fig):
    """The figure as SVG text: the same bytes for the same data."""
    file = io.StringIO()
    fig.savefig(file, format="svg", facecolor=PAPER,
                metadata={"Date": None, "Creator": None, "Type": None, "Format": None})
    text = file.getvalue()
    width, height = (round(float(number) * 72) for number in fig.get_size_inches())
    text = re.sub(r'<svg [^>]*>', f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
                  f'width="{width}" height="{height}" viewBox="0 0 {width} {height}" role="img">', text, count=1)
    text = re.sub(r'(?<= d=")[^"]*', lambda path: re.sub(r"\d+\.\d{3,}", lambda x: f"{float(x[0]):.2f}", path[0]), text)
    text = re.sub(r" *<metadata>.*?</metadata>\n", "", text, flags=re.S)
    text = re.sub(r"<!DOCTYPE[^>]*>\n", "", text)
    text = re.sub(r"(font(?:-family)?:[^;\"]*)'DejaVu Sans'", r"\1system-ui, -apple-system, 'Segoe UI', sans-serif", text)
    for name, (placeholder, _, _) in VARIABLES.items():
        text = text.replace(placeholder, f"var(--{name})")
    light, dark = (";".join(f"--{name}:{colors[k]}" for name, colors in VARIABLES.items()) for k in (1, 2))
    rule = f"svg{{{light}}}\n@media (prefers-color-scheme:dark){{svg{{{dark}}}}}\n"
    text = text.replace("</style>", f"\n{rule}</style>", 1)
    text = text.replace("</svg>", getattr(fig, "film", "") + "</svg>")  # a figure's moving parts
    return "\n".join(line.rstrip() for line in text.splitlines()) + "\n"


# --- Data ---

def table(name):
    """Columns and rows of a data file, without Markdown. Raises NoData."""
    path = DATA / f"{name}.json"
    if not path.exists():
        raise NoData
    data = json.loads(path.read_text(encoding="utf-8"))
    plain = [[cell.replace("`", "").replace("*", "").replace("\\|", "|") for cell in row]
             for row in [data["columns"], *data["rows"]]]
    return plain[0], plain[1:]


def number(cell):
    """The first number of a cell, or None."""
    found = re.match(r"-?[\d,]*\.?\d+", cell)
    return float(found[0].replace(",", "")) if found else None


def rows_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def data_of(path):
    """The rows of a data file, by column. Raises NoData."""
    rows = rows_of(path) if path.exists() else []
    if not rows:
        raise NoData
    return rows


# --- Figures ---

@figure("episode")
def episode():
    """Angles, torque and the terms of the reward over one swing-up of d3qn."""
    rows = data_of(CSV / "episode.csv")
    column = {name: [float(row[name]) for row in rows] for name in rows[0]}
    t, upright = column["t"], next(float(row["t"]) for row in rows if row["inverted"] == "1")
    fig = canvas(800, 640)
    angles, torque, reward = (panel(fig, 70, top, 610, height)
                              for top, height in ((20, 170), (220, 110), (360, 220)))
    for axes in (angles, torque, reward):
        axes.set_xlim(0, t[-1])
        axes.axvline(upright, color=MUTED, linewidth=1.3, linestyle=(0, (4, 3)))
        axes.set_xticks(range(int(t[-1]) + 1))
        if axes is not reward:
            axes.tick_params(labelbottom=False)
    angles.text(upright + 0.06, 1, "upright from here on", transform=angles.get_xaxis_transform(), va="top", color=MUTED)

    degrees = [[math.degrees(angle) for angle in column[name]] for name in ("q1", "q2")]
    for values, color, name in zip(degrees, (LINK1, LINK2), ("θ₁", "θ₂")):
        angles.plot(t, values, color=color)
        angles.annotate(name, (t[-1], values[-1]), (8, 0), textcoords="offset points", color=color, va="center",
                        fontsize=16, annotation_clip=False)
    low, high = min(map(min, degrees)) - 20, max(map(max, degrees)) + 30
    angles.set_ylim(low, high)
    angles.set_yticks([tick for tick in range(-720, 721, 90) if low <= tick <= high])
    angles.set_ylabel("angle [°]")

    torque.step(t, column["torque"], where="post", color=TORQUE, linewidth=1.6)
    torque.set_yticks([-5, 0, 5])
    torque.set_ylim(-5.8, 5.8)
    torque.set_ylabel("torque [N·m]")
    torque.annotate("τ", (t[-1], 0), (8, 0), textcoords="offset points", color=TORQUE, va="center", fontsize=16,
                    annotation_clip=False)

    positive, negative = [column[name] for name in ("energy", "height", "balance")], [
        [-abs(value) for value in column[name]] for name in ("velocity_penalty", "torque_penalty")]
    below, above = [0.0] * len(t), [0.0] * len(t)
    for name, values in zip(REWARD, positive + negative):
        base = above if values in positive else below
        top = [a + b for a, b in zip(base, values)]
        reward.fill_between(t, base, top, color=REWARD[name], linewidth=0, step="post", label=name)
        base[:] = top
    reward.step(t, column["reward"], where="post", color=INK, linewidth=1.5, label="sum")
    reward.set_ylabel("reward of a step")
    reward.set_xlabel("time [s]")
    reward.set_ylim(min(below) - 0.3, max(above) + 0.3)
    handles, names = reward.get_legend_handles_labels()
    order = ["sum", "balance", "height", "energy", "velocity penalty", "torque penalty"]
    reward.legend([handles[names.index(name)] for name in order],
                  [name.replace(" penalty", "\npenalty") for name in order], loc="center left",
                  bbox_to_anchor=(1.005, 0.5), handlelength=1, borderpad=0, labelspacing=0.7)
    fig.align_ylabels([angles, torque, reward])
    return fig


@figure("poses")
def poses():
    """One policy goes from each pose at rest to every other: start, end and the way of the tip."""
    motions = {}
    for row in data_of(CSV / "poses.csv"):
        motions.setdefault((row["from"], row["to"]), []).append([float(row[name]) for name in ("t", "q1", "q2", "inverted")])
    fig = canvas(800, 720)

    def joints(q1, q2):
        elbow = math.sin(q1), -math.cos(q1)
        return (0, 0), elbow, (elbow[0] + math.sin(q1 + q2), elbow[1] - math.cos(q1 + q2))

    def draw_pendulum(axes, q1, q2, **options):
        pivot, elbow, tip = joints(q1, q2)
        axes.plot(*zip(pivot, elbow), color=LINK1, linewidth=7, **options)
        axes.plot(*zip(elbow, tip), color=LINK2, linewidth=3, **options)  # visible on a folded link 1

    for i, start in enumerate(POSES):
        note(fig, 16, 120 + 165 * i, start, rotation=90, ha="center", color=MUTED)
        note(fig, 120 + 180 * i, 16, f"to {start}", ha="center", color=MUTED)
        for k, goal in enumerate(POSES):
            axes = panel(fig, 40 + 180 * k, 40 + 165 * i, 170, 160)
            axes.set_axis_off()
            axes.set_xlim(-2.25, 2.25)
            axes.set_ylim(-2.12, 2.12)
            if start == goal:
                draw_pendulum(axes, *POSES[start], alpha=0.3)
                continue
            motion = motions[start, goal]
            tips = [joints(q1, q2)[2] for _, q1, q2, _ in motion]
            axes.plot(*zip(*tips), color=MUTED, linewidth=1)
            draw_pendulum(axes, *POSES[start], alpha=0.3)
            draw_pendulum(axes, *motion[-1][1:3])
            away = [t for t, _, _, inverted in motion if inverted == 0]
            axes.text(2.2, -2.05, f"{away[-1]:.1f} s", ha="right", color=INK)
    return fig


@figure("board")
def board():
    """A film: a run of 60 s of each robot of RealAIGym, and the time in which its tip is high.

    Its data are every 20th row of `realaigym score runs/AGENT-seed21 --csv`; `reset` is 1 where both motors act."""
    import numpy as np
    fig, motions = canvas(800, 405), {}
    lengths = {"link1": 60, "link2": 90}  # pixels
    line = 0.9 * sum(lengths.values())
    for row in data_of(CSV / "board.csv"):
        motions.setdefault(row["robot"], []).append([float(row[name]) for name in ("t", "q1", "q2", "reset")])

    def animated(kind, values):
        return (f'<animateTransform attributeName="transform" type="{kind}" values="{values}" dur="60s" '
                f'repeatCount="indefinite"/>')

    fig.film = ""  # svg() adds it: matplotlib does not animate
    for x, (robot, motion) in zip((200, 600), motions.items()):
        t, q1, q2, resets = np.array(motion).T
        high = -lengths["link1"] * np.cos(q1) - lengths["link2"] * np.cos(q1 + q2) > line
        note(fig, x, 14, f"{robot}: high for {high.mean():.0%} of 60 s", ha="center", color=INK)
        stage = panel(fig, x - 180, 30, 360, 320, xlim=(-180, 180), ylim=(-160, 160))
        stage.axhline(line, color=MUTED, linewidth=1, linestyle=(0, (4, 4)))
        stage.set_axis_off()
        bar = panel(fig, x - 180, 360, 360, 14, xlim=(0, 60), ylim=(0, 1), xticks=[0, 20, 40, 60], yticks=[])
        bar.grid(visible=False)
        for active, color in ((high, TORQUE), (resets == 1, MUTED)):
            edges = t[np.flatnonzero(np.diff(np.r_[False, active, False])).clip(max=len(t) - 1)]
            bar.broken_barh([(begin, end - begin) for begin, end in edges.reshape(-1, 2)], (0, 1), color=color, linewidth=0)
        arm = ""
        for link, q in (("link2", q2), ("link1", q1)):  # link 2 hangs on link 1
            length, degrees = lengths[link], ";".join(f"{angle:.0f}" for angle in -np.degrees(q))
            arm = (f'<g>{animated("rotate", degrees)}<line y2="{length}" style="stroke:var(--{link});stroke-width:9;'
                   f'stroke-linecap:round"/><g transform="translate(0 {length})">{arm}</g></g>')
        fig.film += (f'<g transform="translate({x} 190)">{arm}</g><path d="M{x - 180} 356v22" style="stroke:var(--ink);'
                     f'stroke-width:2">{animated("translate", "0;360")}</path>')
    return fig


@figure("post")
def post():
    """Success of the post's DQN and its extensions, and the values that they expect and attain."""
    import numpy as np
    rows, random = data_of(CSV / "post.csv"), np.random.default_rng(1)
    fig = canvas(800, 450)
    for k, agent in enumerate(("dqn", "double-dqn", "dueling-dqn", "d3qn")):
        own = [row for row in rows if row["variant"] == agent]
        steps = sorted({int(row["step"]) for row in own})
        seeds = sorted({row["seed"] for row in own})
        left, millions = 70 + 184 * k, [step / 1e6 for step in steps]
        success, values = panel(fig, left, 45, 164, 140), panel(fig, left, 215, 164, 170)
        columns = {name: np.array([[float(row[name]) for row in own if row["seed"] == seed] for seed in seeds])
                   for name in ("success_rate", "value", "discounted_return")}
        for axes, name, color in ((success, "success_rate", AGENTS[agent]), (values, "value", AGENTS[agent]),
                                  (values, "discounted_return", MUTED)):
            curves = columns[name]
            means = curves[random.integers(len(seeds), size=(2000, len(seeds)))].mean(axis=1)
            axes.fill_between(millions, *np.percentile(means, (2.5, 97.5), axis=0), color=color, alpha=0.25,
                              linewidth=0)
            axes.plot(millions, curves.mean(axis=0), color=color)
        note(fig, left + 82, 25, agent, ha="center", color=AGENTS[agent], fontweight="bold")
        for axes in (success, values):
            axes.set_xlim(0, 1)
            axes.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
        success.set_ylim(-0.02, 1.02)
        success.set_yticks([0, 0.5, 1], ["0%", "50%", "100%"] if k == 0 else [""] * 3)
        values.set_ylim(-20, 820)
        values.set_yticks([0, 200, 400, 600, 800], None if k == 0 else [""] * 5)
        success.tick_params(labelbottom=False)
        if k == 0:
            success.set_ylabel("success")
            values.set_ylabel("value at the start")
            fig.align_ylabels([success, values])
    note(fig, 428, 425, "million steps", ha="center")
    note(fig, 70, 425, "colour: expected, grey: attained", color=MUTED, fontsize=12)
    return fig


@figure("machine-motion")
def machine_motion():
    """Measured angles of left-out runs, and predictions of the twin and the benchmark's own model."""
    from matplotlib.lines import Line2D
    runs = {}
    for row in data_of(CSV / "machine-motion.csv"):
        runs.setdefault(row["log"], []).append(row)
    names = [name[:-2] for name in next(iter(runs.values()))[0] if name.endswith(" 1") and name != "measured 1"]
    styles = dict(zip(names, ("--", ":")))
    fig = canvas(800, 580)
    for place, (log, rows) in enumerate(runs.items()):
        folder, file = log.split("/")[-2:]
        axes = panel(fig, 72 + 380 * (place % 2), 75 + 250 * (place // 2), 330, 190)
        time = [float(row["time"]) - float(rows[0]["time"]) for row in rows]
        for joint, color in ((1, LINK1), (2, LINK2)):
            axes.plot(time, [float(row[f"measured {joint}"]) for row in rows], color=color, linewidth=5, alpha=0.35)
            for name, dashes in styles.items():
                axes.plot(time, [float(row[f"{name} {joint}"]) for row in rows], dashes, color=color, linewidth=2)
        robot, pushed = file.split("-")[0], ", pushed" if folder == "pushed" else ""
        axes.set_title(f"{robot}, TVLQR{pushed}", fontsize=13, loc="left", color=INK)
        axes.set_xlim(0, 1)
        if place % 2 == 0:
            axes.set_ylabel("angle [rad]")
        if place // 2 == 1:
            axes.set_xlabel("time since the start of the prediction [s]")
    lines = [Line2D([], [], color=MUTED, linewidth=5, alpha=0.35),
             *(Line2D([], [], color=MUTED, linestyle=dashes) for dashes in styles.values()),
             Line2D([], [], color=LINK1, linewidth=5), Line2D([], [], color=LINK2, linewidth=5)]
    fig.legend(lines, ["measured", *names, "joint 1", "joint 2"], loc="upper center", ncols=5, handlelength=2.2,
               bbox_to_anchor=(0.52, 0.99))
    return fig


@figure("machine-learn")
def machine_learn():
    """Tip and torque of a machine without a model, from the first twitch to balance."""
    rows = data_of(CSV / "machine-learn.csv")
    runs = {}
    for row in rows:
        runs.setdefault(row["phase"], []).append({name: float(value) for name, value in row.items()})
    fig = canvas(800, 400)
    height, torque = panel(fig, 95, 40, 685, 190), panel(fig, 95, 250, 685, 90)
    titles = ("torques grow", "larger torques", "TVLQR, designed on the twin", "brakes")
    for title, run in zip(titles, runs.values()):
        time = [row["time"] for row in run]
        height.plot(time, [row["height"] for row in run], color=LINK2)
        torque.plot(time, [row["torque"] for row in run], color=TORQUE, linewidth=1.2)
        for axes in (height, torque):
            axes.axvline(time[0], color=MUTED, linewidth=1.3, linestyle=(0, (4, 3)))
        height.text(time[0] + 0.2, 1.08, title, transform=height.get_xaxis_transform(), va="center", color=MUTED)
    for axes in (height, torque):
        axes.set_xlim(0, float(rows[-1]["time"]))
    height.tick_params(labelbottom=False)
    height.set_ylim(-1.08, 1.08)
    height.set_yticks([-1, 0, 1], ["hanging", "0", "upright"])
    height.set_ylabel("height of the tip")
    torque.set_ylim(-5.8, 5.8)
    torque.set_yticks([-5, 0, 5])
    torque.set_ylabel("torque [N·m]")
    torque.set_xlabel("time of motion [s]")
    fig.align_ylabels([height, torque])
    return fig


def success_map(axes, grid, extent):
    """Success from 0 to 1, with the same colours in every map."""
    return axes.imshow(grid, origin="lower", extent=extent, cmap="viridis", vmin=0, vmax=1, interpolation="nearest",
                       aspect="auto")


def edges(centers):
    half = (centers[-1] - centers[0]) / (len(centers) - 1) / 2
    return centers[0] - half, centers[-1] + half


@figure("maps")
def maps():
    """Success over the masses of both links, for an agent of one plant and an agent that identifies
    its plant."""
    fig, image = canvas(800, 440), None
    for k, (agent, left) in enumerate((("d3qn", 70), ("d3qn-adaptive", 390))):
        rows = data_of(CSV / f"map-{agent}.csv")
        x, y = (sorted({float(row[name]) for row in rows}) for name in ("mass1", "mass2"))
        success = {(float(row["mass1"]), float(row["mass2"])): float(row["success_rate"]) for row in rows}
        axes = panel(fig, left, 40, 300, 300)
        image = success_map(axes, [[success[mass1, mass2] for mass1 in x] for mass2 in y], (*edges(x), *edges(y)))
        axes.grid(visible=False)
        axes.plot(1, 1, "o", markerfacecolor="none", markeredgecolor="#ffffff", markersize=13, markeredgewidth=3.5)
        axes.plot(1, 1, "o", markerfacecolor="none", markeredgecolor="#d84a4a", markersize=13, markeredgewidth=2)
        if agent == "d3qn-adaptive":
            for color, width in (("#ffffff", 3.5), ("#d84a4a", 2)):
                axes.plot([0.75, 1.25, 1.25, 0.75, 0.75], [0.75, 0.75, 1.25, 1.25, 0.75], color=color, linewidth=width)
        axes.set_xticks([0.6, 0.8, 1, 1.2, 1.4])
        axes.set_yticks([0.6, 0.8, 1, 1.2, 1.4], None if k == 0 else [""] * 5)
        axes.set_xlabel("mass of link 1 [kg]")
        if k == 0:
            axes.set_ylabel("mass of link 2 [kg]")
        note(fig, left + 150, 22, agent, ha="center", color=AGENTS[agent], fontweight="bold")
    bar = fig.colorbar(image, cax=panel(fig, 724, 40, 16, 300), ticks=[0, 0.25, 0.5, 0.75, 1])
    bar.ax.set_yticklabels(["0%", "25%", "50%", "75%", "100%"])
    bar.outline.set_visible(False)
    bar.ax.grid(visible=False)
    note(fig, 724, 22, "success")
    for x, marker, name in ((120, "o", "nominal plant"), (330, "s", "±25%: the plants of d3qn-adaptive's training")):
        mark = panel(fig, x, 412, 20, 20)
        mark.set_axis_off()
        mark.plot(0, 0, marker, markerfacecolor="none", markeredgecolor="#d84a4a", markersize=13, markeredgewidth=2,
                  clip_on=False)
        note(fig, x + 28, 422, name)
    return fig


@figure("lqr-catch")
def lqr_catch():
    """States at rest from which the LQR catches the pendulum."""
    rows = data_of(CSV / "lqr-catch.csv")
    first, *columns = rows[0]
    x, y = [float(column) for column in columns], [float(row[first]) for row in rows]
    fig = canvas(800, 500)
    axes = panel(fig, 90, 20, 420, 420)
    success_map(axes, [[int(row[column]) for column in columns] for row in rows], (*edges(x), *edges(y)))
    axes.grid(visible=False)
    axes.set_xticks([150, 165, 180, 195, 210])
    axes.set_yticks([-30, -15, 0, 15, 30])
    axes.set_xlabel("θ₁ [°]")
    axes.set_ylabel("θ₂ [°]")
    from matplotlib import colormaps
    for k, (share, name) in enumerate(((1.0, "upright in the end"), (0.0, "not"))):
        mark = panel(fig, 540, 30 + 34 * k, 18, 18, xticks=[], yticks=[], facecolor=colormaps["viridis"](share))
        mark.spines[:].set_visible(False)
        note(fig, 568, 39 + 34 * k, name)
    note(fig, 540, 118, "Each start is at rest.", color=MUTED)
    return fig


@figure("pareto")
def pareto():
    """Return against torque change, for all agents and controllers with at least 90% of the best known
    return."""
    columns, rows = table("overview")
    share, variation = (next(k for k, column in enumerate(columns) if column.startswith(name))
                        for name in ("return / best known", "torque variation"))
    points = [(row[0], number(row[variation]), number(row[share])) for row in rows if number(row[share]) >= 90]
    fig = canvas(800, 500)
    axes = panel(fig, 80, 40, 700, 390)
    axes.set_xscale("log")
    smallest, largest = min(x for _, x, _ in points), max(x for _, x, _ in points)
    axes.set_xlim(smallest / 1.5, largest * 1.8)
    axes.set_ylim(min(y for _, _, y in points) - 1, max(y for _, _, y in points) + 1)
    decades = [tick for tick in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)
               if axes.get_xlim()[0] <= tick <= axes.get_xlim()[1]]
    axes.set_xticks(decades, [f"{tick:g}" for tick in decades])
    axes.minorticks_off()
    axes.set_xlabel("torque change [N·m/s] (less is smoother)")
    axes.set_ylabel("return / best known [%]")

    best, front = -math.inf, []
    for _, x, y in sorted(points, key=lambda point: (point[1], -point[2])):
        if y > best:
            front.append((x, y))
            best = y
    corners = [front[0]]
    for x, y in front[1:]:
        corners += [(x, corners[-1][1]), (x, y)]
    corners = [(front[0][0], axes.get_ylim()[0]), *corners, (axes.get_xlim()[1], corners[-1][1])]
    axes.plot(*zip(*corners), color=MUTED, linewidth=1.3, linestyle=(0, (4, 3)), zorder=1)

    pixels = {name: axes.transData.transform((x, y)) for name, x, y in points}
    taken = [(x - 8, y - 8, x + 8, y + 8) for x, y in pixels.values()]
    steps = axes.transData.transform(corners)
    taken += [(min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]) + 1, max(a[1], b[1]) + 1) for a, b in zip(steps, steps[1:])]
    for name, x, y in points:
        axes.plot(x, y, "s" if name in CONTROLLERS else "o", markersize=11, zorder=3, color=AGENTS[name],
                  markeredgecolor=PAPER, markeredgewidth=1)
        place_label(axes, name, pixels[name], taken)
    from matplotlib.lines import Line2D
    marks = [Line2D([], [], color=MUTED, marker=marker, linestyle="none", markersize=10) for marker in "os"]
    marks.append(Line2D([], [], color=MUTED, linewidth=1.3, linestyle=(0, (4, 3))))
    axes.legend(marks, ["agent", "controller", "best trade-offs"], loc="lower center",
                bbox_to_anchor=(0.5, 1.0), ncols=3, borderpad=0, handletextpad=0.4)
    return fig


def place_label(axes, name, at, taken):
    """Writes a name next to its dot, where no dot, line or earlier name is."""
    width, height = 8 * len(name), 15
    (left, bottom), (right, top) = axes.transAxes.transform([(0, 0), (1, 1)])
    for dx, dy, align in ((11, 0, "left"), (-11, 0, "right"), (0, 17, "center"), (0, -17, "center"), (11, 15, "left"),
                          (11, -15, "left"), (-11, 15, "right"), (-11, -15, "right"), (0, 30, "center"),
                          (0, -30, "center"), (24, 26, "left"), (24, -26, "left"), (0, 45, "center")):
        x = at[0] + dx - {"left": 0, "center": width / 2, "right": width}[align]
        box = (x, at[1] + dy - height / 2, x + width, at[1] + dy + height / 2)
        inside = left <= box[0] and box[2] <= right + 10 and bottom <= box[1] and box[3] <= top + 10
        if inside and not any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in taken):
            break
    taken.append(box)
    axes.annotate(name, at, (dx, dy), xycoords="figure pixels", textcoords="offset points", ha=align, va="center",
                  color=AGENTS[name], fontweight="bold", annotation_clip=False)


@figure("success-by-delta")
def success_by_delta():
    """Success over |δ|, with Wilson's 95% intervals."""
    columns, rows = table("robustness-delta")
    rows = [row for row in rows if row[0] != "all"]
    fig = canvas(800, 420)
    axes = panel(fig, 80, 20, 700, 330)
    middle = (len(columns) - 3) / 2
    for k, name in enumerate(columns[2:]):
        x = [place + 0.12 * (k - middle) for place in range(len(rows))]
        shares = [number(row[k + 2]) / 100 for row in rows]
        bounds = [wilson(round(share * number(row[1])), number(row[1])) for share, row in zip(shares, rows)]
        color = AGENTS[name.split()[0]]
        axes.plot(x, [100 * share for share in shares], color=color, linewidth=1.3, alpha=0.6)
        axes.vlines(x, [100 * low for low, _ in bounds], [100 * high for _, high in bounds], color=color, linewidth=2.5)
        axes.plot(x, [100 * share for share in shares], "o", color=color, markersize=8, markeredgecolor=PAPER, label=name)
    axes.set_xticks(range(len(rows)), [row[0].replace(" to ", "–") for row in rows])
    axes.grid(axis="x", visible=False)
    axes.set_ylim(-3, 103)
    axes.set_ylabel("success [%]")
    axes.set_xlabel("|δ| of the plant")
    from matplotlib.lines import Line2D
    handles, names = axes.get_legend_handles_labels()
    bar = Line2D([], [], color=MUTED, marker="|", markersize=15, markeredgewidth=2.5, linestyle="none")
    axes.legend([*handles, bar], [*names, "bar: 95% interval"], loc="lower right", handlelength=1)
    return fig


STATISTICS = {"mean": "#2f7de0", "median": "#d9662a", "IQM": "#1a9b6c", "Welch's t, 5%": "#d0478f",
              "Mann-Whitney, 5%": "#b98200", "bootstrap of IQM, 95%": "#8a6fe0"}


@figure("seeds-wrong")
def seeds_wrong():
    """Share of wrong conclusions over the number of seeds, by return."""
    rows = data_of(FIGURES / "seeds/seeds.csv")
    rows = [row for row in rows if row["score"] == "best_return"]
    comparisons = list(dict.fromkeys(row["comparison"] for row in rows))
    fig = canvas(800, 550)
    for k, comparison in enumerate(comparisons):
        axes = panel(fig, 60 + 252 * (k % 3), 86 + 236 * (k // 3), 220, 168)
        for statistic, color in STATISTICS.items():
            chosen = [(int(row["seeds"]), 100 * float(row["wrong"])) for row in rows
                      if row["comparison"] == comparison and row["statistic"] == statistic]
            bare = "," not in statistic
            axes.plot(*zip(*chosen), marker="o" if bare else "s", markersize=5, color=color, linewidth=1.8,
                      linestyle="-" if bare else (0, (3, 1.5)), label=statistic)
        axes.set_xscale("log")
        axes.minorticks_off()
        axes.set_xticks([3, 5, 10, 30, 100], ["3", "5", "10", "30", "100"])
        axes.set_ylim(0, 50)
        axes.set_yticks(range(0, 51, 10), None if k % 3 == 0 else [""] * 6)
        title = comparison if " " in comparison else f"fast or {comparison}"
        note(fig, 170 + 252 * (k % 3), 74 + 236 * (k // 3), title, ha="center", color=MUTED)
        if k == 0:
            fig.legend(loc="upper center", ncols=3, bbox_to_anchor=(0.5, 1.0), handlelength=1.8, columnspacing=2)
    note(fig, 16, 290, "wrong conclusions [%]", rotation=90, ha="center")
    note(fig, 422, 532, "seeds of each agent", ha="center")
    return fig


@figure("seeds-distribution")
def seeds_distribution():
    """Histograms of steps to solve and of return over ten thousand seeds of fast."""
    rows = data_of(FIGURES / "seeds/fast.csv")
    fig = canvas(800, 330)
    for column, scale, width, label, left in (("solve_steps", 1000, 10, "steps to solve [thousands]", 75),
                                              ("best_return", 1, 15, "return of the best policy", 450)):
        values = [float(row[column]) / scale for row in rows]
        first = width * math.floor(min(values) / width)
        bins = [first + width * k for k in range(int((max(values) - first) / width) + 2)]
        axes = panel(fig, left, 16, 325, 250)
        axes.hist(values, bins=bins, color=AGENTS["fast"], histtype="stepfilled")
        axes.set_yscale("log")
        axes.set_ylim(0.7, None)
        axes.set_yticks([1, 10, 100, 1000], ["1", "10", "100", "1,000"])
        axes.minorticks_off()
        axes.grid(axis="x", visible=False)
        axes.xaxis.set_major_formatter("{x:,.0f}")
        axes.set_xlabel(label)
        if column == "solve_steps":
            axes.set_ylabel("seeds")
    return fig


# --- Data from the program ---

def measure(program):
    """Runs the program for the figures that show its output."""
    import tempfile
    agents = ROOT / "web/public/agents"
    CSV.mkdir(parents=True, exist_ok=True)

    def run(*words):
        return subprocess.run([program, *map(str, words)], check=True, stdout=subprocess.PIPE, text=True).stdout

    def write(name, header, lines):
        with open(CSV / name, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([header, *lines])

    names = {"t": "t", "q1": "q1", "q2": "q2", "torque": "torque", "inverted": "inverted", "reward": "reward",
             "energy_reward": "energy", "height_reward": "height", "balance_reward": "balance",
             "velocity_penalty": "velocity_penalty", "torque_penalty": "torque_penalty"}
    rows = csv.DictReader(run("simulate", agents / "d3qn.safetensors", "--seconds", 6, "--csv", "-").splitlines())
    write("episode.csv", names.values(), [[f"{float(row[name]):.6g}" for name in names] for row in rows])

    lines = []
    for start, goal in ((a, b) for a in POSES for b in POSES if a != b):
        text = run("simulate", agents / "any-pose.safetensors", "--start", ",".join(map(str, (*POSES[start], 0, 0))),
                   "--goal", goal, "--seconds", 6, "--csv", "-")
        for row in csv.DictReader(text.splitlines()):
            lines.append([start, goal, *(f"{float(row[name]):.5g}" for name in ("t", "q1", "q2", "inverted"))])
    write("poses.csv", ["from", "to", "t", "q1", "q2", "inverted"], lines)

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        run("map", *(agents / f"{name}.safetensors" for name in ("d3qn", "d3qn-adaptive")), "--x", "mass1=-40%:+40%:21",
            "--y", "mass2=-40%:+40%:21", "--episodes", 5, "--out", out / "maps")
        run("map", "lqr", "--x", "q1=150deg:210deg:121", "--y", "q2=-30deg:30deg:121", "--out", out / "lqr")
        keep_maps(out / "maps", write)
        keep_lqr(out / "lqr", write)
        run("machine", "learn", "--link", "realaigym-twin", "--encoder-counts", 16384, "--out", out / "learn")
        keep_learning(out / "learn", write)


def keep_learning(folder, write):
    """The runs of `machine learn`, 25 rows per second: height of the tip (-1 to 1) and torque."""
    lengths = 0.2, 0.3  # m, of the benchmark's robot
    lines = []
    for phase, log in enumerate(sorted(folder.glob("log-*.csv")), 1):
        for row in rows_of(log)[::20]:
            phase += phase == 3 and row["state"] == "3"  # brakes after the balance
            q1, q2 = float(row["pos_meas1"]), float(row["pos_meas2"])
            height = -(lengths[0] * math.cos(q1) + lengths[1] * math.cos(q1 + q2)) / sum(lengths)
            lines.append([phase, f"{float(row['time']):.3f}", f"{height:.4f}", f"{float(row['tau_con1']):.3f}"])
    write("machine-learn.csv", ["phase", "time", "height", "torque"], lines)


def keep_maps(folder, write):
    for k, agent in enumerate(("d3qn", "d3qn-adaptive"), 1):
        header = ["mass1", "mass2", "episodes", "success_rate"]
        write(f"map-{agent}.csv", header,
              [[f"{float(row[name]):.6g}" for name in header] for row in rows_of(folder / f"map-{k}.csv")])


def keep_lqr(folder, write):
    """A line for each q2, a column for each q1 [°]: 1 if upright at the end."""
    grid = {}
    for row in rows_of(folder / "map.csv"):
        grid.setdefault(float(row["q2"]), {})[float(row["q1"])] = row["successes"]
    write("lqr-catch.csv", ["q2 / q1", *(f"{q1:g}" for q1 in next(iter(grid.values())))],
          [[f"{q2:g}", *line.values()] for q2, line in grid.items()])


def draw(name):
    """The SVG of a figure, or None if its data do not exist."""
    style()
    try:
        return svg(DRAWN[name]())
    except NoData:
        return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help=f"figures to draw [all]: {', '.join(DRAWN)}")
    parser.add_argument("--measure", action="store_true", help="run the program for episode, poses, maps, lqr-catch and machine-learn first")
    parser.add_argument("--program", default=str(ROOT / "upswing"), help="program that --measure runs")
    a = parser.parse_args()
    for name in a.figures:
        if name not in DRAWN:
            parser.error(f"FIGURE: expected one of {', '.join(DRAWN)}, got {name}")
    if a.measure:
        measure(a.program)
    for name in a.figures or DRAWN:
        text = draw(name)
        if text is None:
            print(f"{name}: no data, not drawn")
            continue
        path = FIGURES / f"{name}.svg"
        path.write_text(text, encoding="utf-8")
        print(f"{path.relative_to(ROOT)}: {len(text) // 1000} kB")


if __name__ == "__main__":
    main()
