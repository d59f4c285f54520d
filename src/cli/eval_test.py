#!/usr/bin/env python3
"""Tests of `upswing eval`: its table, its JSON, and that repeating it gives the same result."""

import csv
import json
import math
import re
import sys
import unittest

from testing import REWARD_TERMS, ROOT, ProgramTest, train_once

sys.path.insert(0, str(ROOT / "tools/results/seeds"))
from wilson import wilson  # noqa: E402

PLANT = {"mass1": 1, "mass2": 1, "length1": 0.5, "length2": 0.5, "damping1": 0.2, "damping2": 0.2,
         "gravity": 9.81, "torque_limit": 5}


def added(rows, column):
    """The sum of a column in the order of the rows, without the compensation of sum()."""
    total = 0.0
    for row in rows:
        total += row[column]
    return total


def moments_text(moments):
    """Moments as the table shows them: two digits of the deviation, or its whole part."""
    decimals = max(0, 1 - math.floor(math.log10(moments["deviation"])))
    return f"{moments['mean']:.{decimals}f} ± {moments['deviation']:.{decimals}f}"


class EvalTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        # An easy plant, so that there are successes to test.
        cls.policy = train_once(cls, gravity=0.05, damping=1, hidden="64,64", head=32,
                                eval_episodes=1, steps=100000, checkpoint_every=20000)

    def evaluate(self, *more, episodes=10):
        return json.loads(self.succeed("eval", self.policy, "--json", "--episodes", episodes,
                                       *more))

    def test_json_has_all_fields(self):
        result = self.evaluate()
        self.assertEqual(list(result), [
            "policy", "seed", "physics", "task", "plant", "control_period", "unknown_plant", "disturbance",
            "randomize", "episodes", "successes", "diverged", "success_rate",
            "success_interval_95", "settled", "steady_tilt_degrees", "reward_terms", "return",
            "swing_up_seconds", "settling_seconds", "energy_used", "peak_torque", "rms_torque",
            "torque_variation", "torque_variation_upright", "torque_changes_upright", "value", "discounted_return"])
        self.assertEqual(result["plant"], PLANT | {"gravity": 0.05, "damping1": 1, "damping2": 1})
        self.assertEqual(result["policy"], str(self.policy / "policy.safetensors"))
        self.assertEqual(list(result["reward_terms"]), REWARD_TERMS)
        self.assertEqual(result["disturbance"], {
            "sensor_noise": 0, "delay": 0, "sensor_latency": 0, "encoder_counts": 0,
            "velocity_window": 0, "velocity_filter": 0, "zero1": 0, "zero2": 0, "late_share": 0, "late": 0})
        self.assertEqual(set(result["randomize"].values()), {0})

    def test_several_policies_get_the_same_episodes(self):
        names = ["sac", "d3qn", "any-pose", "d3qn-adaptive", "energy"]
        flags = ["--episodes", 12, "--seed", 3, "--physics", "closed-form", "--goal", "up-up",
                 "--sensor-noise", 0.02, "--randomize", 0.05]
        rows = list(csv.DictReader(self.succeed("eval", *names, *flags, "--episodes-csv",
                                                "-").splitlines()))
        both = json.loads(self.succeed("eval", *names, *flags, "--json"))
        self.assertEqual([row["policy"] for row in rows[::12]], names)
        columns = ["q1", "q2", "w1", "w2", "mass1", "length2", "sensor_noise"]
        for name, alone in zip(names, both["policies"]):
            mine = [row for row in rows if row["policy"] == name]
            for row, first in zip(mine, rows):
                self.assertEqual([row[c] for c in columns], [first[c] for c in columns])
            self.assertEqual(alone, json.loads(self.succeed("eval", name, *flags, "--json")))
        # Each difference is the mean over the pairs, and lies in its interval.
        self.assertEqual([d["policy"] for d in both["differences"]], names[1:])
        first, *others = [[row for row in rows if row["policy"] == name] for name in names]
        for difference, other in zip(both["differences"], others):
            self.assertEqual(difference["minus"], "sac")
            for figure, column in (("return", "return"), ("success_rate", "success"),
                                   ("swing_up_seconds", "swing_up_seconds")):
                pairs = [float(x[column]) - float(y[column]) for x, y in zip(other, first)
                         if x[column] and y[column]]
                got = difference[figure]
                if not pairs:
                    self.assertIsNone(got)
                    continue
                self.assertEqual(got["episodes"], len(pairs))
                self.assertAlmostEqual(got["mean"], math.fsum(pairs) / len(pairs), delta=1e-9)
                if len(set(pairs)) == 1:
                    self.assertIsNone(got["interval_95"])
                else:
                    low, high = got["interval_95"]
                    self.assertTrue(low <= got["mean"] <= high)

    def test_the_table_of_several_policies(self):
        table = self.succeed("eval", "sac", self.policy, "lqr", "--episodes", 3, "--plant",
                             "realaigym", "--physics", "closed-form").splitlines()
        self.assertEqual(table[0], "The same 3 episodes for all")
        rows = [line.split()[0] for line in table if line.startswith("  ")]
        self.assertEqual(rows.count("lqr"), 2)
        self.assertIn("  note           lqr: the controller balances and does not swing up; episodes start hanging",
                      table)
        self.assertEqual(rows.count("sac"), 1)
        self.assertIn("minus sac, in the same episodes", "\n".join(table))
        # The columns stand in line, also below wide cells.
        wide = self.succeed("eval", "fast", "mpc", "--episodes", 5, "--randomize", 0.1).splitlines()
        header = next(line for line in wide if "success [%]" in line)
        cells = [line for line in wide if line.startswith(("  fast ", "  mpc "))]
        self.assertEqual(len(cells), 3)
        for title in ("success", "return", "swing-up", "torque"):
            at = header.index(title)
            for line in cells:
                self.assertRegex(line[at - 2:at + 1], r"  \S")
        # No episode in which both swing up has a difference.
        difference = next(line for line in reversed(table) if "lqr" in line)
        self.assertRegex(difference, r"  none  ")

    def test_a_controller_that_cannot_be_designed_is_a_row(self):
        dry = ["--plant", "realaigym-c1", "--episodes", 3, "--physics", "closed-form"]
        names = ["sac", "energy", "pfl"]
        flags = ["--made-for", "realaigym-c1", "--made-for", "coulomb1=1", "--made-for", "coulomb2=1"]
        reason = "lqr: found no region of attraction"
        table = self.run_here("eval", *names, *dry, *flags)
        self.assertEqual(table.returncode, 1)
        self.assertRegex(table.stdout, rf"(?m)^  energy +not designed: {reason}")
        self.assertRegex(table.stdout, r"(?m)^  sac  +\d")
        self.assertIn(f"not designed: energy: {reason}", table.stderr)
        done = self.run_here("eval", *names, *dry, *flags, "--json")
        self.assertEqual(done.returncode, 1)
        result = json.loads(done.stdout)
        self.assertEqual([report["policy"] for report in result["policies"]], ["sac"])
        self.assertEqual([row["policy"] for row in result["undesigned"]], ["energy", "pfl"])
        rows = self.run_here("eval", *names, *dry, *flags, "--episodes-csv", "-")
        self.assertEqual(rows.returncode, 1)
        self.assertEqual([row["policy"] for row in csv.DictReader(rows.stdout.splitlines())], 3 * ["sac"])
        # None is left, a controller by itself, and mistakes in arguments.
        done = self.run_here("eval", "pfl", "energy", *dry, *flags)
        self.assert_one_line(done, 1, reason)
        self.refuse(["eval", "energy", *dry, *flags], reason)
        self.refuse(["eval", "sac", "energy", *dry, "--made-for", "mass=heavy"], "--made-for", "heavy")

    def test_policies_that_cannot_share_episodes_are_refused(self):
        self.refuse(["eval", "sac", "missing"], "missing: no such file")
        self.refuse(["eval", "sac", "d3qn", "sac"], "sac: expected each policy once, got it twice")
        self.refuse(["eval", "sac", self.policy], "expected the plant of sac (damping1 0.2, damping2 0.2, "
                    "gravity 9.81), got damping1 1, damping2 1, gravity 0.05", "--plant")
        self.refuse(["eval", "sac", "any-pose"], "any-pose: expected the goal of sac (up-up), got "
                    "another one in each episode", "--goal up-up")
        self.refuse(["eval", "mpc", "sac", "--known-plant"], "--known-plant", "got sac")
        self.refuse(["eval", "sac", "d3qn", "--mpc-seconds", 2], "--mpc-seconds", "sac, d3qn")

    def test_on_a_terminal_the_bar_is_gone_when_the_table_comes(self):
        lines = self.screen("eval", self.policy, "--episodes", 40, "--threads", 1)
        self.assertEqual([line for line in lines if "episodes/s" in line], [])
        self.assertIn("success", lines[2])

    def test_a_controller_that_knows_the_plant_is_made_for_it(self):
        def rows(*more):
            return self.succeed("eval", "tvlqr", "--episodes", 2, "--set", "mass2=1.3",
                                "--episodes-csv", "-", *more)
        known = rows("--known-plant")
        self.assertEqual(known, rows("--made-for", "mass2=1.3"))
        self.assertNotEqual(known, rows())
        drawn = json.loads(self.succeed("eval", "tvlqr", "--known-plant", "--randomize", 0.1,
                                        "--episodes", 3, "--json"))
        self.assertEqual(drawn["known_plant"], 3)
        # No motor holds this plant, so no controller is designed for it.
        lost = json.loads(self.succeed("eval", "lqr", "--known-plant", "--set", "damping2=0.38977",
                                       "--episodes", 2, "--json"))
        self.assertEqual((lost["known_plant"], lost["successes"]), (0, 0))
        self.refuse(["eval", self.policy, "--known-plant"], "--known-plant", "controller")
        self.refuse(["eval", "lqr", "--known-plant", "--unknown-plant"], "--unknown-plant")

    def test_flags_change_the_plant_as_set_does(self):
        def figures(*changes):
            return json.loads(self.succeed("eval", "lqr", "--episodes", 2, "--json", *changes))
        by_flags = figures("--mass", 1.2, "--mass2", 1.3, "--gravity", 5)
        by_set = figures("--set", "mass=1.2", "--set", "mass2=1.3", "--set", "gravity=5")
        self.assertEqual(by_flags, by_set)
        self.assertEqual(figures("--mass2", 1.1, "--set", "mass2=1.3"), figures("--mass2", 1.3))
        self.refuse(["eval", "lqr", "--mass2", "-1"], "--mass2", "expected a number")
        self.refuse(["eval", "lqr", "--mas2", "1"], "--mas2", "did you mean --mass2?")

    def test_numbers_are_plausible(self):
        result = self.evaluate()
        self.assertEqual(result["success_rate"], result["successes"] / 10)
        self.assertGreater(result["successes"], 0)
        low, high = result["swing_up_seconds"]["quartiles"]
        self.assertTrue(0 < low <= result["swing_up_seconds"]["median"] <= high <= 10)
        self.assertAlmostEqual(sum(result["reward_terms"].values()), result["return"]["mean"],
                               delta=1e-6)
        self.assertTrue(0 < result["rms_torque"]["mean"] <= result["peak_torque"] <= 5)
        self.assertGreater(result["energy_used"]["mean"], 0)

    def test_interval_is_wilsons_and_holds_the_rate(self):
        for change in ("gravity=0.05", "gravity=0.8", "gravity=9.81"):
            result = self.evaluate("--set", change)
            low, high = result["success_interval_95"]
            self.assertTrue(0 <= low <= result["success_rate"] <= high <= 1)
            expected = wilson(result["successes"], 10)
            self.assertAlmostEqual(low, expected[0], delta=1e-12)
            self.assertAlmostEqual(high, expected[1], delta=1e-12)

    def test_nothing_swung_up_is_null(self):
        result = self.evaluate("--set", "gravity=30", "--set", "torque_limit=0.01", episodes=2)
        self.assertEqual((result["successes"], result["swing_up_seconds"]), (0, None))
        for name in ("settling_seconds", "steady_tilt_degrees", "torque_changes_upright"):
            self.assertIsNone(result[name], name)
        table = self.succeed("eval", self.policy, "--episodes", 2, "--set", "gravity=30",
                             "--set", "torque_limit=0.01")
        self.assertIn("no episode stays upright", table)

    def test_same_seed_same_answer_and_another_seed_another(self):
        self.assertEqual(self.evaluate("--seed", 7), self.evaluate("--seed", 7))
        self.assertNotEqual(self.evaluate("--seed", 7)["return"],
                            self.evaluate("--seed", 8)["return"])

    def test_threads_do_not_matter(self):
        self.assertEqual(self.evaluate("--threads", 1), self.evaluate("--threads", 3))

    def test_set_changes_plant_and_result(self):
        usual = self.evaluate()
        changed = self.evaluate("--set", "mass2=1.2")
        self.assertEqual(changed["plant"], usual["plant"] | {"mass2": 1.2})
        self.assertNotEqual(changed["return"], usual["return"])

    def test_the_closed_form_judges_as_mujoco_does(self):
        usual = self.evaluate()
        twin = self.evaluate("--physics", "closed-form")
        self.assertEqual((usual["physics"], twin["physics"]), ("mujoco", "closed-form"))
        self.assertEqual(twin["successes"], usual["successes"])
        self.assertAlmostEqual(twin["return"]["mean"], usual["return"]["mean"],
                               delta=1e-3 * abs(usual["return"]["mean"]))

    def test_set_of_both(self):
        both = self.evaluate("--set", "mass=2")
        self.assertEqual((both["plant"]["mass1"], both["plant"]["mass2"]), (2, 2))
        self.assertEqual(both, self.evaluate("--set", "mass1=2", "--set", "mass2=2"))

    def test_the_last_set_counts(self):
        self.assertEqual(self.evaluate("--set", "mass=2", "--set", "mass2=1")["plant"]["mass2"], 1)

    def test_table_and_json_agree(self):
        result = self.evaluate()
        table = self.succeed("eval", self.policy, "--episodes", 10)
        self.assertNotIn("\x1b", table)
        low, high = result["success_interval_95"]
        self.assertIn(f"{result['successes']} of 10 = {100 * result['success_rate']:.1f}%", table)
        self.assertIn(f"(95% interval {100 * low:.1f}% to {100 * high:.1f}%)", table)
        self.assertIn(f"swing-up time  {result['swing_up_seconds']['median']:.2f} s", table)
        for term, value in result["reward_terms"].items():
            self.assertRegex(table, rf"{term} +{re.escape(f'{value:.2f}')}\n")
        for words in ("return", "energy used", "peak", "rms", "gravity 0.05",
                      "± is the standard deviation over the episodes"):
            self.assertIn(words, table)
        for name, words in (("torque_variation", "torque change  {} N·m/s; "),
                            ("torque_variation_upright", "; {} N·m/s once upright\n"),
                            ("torque_changes_upright", "chatter        {} torque changes per second once upright")):
            self.assertIn(words.format(moments_text(result[name])), table)
        tilt = result["steady_tilt_degrees"]["link1"]
        self.assertIn(f"link 1 {moments_text(tilt)}°", table)
        self.assertIn(f"{result['value']:.4g} expected, {result['discounted_return']:.4g} attained",
                      table)

    def replay(self, episode, *flags):
        """The rows of `simulate` for an episode."""
        text = self.succeed("simulate", self.policy, "--episode", episode, *flags)
        return [{name: float(cell) for name, cell in row.items()}
                for row in csv.DictReader(text.splitlines())]

    def episodes(self, *flags, count=6):
        self.succeed("eval", self.policy, "--episodes", count, "--episodes-csv", "episodes.csv",
                     *flags)
        with open(self.folder / "episodes.csv", encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def test_episodes_match_the_summary(self):
        flags = ("--randomize", 0.4, "--seed", 3)
        rows = self.episodes(*flags)
        result = self.evaluate(*flags, episodes=6)
        self.assertEqual([row["episode"] for row in rows], ["0", "1", "2", "3", "4", "5"])
        self.assertEqual(sum(row["success"] == "1" for row in rows), result["successes"])
        for column, figure in (("return", "return"), ("energy_used", "energy_used"),
                               ("rms_torque", "rms_torque"),
                               ("torque_variation", "torque_variation")):
            mean = sum(float(row[column]) for row in rows) / 6
            self.assertAlmostEqual(mean, result[figure]["mean"], delta=1e-9 * max(1, abs(mean)))
        self.assertEqual(len({row["mass1"] for row in rows}), 6)
        for row in rows:
            for column in ("swing_up_seconds", "torque_changes_upright"):
                self.assertEqual(row[column] != "", row["success"] == "1")
        # More episodes extend the list of fewer episodes.
        self.assertEqual(self.episodes(*flags, count=8)[:6], rows)

    def test_an_episode_that_fails_upright_has_no_swing_up_time(self):
        """Episodes 10 and 31 of these are upright at their end, for less than 10 s."""
        flags = ("--randomize", 0.4, "--episodes", 32)
        text = self.succeed("eval", "fast", *flags, "--episodes-csv", "-")
        rows = list(csv.DictReader(text.splitlines()))
        self.assertIn("failure, upright from ",
                      self.succeed("simulate", "fast", *flags[:2], "--episode", 31, "--csv", "e.csv"))
        for row in rows:
            for column in ("swing_up_seconds", "torque_variation_upright", "torque_changes_upright"):
                self.assertEqual(row[column] != "", row["success"] == "1")
            self.assertTrue(row["settling_seconds"] == "" or row["success"] == "1")
        # The same policy with another name: all differences are 0, over the successes.
        (self.folder / "same.safetensors").write_bytes(
            (ROOT / "web/public/agents/fast.safetensors").read_bytes())
        both = json.loads(self.succeed("eval", "fast", "same.safetensors", *flags, "--json"))
        successes = sum(row["success"] == "1" for row in rows)
        for column in ("swing_up_seconds", "torque_variation_upright", "torque_changes_upright"):
            self.assertEqual(both["differences"][0][column]["episodes"], successes)

    def test_diverged_episodes_are_counted(self):
        flags = ("--mass", 0.01, "--length", 0.1, "--torque-limit", 1000, "--armature", 0,
                 "--damping", 0, "--episodes", 4)
        note = "the simulation diverged in 4 of 4 episodes, which count as failures\n"
        self.assertIn(f"  note           {note}", self.succeed("eval", "tvlqr", *flags))
        self.assertIn(f"  note           tvlqr: {note}", self.succeed("eval", "tvlqr", "sac", *flags))
        self.assertEqual(json.loads(self.succeed("eval", "tvlqr", *flags, "--json"))["diverged"], 4)
        self.assertEqual(self.evaluate()["diverged"], 0)
        self.assertNotIn("diverged", self.succeed("eval", self.policy, "--episodes", 4))

    def test_simulate_and_plot_say_the_torque_of_the_episode(self):
        flags = ("--seed", 5)
        judged = self.episodes(*flags)
        for number in (0, 3):
            row = judged[number]
            text = self.succeed("simulate", self.policy, *flags, "--episode", number, "--csv",
                                f"{number}.csv")
            figures = [f"peak {float(row['peak_torque']):.4g} N·m",
                       f"rms {float(row['rms_torque']):.4g} N·m",
                       f"variation {float(row['torque_variation']):.4g} N·m/s"]
            if row["torque_variation_upright"]:
                figures.append(f"once upright {float(row['torque_variation_upright']):.4g} N·m/s")
            line = "  torque     " + ", ".join(figures) + "\n"
            self.assertIn(line, text)
        self.assertIn(line, self.succeed("plot", self.policy, *flags, "--episode", number))

    def test_an_episode_can_be_made_again_to_the_last_digit(self):
        for flags in (("--randomize", 0.5, "--sensor-noise", 0.02, "--randomize-delay", 0.06),
                      ("--delay", 0.04, "--seed", 7, "--set", "mass2=1.2", "--unknown-plant"),
                      ("--physics", "closed-form", "--randomize", 0.3,
                       "--randomize-sensor-noise", 0.05)):
            judged = self.episodes(*flags)
            for episode in (0, 5):
                self.assert_same_episode(judged[episode], self.replay(episode, *flags))

    def assert_same_episode(self, judged, rows):
        number = {name: float(text) for name, text in judged.items() if text}
        self.assertEqual(len(rows), 1001)
        for name in ("q1", "q2", "w1", "w2"):
            self.assertEqual(rows[0][name], number[name])
        # The rows of the first 10 s add up to the return, to the last digit.
        self.assertEqual(added(rows[:500], "reward"), number["return"])
        for name, column in zip(REWARD_TERMS, ("energy_reward", "height_reward", "balance_reward",
                                               "velocity_penalty", "torque_penalty")):
            self.assertEqual(added(rows[:500], column), number[name])
        since = len(rows)
        while since > 0 and rows[since - 1]["inverted"]:
            since -= 1
        self.assertEqual(number["success"], float(since <= 500))
        self.assertEqual("swing_up_seconds" in number, since <= 500)
        if since <= 500:
            self.assertAlmostEqual(number["swing_up_seconds"], max(since, 1) / 50, delta=1e-12)
        torques = [row["torque"] for row in rows[:1000]]
        self.assertEqual(number["peak_torque"], max(map(abs, torques)))
        variation = sum(abs(b - a) for a, b in zip(torques, torques[1:]))
        self.assertAlmostEqual(number["torque_variation"], variation / 20, delta=1e-9)
        for link, angle in (("tilt1_degrees", lambda row: row["q1"]),
                            ("tilt2_degrees", lambda row: row["q1"] + row["q2"])):
            lean = [math.remainder(angle(row) - math.pi, 2 * math.pi) for row in rows[950:1000]]
            self.assertAlmostEqual(number[link], math.degrees(sum(lean) / 50), delta=1e-9)

    def test_simulate_and_plot_agree_with_eval(self):
        flags = ("--randomize", 0.5, "--seed", 2)
        row = self.episodes(*flags)[4]
        verdict = "success" if row["success"] == "1" else "failure"
        for arguments in (("simulate", self.policy, "--csv", "out.csv"), ("plot", self.policy)):
            text = self.succeed(*arguments, "--episode", 4, *flags)
            self.assertIn(f"4 of eval: {verdict}, ", text)
            self.assertIn(f"return {float(row['return']):.6g}\n", text)
            self.assertIn(f"mass1 {row['mass1']}, ", text)

    def test_the_plant_may_be_unknown(self):
        usual, blind = (self.evaluate("--set", "mass2=1.4", *more)
                        for more in ((), ("--unknown-plant",)))
        self.assertEqual((usual["unknown_plant"], blind["unknown_plant"]), (False, True))
        self.assertNotEqual(usual["return"], blind["return"])
        self.assertEqual(blind["plant"], usual["plant"])
        # On the training's plant, the flag changes nothing.
        self.assertEqual(self.evaluate("--unknown-plant")["return"], self.evaluate()["return"])
        self.assertIn("the plant unknown to the policy",
                      self.succeed("eval", self.policy, "--episodes", 1, "--unknown-plant"))

    def test_bad_episodes(self):
        self.refuse(["simulate", self.policy, "--episode", 1, "--start", "0,0,0,0"], "--start",
                    "with --episode")
        self.refuse(["plot", self.policy, "--episode", -1], "--episode")
        self.refuse(["simulate", "--unknown-plant"], "--unknown-plant: expected a policy")
        self.refuse(["eval", self.policy, "--episodes-csv", ""], "--episodes-csv")
        self.refuse(["eval", self.policy, "--episodes-csv", "-", "--json"], "--json",
                    "--episodes-csv")

    def test_episodes_on_standard_output_are_only_a_table(self):
        rows = self.episodes()
        text = self.succeed("eval", self.policy, "--episodes", 6, "--episodes-csv", "-")
        self.assertEqual(list(csv.DictReader(text.splitlines())), rows)

    def test_means_and_deviations_have_the_same_decimals(self):
        # Random plants: the return differs by hundreds, the tilt by fractions of a degree.
        text = self.succeed("eval", self.policy, "--episodes", 6, "--randomize", 0.4)
        pairs = re.findall(r"(\S+) ± ([^\s°]+)", text)
        self.assertGreater(len(pairs), 3)
        for mean, deviation in pairs:
            with self.subTest(mean=mean, deviation=deviation):
                self.assertRegex(deviation, r"^\d+(\.\d+)?$")
                self.assertEqual(*(len(number.partition(".")[2]) for number in (mean, deviation)))

    def test_random_plants_are_said_and_change_the_result(self):
        usual = self.evaluate()
        box = self.evaluate("--randomize", 0.25)
        self.assertEqual({name: width for name, width in box["randomize"].items() if width},
                         {f"randomize_{name}": 0.25 for name in PLANT if name != "torque_limit"})
        self.assertEqual(box["plant"], usual["plant"])
        self.assertNotEqual(box["return"], usual["return"])
        self.assertEqual(box, self.evaluate("--randomize", 0.25, "--threads", 3))
        # One plant from the box, and a box without width.
        self.assertNotEqual(box, self.evaluate("--randomize", 0.25, "--randomize-length", 0))
        self.assertEqual(usual, self.evaluate("--randomize", 0))

    def test_a_twins_posterior_is_drawn_said_and_recorded(self):
        def conditions(*more):
            return self.evaluate("--plant", "realaigym-twin", *more)

        usual = conditions()
        drawn = conditions("--randomize-posterior")
        self.assertIs(drawn["randomize"]["randomize_posterior"], True)
        self.assertTrue(drawn["randomize"]["posterior"].startswith("center1 "))
        self.assertEqual(drawn["plant"], usual["plant"])
        self.assertNotEqual(drawn["return"], usual["return"])
        self.assertEqual(drawn, conditions("--randomize-posterior", "--threads", 3))
        table = self.succeed("eval", self.policy, "--episodes", 20, "--plant", "realaigym-twin",
                             "--randomize-posterior", "--episodes-csv", "drawn.csv")
        self.assertIn("randomize_posterior true\n", table)
        # Every episode has a centre of mass of its own, within five deviations of 2 mm.
        with open(self.folder / "drawn.csv", encoding="utf-8") as file:
            centers = {float(row["center1"]) for row in csv.DictReader(file)}
        self.assertEqual(len(centers), 20)
        for center in centers:
            self.assertAlmostEqual(center, usual["plant"]["center1"], delta=0.0104)
        for plant in ((), ("--plant", "realaigym")):
            self.refuse(["eval", self.policy, *plant, "--randomize-posterior"],
                        "--randomize-posterior: expected --plant with a twin that has a covariance")

    def test_random_plants_are_the_same_in_closed_form(self):
        usual, twin = (self.evaluate("--randomize", 0.25, "--physics", physics)
                       for physics in ("mujoco", "closed-form"))
        self.assertAlmostEqual(twin["return"]["mean"], usual["return"]["mean"],
                               delta=1e-3 * abs(usual["return"]["mean"]))

    def test_noise_and_delay_are_said_and_change_the_result(self):
        usual = self.evaluate()
        for name in ("sensor_noise", "delay", "sensor_latency", "velocity_window",
                     "velocity_filter"):
            flag = "--" + name.replace("_", "-")
            disturbed = self.evaluate(flag, 0.1)
            self.assertEqual(disturbed["disturbance"], usual["disturbance"] | {name: 0.1})
            self.assertNotEqual(disturbed["return"], usual["return"])
        encoders = self.evaluate("--encoder-counts", 100)
        self.assertNotEqual(encoders["return"], usual["return"])
        table = self.succeed("eval", self.policy, "--episodes", 2, "--delay", 0.04,
                             "--randomize-mass2", 0.5)
        self.assertIn("delay 0.04, randomize_mass2 0.5\n", table)

    def test_policy_file_and_run_folder_are_the_same(self):
        by_file = json.loads(self.succeed("eval", self.policy / "policy.safetensors", "--json",
                                          "--episodes", 10))
        self.assertEqual(by_file, self.evaluate())


if __name__ == "__main__":
    unittest.main()
