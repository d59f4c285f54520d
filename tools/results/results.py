#!/usr/bin/env python3
"""Measured numbers and generated tables of the documentation.

  results.py write            renders every table in README.md and docs/ from docs/results/data
  results.py check            lists the outdated tables; exit code 1 if there are any
  results.py measure ID       runs the commands of a table and rewrites docs/results/data/ID.json
  results.py measure ID --try    prints the table with few seeds and episodes; writes nothing
  results.py compare ID       prints the table of this machine next to the documented one
  results.py machine          adds this machine to machines.json and prints its ID

docs/results/data/ID.json holds one table, as it is displayed:

  {"title": …, "commands": […], "measured": {"version": …, "date": …, "machine": …, "commit": …},
   "columns": […], "rows": [[…], …]}

Pages show it between `<!-- table: ID -->` and `<!-- end -->`, above a line that names version, date,
machine and first command; `<!-- table: ID ROW ROW -->` shows some rows. They show one cell of it in a sentence as
`<!-- value: ID ROW COLUMN -->text<!-- end -->`. ROW is the text of the first cell without
backticks; COLUMN is an index or a header. A page can also show the table of the machines
(`<!-- generated: machines -->` … `<!-- end -->`) and lines of a recorded output
(`<!-- generated: output first-training 12-13 -->` … `<!-- end -->`).
"""

import argparse
import csv
import datetime
import functools
import json
import math
import os
import platform
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import program  # noqa: E402
from pages import markdown_table, pages, without_code  # noqa: E402
from program import ROOT  # noqa: E402

DATA = ROOT / "docs/results/data"
MACHINES_PAGE = ROOT / "docs/results/index.md"
UNRECORDED = "unrecorded"  # machine of an old table
BLOCK = re.compile(r"(<!-- (table|generated): ([^\n]+?) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
VALUE = re.compile(r"<!-- value: (\S+) ([^\n]+?) -->(.*?)<!-- end -->", re.DOTALL)


class Problem(Exception):
    """A problem of a page or a table, in one line."""


# --- Tables -------------------------------------------------------------------------------------


def machines(data=DATA):
    return json.loads((data / "machines.json").read_text(encoding="utf-8"))


def load(table_id, data=DATA):
    """A measured table, checked."""
    path = data / f"{table_id}.json"
    if not path.exists():
        raise Problem(f"{table_id}: there is no {path.name} in docs/results/data")
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        columns, rows, measured = table["columns"], table["rows"], table["measured"]
        missing = {"version", "date", "machine", "commit"} - set(measured)
    except (ValueError, KeyError, TypeError) as error:
        raise Problem(f"{path.name}: expected a table, got {error!r}") from None
    if missing:
        raise Problem(f"{path.name}: measured lacks {', '.join(sorted(missing))}")
    if measured["machine"] not in machines(data):
        raise Problem(f"{path.name}: machine {measured['machine']} is not in machines.json")
    for row in rows:
        if len(row) != len(columns) or not all(isinstance(cell, str) for cell in row):
            raise Problem(f"{path.name}: expected {len(columns)} texts in each row, got {row}")
    return table


def cell_of(table, row_and_column):
    """The cell named by `ROW COLUMN`; both may contain blanks."""
    words = row_and_column.split(" ")
    names = [row[0].replace("`", "") for row in table["rows"]]
    headers = [header.replace("`", "") for header in table["columns"]]
    for cut in range(1, len(words)):
        row, column = " ".join(words[:cut]), " ".join(words[cut:])
        if row not in names:
            continue
        cells = table["rows"][names.index(row)]
        if column in headers:
            return cells[headers.index(column)]
        if column.isdecimal() and int(column) < len(cells):
            return cells[int(column)]
    raise Problem(f"no row and column are called \"{row_and_column}\"")


# --- Generated blocks ----------------------------------------------------------------------------

GENERATED = {}


def generated(name):
    def add(function):
        GENERATED[name] = function
        return function
    return add


@generated("machines")
def machines_table():
    return markdown_table(["machine", "processor", "cores", "memory", "system"],
                          [[f"`{name}`", each["cpu"], str(each["cores"]), each["memory"],
                            each["system"]] for name, each in machines().items()
                           if name != UNRECORDED])


@generated("output")
def output_lines(table_id, *ranges):
    """Lines of a recorded output as an indented block. A range is `7` or `7-9`, from 1; `…` stands
    for lines that are left out."""
    lines = [row[0] for row in load(table_id)["rows"]]
    text = ""
    for each in ranges:
        if each == "…":
            text += "      …\n"
            continue
        first, _, last = each.partition("-")
        if not 1 <= int(first) <= int(last or first) <= len(lines):
            raise Problem(f"{table_id}: expected lines within 1-{len(lines)}, got {each}")
        text += "".join(f"    {line}\n" for line in lines[int(first) - 1:int(last or first)])
    return f"\n{text}\n"


# --- Pages --------------------------------------------------------------------------------------


def origin(table, page):
    """The line below a measured table: version, date, machine and commands."""
    measured, commands = table["measured"], table["commands"]
    parts = [f"Version {measured['version']}", measured["date"]]
    if measured["machine"] != UNRECORDED:
        place = os.path.relpath(MACHINES_PAGE, page.parent)
        parts.append(f"[{measured['machine']}]({place}#machines)")
    line = ", ".join(parts)
    if commands:
        number = f"first of {len(commands)} commands: " if len(commands) > 1 else ""
        line += f"; {number}`{commands[0]}`"
    return f"\n*{line}*\n"


def render(kind, name, page=MACHINES_PAGE):
    function, *arguments = name.split()
    if kind == "table":
        table = load(function)
        rows = {row[0].replace("`", ""): row for row in table["rows"]}
        if unknown := set(arguments) - set(rows):
            raise Problem(f"expected rows of {function}, got {', '.join(sorted(unknown))}")
        chosen = [rows[row] for row in arguments] or table["rows"]
        return markdown_table(table["columns"], chosen) + origin(table, page)
    if function not in GENERATED:
        raise Problem(f"generated: expected one of {', '.join(GENERATED)}, got {function}")
    return GENERATED[function](*arguments)


def rendered(text, page=MACHINES_PAGE):
    """The text of a page with all its tables rendered."""
    seen = without_code(text)
    pieces, end = [], 0
    for block in BLOCK.finditer(seen):
        pieces += [text[end:block.end(1)], render(block[2], block[3], page)]
        end = block.start(5)
    return "".join([*pieces, text[end:]])


def problems_of(text, page=MACHINES_PAGE):
    """The problems of a page's text."""
    seen = without_code(text)
    opened, closed = len(re.findall(r"<!-- (?:table|generated|value): ", seen)), seen.count("<!-- end -->")
    if opened != closed:
        yield f"{opened} markers open a table or value and {closed} end one"
    for block in BLOCK.finditer(seen):
        try:
            if render(block[2], block[3], page) != block[4]:
                yield f"{block[2]} {block[3]}: out of date; run tools/results/results.py write"
        except Problem as problem:
            yield str(problem)
    for value in VALUE.finditer(seen):
        try:
            cell = cell_of(load(value[1]), value[2])
            if not re.search(rf"(?<![\d.,]){re.escape(value[3])}(?![\d]|[.,]\d)", cell):
                yield f"value {value[1]} {value[2]}: \"{value[3]}\" does not occur in \"{cell}\""
        except Problem as problem:
            yield f"value {value[1]}: {problem}"


def check():
    problems = [f"{page.relative_to(ROOT)}: {problem}" for page in pages()
                for problem in problems_of(page.read_text(encoding="utf-8"), page)]
    for path in sorted(DATA.glob("*.json")):
        try:
            if path.stem != "machines":
                load(path.stem)
        except Problem as problem:
            problems.append(str(problem))
    print("".join(f"{problem}\n" for problem in problems), end="")
    return 1 if problems else 0


def write():
    for page in pages():
        text = page.read_text(encoding="utf-8")
        try:
            new = rendered(text, page)
        except Problem as problem:
            print(f"{page.relative_to(ROOT)}: {problem}", file=sys.stderr)
            return 1
        if new != text:
            page.write_text(new, encoding="utf-8")
            print(page.relative_to(ROOT))
    return 0


# --- Measurements -------------------------------------------------------------------------------

RECIPES = {}
NONE = "–"  # not measured, or not applicable


def recipe(table_id):
    """Declares how to measure a table: a function that takes a Lab and returns columns and rows."""
    def add(function):
        RECIPES[table_id] = function
        return function
    return add


class Lab:
    """Runs commands as a reader would, and records them.

    `few` means a trial: two seeds and a handful of episodes."""

    def __init__(self, folder, few):
        self.folder = folder
        self.few = few
        self.commands = []

    def run(self, *arguments, record=True, codes=(0,)):
        """The output of a command of the program, whose exit code is one of `codes`. The record
        shows `runs` as the folder."""
        arguments = [str(argument) for argument in arguments]
        if record:
            self.commands.append("./upswing " + " ".join(arguments).replace(str(self.folder), "runs"))
        done = subprocess.run([ROOT / "upswing", "--no-setup", *arguments], cwd=ROOT, check=False,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, encoding="utf-8")
        if done.returncode not in codes:
            raise Problem(f"./upswing {' '.join(arguments)}: {done.stderr.strip()}")
        return done.stdout

    def json(self, *arguments, **more):
        return json.loads(self.run(*arguments, "--json", **more))

    def wall_clock(self, *arguments, **more):
        """Seconds from the command line to the next prompt."""
        begin = time.monotonic()
        self.run(*arguments, **more)
        return time.monotonic() - begin

    def cpu_seconds(self, *arguments, **more):
        """Processor time of a command [s]."""
        def used():
            usage = resource.getrusage(resource.RUSAGE_CHILDREN)
            return usage.ru_utime + usage.ru_stime
        begin = used()
        self.run(*arguments, **more)
        return used() - begin


PAGE_AGENTS = Path("web/public/agents")
OVERVIEW_AGENTS = ("d3qn", "dqn", "double-dqn", "dueling-dqn", "fast", "sac", "sac-fast", "ppo",
                   "d3qn-randomized", "d3qn-adaptive")
CONTROLLERS = ("lqr", "energy", "pfl", "tvlqr", "mpc")
SLOW = {"mpc"}  # plans at each decision, so it gets fewer random plants
LONG = {"d3qn-randomized", "d3qn-adaptive"}  # train for minutes, so their time is not measured


def best_known_returns():
    """The best known return of the first episodes of the evaluation (swing_up_bound.py)."""
    table = load("best-known")
    column = table["columns"].index("best known return")
    return [float(row[column].replace(",", "")) for row in table["rows"][:-1]]  # without the mean


def percent(share):
    return f"{100 * share:.1f}%".replace(".0%", "%")


@recipe("overview")
def overview(lab):
    """Measures the page's policies. The first seed trained for the time replaces a missing one."""
    episodes = 2 if lab.few else 100
    policies, seconds = {}, {}
    for agent in OVERVIEW_AGENTS[4:5] if lab.few else OVERVIEW_AGENTS:
        shown = PAGE_AGENTS / f"{agent}.safetensors"
        if agent in LONG:
            policies[agent] = str(shown)
            continue
        outs = [lab.folder / f"{agent}-seed{seed}" for seed in range(1, 2 if lab.few else 6)]
        times = [lab.wall_clock("train", "--agent", agent, "--seed", k + 1, "--out", out,
                                *(["--steps", 4000] if lab.few else [])) for k, out in enumerate(outs)]
        seconds[agent] = format_number(statistics.median(times), 2)
        policies[agent] = str(shown if (ROOT / shown).exists() else outs[0])
    policies |= {name: name for name in (CONTROLLERS[-1:] if lab.few else CONTROLLERS)}
    policies["hybrid"] = "hybrid"
    nominal, box, shares, best = {}, {}, {}, best_known_returns()
    for name, policy in policies.items():
        more = ["--swing-up", PAGE_AGENTS / "fast.safetensors"] if name == "hybrid" else []
        nominal[name] = lab.json("eval", policy, *more, "--episodes", episodes)
        same = lab.json("eval", policy, *more, "--episodes", len(best))
        shares[name] = same["return"]["mean"] / statistics.mean(best)
        plants = 2 if lab.few else 100 if name in SLOW else 1000
        box[name] = lab.json("eval", policy, *more, "--randomize", 0.25, "--episodes", plants)
    rows = []
    for name, figures in nominal.items():
        median = (figures["swing_up_seconds"] or {}).get("median")  # null: no episode swings up
        rows.append([f"`{name}`", percent(figures["success_rate"]),
                     NONE if median is None else f"{median:.2f}",
                     percent(shares[name]),
                     percent(box[name]["success_rate"]),
                     f"{figures['torque_variation']['mean']:.1f}", seconds.get(name, NONE)])
    return ["agent", "success", "swing-up [s]", "return / best known", "±25% plants",
            "torque variation [N·m/s]", "time to train [s]"], rows


STUDIES = ("curriculum", "extensions", "ppo-parts", "reward", "sac-extensions")


def study(lab, name, last=None):
    """A study's variants, in the order of its file. `last` is a further column: its name, and a
    function that returns the cell of a group."""
    file = Path("configs/studies", f"{name}.toml")
    out = lab.folder / name
    lab.run("study", file, *(["--seeds", 2] if lab.few else []), "--jobs", 1, "--out", out)
    groups = {group["group"]: group for group in lab.json("compare", out)["groups"]}
    rows = []
    for variant in tomllib.loads((ROOT / file).read_text(encoding="utf-8"))["variants"]:
        group = groups[variant]
        steps, value = group["solve_steps"]["median"], group["final_return"]["iqm"]
        low, high = value["interval_95"]
        once_solved = group["once_solved"]
        rows.append([f"`{variant}`", f"{group['solved']} of {len(group['runs'])}",
                     NONE if steps is None else f"{steps:,.0f}",
                     f"{value['value']:,.0f} ({low:,.0f} to {high:,.0f})",
                     f"{once_solved['steady_seeds']} of {once_solved['seeds']}" if once_solved["seeds"] else NONE,
                     *([last[1](group)] if last else [])])
    return ["variant", "solved", "steps to solve: median", "return at the end: IQM (95% interval)",
            "stayed solved", *([last[0]] if last else [])], rows


for _name in STUDIES:
    RECIPES[_name] = functools.partial(study, name=_name)
RECIPES["post"] = functools.partial(
    study, name="post", last=("expected / attained value at the end: median",
                              lambda group: f"{group['final_value_ratio']['median']:.2f}"))


@recipe("control-decision")
def control_decision(lab):
    """Processor time of a decision in many episodes at once, physics included."""
    rows = []
    for name in ("d3qn", "fast", "sac", "d3qn-adaptive", "lqr", "tvlqr", "mpc"):
        episodes = 2 if lab.few else 20 if name in SLOW else 1000
        policy = name if name in CONTROLLERS else PAGE_AGENTS / f"{name}.safetensors"
        seconds = lab.cpu_seconds("eval", policy, "--threads", 1, "--physics", "closed-form",
                                  "--episodes", episodes)
        rows.append([f"`{name}`", format_number(1e6 * seconds / (1000 * episodes), 2)])
    return ["controller", "a decision [µs]"], rows


@recipe("lqr-catch")
def lqr_catch(lab):
    rows = []
    for k, flags in enumerate(([], ["--made-for", "torque_limit=10"])):
        chart = lab.json("map", "lqr", *flags, "--x", "q1=150deg:210deg:121", "--y", "q2=-30deg:30deg:121",
                         "--out", lab.folder / f"lqr{k}")
        rows.append([f"`{' '.join(flags)}`" if flags else "none", percent(chart["mean_success_rate"])])
    return ["flags", "caught at once"], rows


@recipe("robustness-randomized")
def told_and_untold(lab):
    rows = []
    for box in (0, 0.1, 0.25):
        row = ["nominal" if box == 0 else f"±{100 * box:g}%"]
        for agent, flags in (("d3qn", []), ("d3qn-randomized", []), ("d3qn-randomized", ["--unknown-plant"])):
            got = lab.json("eval", PAGE_AGENTS / f"{agent}.safetensors", "--randomize", box,
                           "--episodes", 4 if lab.few else 1000, "--seed", 1, "--physics", "closed-form", *flags)
            low, high = got["success_interval_95"]
            row.append(f"{percent(got['success_rate'])} ({percent(low)} to {percent(high)})")
        rows.append(row)
    return ["box", "`d3qn`", "`d3qn-randomized`", "`d3qn-randomized`, `--unknown-plant`"], rows


@recipe("first-training")
def first_training(lab):
    """The output of a training without clock times and threads: the same lines on every machine."""
    text = lab.run("train", "--agent", "fast", *(["--steps", 4000] if lab.few else []),
                   "--out", lab.folder / "fast-seed1")
    lab.commands = ["./upswing train --agent fast"]
    text = re.sub(r" +[\d.]+ s +[\d,]+ updates/s", "  …", text.replace(str(lab.folder), "runs"))
    text = re.sub(r"[\d.]+ s\b", "… s", re.sub(r"\d+ threads?", "… threads", text))
    return ["output"], [[line] for line in text.splitlines()]


@recipe("perf-c")
def exported_headers(lab):
    rows = []
    for agent in ("ppo", "fast", "sac", "d3qn-randomized", "d3qn"):
        text = lab.run("export", PAGE_AGENTS / f"{agent}.safetensors", "--c", lab.folder / "policy.h")
        rows.append([f"`{agent}`", *re.findall(r"([\d,]+) (?:KB|bytes|multiply-adds)", text)])
    return ["agent", "header [KB]", "constants [B]", "state [B]", "stack [B]", "multiply-adds"], rows


OPERATIONS = {
    "BM_Update/fast/manual_time": "update of `fast`", "BM_Update/d3qn/manual_time": "update of `d3qn`",
    "BM_Update/sac/manual_time": "update of `sac`", "BM_Update/ppo/manual_time": "update of `ppo`",
    "BM_MpcDecision/manual_time": "decision of `mpc`",
    "BM_LinearForward/B:128/in:256/out:256": "layer of 256 × 256, 128 rows",
    "BM_Adam/100000": "Adam, 100,000 parameters",
    "BM_ReplaySample/1000000": "minibatch of 64 out of 1,000,000",
    "BM_AdvanceAndJudge/N:1024": "step of 1,024 pendulums"}


@recipe("perf-parts")
def parts(lab):
    """Processor time of operations on one thread: medians of five repetitions."""
    few = ["--benchmark_min_time=0.001"] if lab.few else []
    text = lab.run("test", "--benchmarks", "--benchmark_format=json", *few,
                   "--benchmark_repetitions=" + ("2" if lab.few else "5"),
                   "--benchmark_filter=" + "|".join(f"^{name}$" for name in OPERATIONS))
    lab.commands = ["./upswing test --benchmarks --benchmark_repetitions=5"]
    medians = {}
    for each in json.loads(text)["benchmarks"]:
        if each.get("aggregate_name") == "median":
            time_of = each["real_time" if "manual_time" in each["run_name"] else "cpu_time"]
            medians[each["run_name"]] = time_of * {"ns": 1e-3, "us": 1, "ms": 1e3}[each["time_unit"]]
    return ["operation", "time [µs]"], [[label, format_number(medians[name], 2)]
                                        for name, label in OPERATIONS.items()]


@recipe("time-to-solve")
def time_to_solve(lab):
    rows = []
    for agent in ("d3qn", "fast", "sac", "sac-fast", "ppo"):
        few = ["--steps", 4000] if lab.few else []
        out = lab.folder / agent
        lab.run("train", "--agent", agent, "--seeds", 2 if lab.few else 20, "--threads", 2,
                "--jobs", 1, "--out", out, *few)
        (group,) = lab.json("compare", out)["groups"]
        rows.append([f"`{agent}`", f"{group['solved']} of {len(group['runs'])}",
                     spread(group["solve_seconds"], lambda x: format_number(x, 2)),
                     spread(group["solve_steps"], lambda x: f"{x:,.0f}")])
    return ["agent", "solved", "time to solve [s]: median (range)",
            "steps to solve: median (range)"], rows


@recipe("price-of-return")
def price_of_return(lab):
    """What four times the steps bring after the task is solved, on five seeds of each agent."""
    best = best_known_returns()

    def trained(agent, seed, name, *more):
        """A training's last step, and its policy's share of the best known return."""
        out = lab.folder / f"{agent}-seed{seed}{name}"
        lab.run("train", "--agent", agent, "--seed", seed, *more, "--out", out)
        evaluations = list(csv.DictReader((out / "evals.csv").open(encoding="utf-8")))
        report = lab.json("eval", out, "--episodes", len(best))
        return int(evaluations[-1]["step"]), report["return"]["mean"] / statistics.mean(best)

    rows = []
    for agent in ("fast",) if lab.few else ("fast", "sac", "ppo", "d3qn"):
        first, last, price = [], [], []
        for seed in range(21, 22 if lab.few else 26):
            few = ["--steps", 20000] if lab.few else []
            steps, solved = trained(agent, seed, "", *few)
            _, longer = trained(agent, seed, "-longer", "--no-stop-when-solved", "--steps", 4 * steps)
            first.append(solved)
            last.append(longer)
            price.append(3 * steps / (100 * (longer - solved)) if longer > solved else math.inf)
        rows.append([f"`{agent}`", *(spread({"median": statistics.median(values), "values": values}, text)
                                     for values, text in ((first, percent), (last, percent), (price, steps_text)))])
    return ["agent", "return / best known when solved: median (range)", "after four times the steps",
            "further steps for each 1% gained"], rows


def steps_text(steps):
    """Steps in thousands, or that the longer training brought no gain."""
    return "no gain" if math.isinf(steps) else f"{1000 * round(steps / 1000):,}"


def spread(figure, text):
    """Text such as `0.5 (0.3 to 0.7)`: median and range over the seeds that solved."""
    if figure["median"] is None:
        return NONE
    values = [value for value in figure["values"] if value is not None]
    return f"{text(figure['median'])} ({text(min(values))} to {text(max(values))})"


def format_number(value, digits):
    """A number with `digits` significant digits, never with an exponent."""
    if value == 0:
        return "0"
    decimals = max(0, digits - 1 - int(f"{abs(value):e}".split("e")[1]))
    return f"{value:,.{decimals}f}" if decimals else f"{round(value):,}"


REAL = Path(os.environ.get("UPSWING_REAL", ROOT.parent / "shared/real")) / "C.1"
# A clone of github.com/dfki-ric-underactuated-lab/double_pendulum, with runs 06 to 10 of the sessions.
HELD_OUT = Path(os.environ.get("UPSWING_HELD_OUT", ROOT.parent / "double_pendulum"))
JUDGED = (0, 1)  # exit codes of commands that judge a twin
LAWS = {"tvlqr": "TVLQR", "mcpilco": "MC-PILCO"}
REAL_SESSIONS = {f"{robot}, {LAWS[law]}{', pushed' if folder == 'pushed' else ''}":
                 f"{folder}/{robot}-{law}"
                 for folder, robot, law in (
                     ("swingup", "acrobot", "tvlqr"), ("swingup", "pendubot", "tvlqr"),
                     ("swingup", "acrobot", "mcpilco"), ("swingup", "pendubot", "mcpilco"),
                     ("pushed", "acrobot", "tvlqr"), ("pushed", "pendubot", "tvlqr"))}


def runs_of(session, numbers):
    return [REAL / f"{session}-{k:02}.csv.gz" for k in numbers]


def with_session_values(plant, twin, out):
    """Writes a plant with the zeros, dry friction, delay and lag of a twin."""
    merged, taken = (tomllib.loads(path.read_text(encoding="utf-8")) for path in (plant, twin))
    for table, names in (("plant", ("coulomb1", "coulomb2")), ("actuator", ("delay", "lag")),
                         ("sensors", ("zero1", "zero2"))):
        merged[table] |= {name: taken[table][name] for name in names}
    text = f'name = "{out.stem}"\n'
    for table in ("plant", "actuator", "sensors"):
        text += f"[{table}]\n" + "".join(f"{name} = {x!r}\n" for name, x in merged[table].items())
    out.write_text(text, encoding="utf-8")


def twins_of(lab, session, record):
    """Twins for a session: of the other sessions, and two that are adapted to its run 01."""
    others = [run for other in REAL_SESSIONS.values() if other != session
              for run in runs_of(other, range(1, 6))]
    others += sorted((REAL / "sysid").glob("*.csv.gz"))
    twins = {kind: lab.folder / f"{kind}-{session.replace('/', '-')}.toml"
             for kind in ("others", "today", "c1-today")}
    lab.run("machine", "identify", *others, "--plant", "realaigym-c1", "--folds", 0, "--out",
            twins["others"], record=record, codes=JUDGED)
    for prior, kind in ((twins["others"], "today"), ("realaigym-c1", "c1-today")):
        lab.run("machine", "adapt", prior, *runs_of(session, [1]), "--out", twins[kind],
                record=record, codes=JUDGED)
    return twins


def errors_of(lab, twin, runs, others, record):
    """Windows of runs, and the median errors [rad] over 1 s of a twin and of other models."""
    against = [word for other in others for word in ("--against", other)]
    report = lab.json("machine", "validate", twin, *runs, *against, record=record, codes=JUDGED)
    row = next(row for row in report["errors"]
               if (row["seconds"], row["torques"]) == (1, "commanded"))
    return [str(row["windows"]),
            *(f"{error['value']:.3f}" for error in row["median_error_rad"].values())]


@recipe("machine-sessions")
def machine_sessions(lab):
    """Errors of models on runs 02 to 05 of a real session. No model saw these runs."""
    rows = []
    for name, session in list(REAL_SESSIONS.items())[-1 if lab.few else 0:]:
        record = not rows  # the commands of the first session are enough
        twins = twins_of(lab, session, record)
        c1_session = lab.folder / f"c1-session-{session.replace('/', '-')}.toml"
        with_session_values(ROOT / "configs/plants/realaigym-c1.toml", twins["today"], c1_session)
        rows.append([name, *errors_of(lab, twins["others"], runs_of(session, range(2, 6)),
                                      [twins["today"], twins["c1-today"], c1_session, "realaigym-c1"],
                                      record)])
    return ["session", "windows", "twin of the other sessions [rad]", "adapted to run 01",
            "C.1 model 1.0, adapted to run 01", "C.1 model 1.0 with session values",
            "C.1 model 1.0"], rows


def held_out_runs(lab, session):
    """Runs 06 to 10 of a session, which the shipped twin and the choice of priors have not seen."""
    folder, (robot, law) = session.split("/")[0], session.split("/")[1].split("-")
    board = "real_hardware_perturbed_v2" if folder == "pushed" else "real_hardware_v2"
    published = HELD_OUT / "leaderboard" / robot / board / "src_data" / {
        "tvlqr": "ilqr_tvlqr_lqr"}.get(law, law)
    runs = []
    for number in range(6, 11):
        (log,) = (published / f"experiment{number:02}").glob("*.csv")
        runs.append(lab.folder / f"{folder}/{robot}-{law}-{number:02}.csv")
        runs[-1].parent.mkdir(exist_ok=True)
        shutil.copy(log, runs[-1])
    return runs


@recipe("machine-held-out")
def machine_held_out(lab):
    """Errors of models on runs 06 to 10 of a real session."""
    rows = []
    for name, session in list(REAL_SESSIONS.items())[-1 if lab.few else 0:]:
        record = not rows
        twins = twins_of(lab, session, record)
        rows.append([name, *errors_of(lab, twins["others"], held_out_runs(lab, session),
                                      [twins["today"], twins["c1-today"], "realaigym-twin",
                                       "realaigym-c1"], record)])
    return ["session", "windows", "twin of the other sessions [rad]", "adapted to run 01",
            "C.1 model 1.0, adapted to run 01", "shipped twin", "C.1 model 1.0"], rows


REALAIGYM_REWARDS = {
    "pendubot": "E+h+5*inverted+5*(h>0.95); -0.03*min(w1^2+w2^2,300)-10*max(E-1.05,0); "
                "-0.15*tau^2-(upright>0.4)*2*min(tau^2,1); -0.5*dtau^2/(1+2*abs(dtau))",
    "acrobot": "E+h+5*inverted+5*(h>0.95); -0.015*min(w1^2+w2^2,400)-10*max(E-1.05,0); "
               "-0.15*tau^2-(upright>0.4)*2*min(tau^2,1); -0.5*dtau^2/(1+2*abs(dtau))"}
REALAIGYM_STEPS = {"pendubot": 250000, "acrobot": 400000}
REALAIGYM_FLAGS = {"pendubot": ["--gamma", "0.985"],
                   "acrobot": ["--actuated-joint", "2", "--gamma", "0.99"]}
REALAIGYM_SETTINGS = (
    "--agent sac --plant realaigym --hidden 64,64 --batch 128 --replay 1000000 --n-step 5 "
    "--no-prioritized --no-mirror --reward-centering 0 --envs 64 --threads 1 "
    "--no-stop-when-solved --eval-every 1000000 --eval-episodes 1 --start-noise 0.01 "
    "--start-noise-end 0.01 --episode-seconds 2 --random-start-share 0.7 --learning-starts 5000 "
    "--updates-per-step 0.15 --target-entropy -2").split()
# Training with a learning rate of 0 only hands the policy on to another control period.
EVERY_2_MS = "--control-period 0.002 --steps 64 --learning-rate 0 --learning-rate-end 0".split()


def swing_up_settings(robot):
    """Settings of the trainings for version 2 of RealAIGym, without steps and seed."""
    return [*REALAIGYM_SETTINGS, *REALAIGYM_FLAGS[robot], "--reward", REALAIGYM_REWARDS[robot]]


def swing_up_scores(lab, robot, seed):
    """S and R of a training every 20 ms, then of the same policy every 2 ms."""
    settings = [*swing_up_settings(robot), "--seed", seed]
    steps = REALAIGYM_STEPS[robot]
    slow, fast = (lab.folder / f"{robot}{period}-seed{seed}" for period in ("", "-2ms"))
    lab.run("train", *settings, "--steps", 6400 if lab.few else steps, "--learning-rate-steps",
            steps, "--out", slow)
    lab.run("train", *settings, "--start-policy", slow, *EVERY_2_MS, "--out", fast)
    scores = []
    for run in (slow, fast):
        report = lab.json("realaigym", "score", run, "--score-version", 2)
        scores += [report["performance"]["score"], report["robustness"]["score"]]
    return scores


@recipe("realaigym-swing-up")
def realaigym_swing_up(lab):
    """Version 2 of RealAIGym: five trainings for each robot, at two control periods."""
    rows = []
    for seed in range(21, 22 if lab.few else 26):
        row = []
        for robot in REALAIGYM_REWARDS:
            row += swing_up_scores(lab, robot, seed)
        rows.append(row)
    lab.commands = ["./upswing realaigym score runs/ROBOT-2ms-seedSEED --score-version 2"]
    table = [[str(21 + k), *(f"{score:.3f}" for score in row)] for k, row in enumerate(rows)]
    if not lab.few:
        table.append(["mean ± deviation", *(f"{statistics.mean(x):.3f} ± {statistics.stdev(x):.3f}"
                                            for x in zip(*rows))])
    return ["training seed", *(f"{robot}, {name}, every {period} ms" for robot in REALAIGYM_REWARDS
                               for period in (20, 2) for name in ("S", "R"))], table


def this_machine():
    """This machine: processor, cores, memory and system."""
    text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    name = re.search(r"^model name\s*: (.*)", text, re.MULTILINE)
    kilobytes = int(re.search(r"MemTotal:\s*(\d+)",
                              Path("/proc/meminfo").read_text(encoding="utf-8"))[1])
    release = platform.freedesktop_os_release()
    return {"cpu": name[1].strip() if name else platform.processor() or platform.machine(),
            "cores": len(os.sched_getaffinity(0)), "memory": f"{round(kilobytes / 2**20)} GiB",
            "system": f"{release['PRETTY_NAME']}, {platform.machine()}"}


def machine_id():
    """The ID of this machine in machines.json; adds a new machine."""
    known, mine = machines(), this_machine()
    for name, each in known.items():
        if each == mine:
            return name
    word = re.search(r"EPYC|Xeon|Ryzen|Threadripper|Core|Neoverse|Apple", mine["cpu"])
    base = f"{word[0].lower() if word else platform.machine()}-{mine['cores']}"
    name = next(name for name in [base, *(f"{base}-{k}" for k in range(2, 100))] if name not in known)
    known[name] = mine
    write_json(DATA / "machines.json", known)
    return name


def write_json(path, value):
    path.write_text(json.dumps(value, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def measured_rows(table_id, few):
    """The commands, columns and rows of a table on this machine."""
    if table_id not in RECIPES:
        raise Problem(f"ID: expected one of {', '.join(RECIPES)}, got {table_id}")
    with tempfile.TemporaryDirectory(prefix="upswing-results-") as folder:
        lab = Lab(Path(folder), few)
        columns, rows = RECIPES[table_id](lab)
    return lab.commands, columns, rows


def compare(table_id, few):
    """Prints the table of this machine next to the documented one."""
    documented = load(table_id)
    _, columns, rows = measured_rows(table_id, few)
    if columns != documented["columns"]:
        raise Problem(f"{table_id}: expected the columns {documented['columns']}, got {columns}")
    known = {row[0]: row[1:] for row in documented["rows"]}
    machine = documented["measured"]["machine"]
    headings = [f"{column}, {where}" for column in columns[1:] for where in ("here", machine)]
    missing = [NONE] * len(columns[1:])
    pairs = [[row[0], *(cell for pair in zip(row[1:], known.get(row[0], missing)) for cell in pair)]
              for row in rows]
    print(markdown_table([columns[0], *headings], pairs), end="")


def measure(table_id, few):
    commands, columns, rows = measured_rows(table_id, few)
    if few:
        print(markdown_table(columns, rows), end="")
        return
    path = DATA / f"{table_id}.json"
    old = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, check=True,
                            stdout=subprocess.PIPE, encoding="utf-8").stdout.strip()
    measured = {"version": program.program("--version").split()[-1],
                "date": datetime.date.today().strftime("%Y-%m"), "machine": machine_id(),
                "commit": commit}
    write_json(path, {"title": old.get("title", table_id.replace("-", " ").capitalize()),
                      "commands": commands, "measured": measured, "columns": columns,
                      "rows": rows})


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    actions = parser.add_subparsers(dest="action", required=True)
    for name in ("write", "check", "machine"):
        actions.add_parser(name)
    measuring = actions.add_parser("measure", help="measure a table of the documentation again")
    comparing = actions.add_parser(
        "compare", help="print a table of this machine next to the documented one")
    for action in (measuring, comparing):
        action.add_argument("id", help=f"one of {', '.join(RECIPES)}")
        action.add_argument("--try", dest="few", action="store_true",
                            help="few seeds and episodes; print the table, keep the old one")
    arguments = parser.parse_args()
    try:
        match arguments.action:
            case "write":
                return write()
            case "check":
                return check()
            case "machine":
                print(machine_id())
            case "measure":
                measure(arguments.id, arguments.few)
            case "compare":
                compare(arguments.id, arguments.few)
    except Problem as problem:
        print(f"results.py: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
