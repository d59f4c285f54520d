#!/usr/bin/env python3
"""write_types.py FOLDER: for type checkers and editors, writes the settings as TypedDicts to
FOLDER/_types.py, and completes the generic types in FOLDER/_upswing.pyi.

Run by the build with the extension module's folder on the PYTHONPATH.
"""

import keyword
import re
import sys
from pathlib import Path

import _upswing  # pylint: disable=import-error

# The arguments that nanobind leaves out.
GENERIC = {"dict": "str, typing.Any", "tuple": "typing.Any, ...", "NDArray": "typing.Any",
           "Callable": "..., typing.Any", "PathLike": "str"}
PYTHON_TYPES = {"bool": "bool", "int": "int", "float": "float", "str": "str",
                "list[int]": "Sequence[int]"}


def every_setting():
    """The settings and aliases of all agents, without duplicates."""
    options, aliases = {}, {}
    for agent, _ in _upswing.agents():
        described = _upswing.training_settings(agent)
        options = {option["name"]: option for option in described[0]} | options
        aliases = {alias["name"]: alias for alias in described[1]} | aliases
    return list(options.values()), list(aliases.values())


def python_type(option):
    if option["choices"]:
        return f"Literal[{', '.join(map(repr, option['choices']))}]"
    if option["name"] in ("plant", "start_policy"):
        return "Union[str, bytes, os.PathLike[str], os.PathLike[bytes]]"
    return PYTHON_TYPES[option["type"]]


def about(option):
    """Help, unit and range of a setting, on one line."""
    text = option["help"] + (f" [{option['unit']}]" if option["unit"] else "")
    if option["low"] is not None and option["high"] is not None:
        text += f" ({option['low']:g} to {option['high']:g})"
    return text


def typed_dict(name, what, options, aliases):
    """The lines of one class."""
    options = [option for option in options if not keyword.iskeyword(option["name"])]
    known = {option["name"]: option for option in options}
    lines = ["", "", f"class {name}(TypedDict, total=False):", f'    """{what}"""', ""]
    for option in options:
        lines += [f"    {option['name']}: {python_type(option)}", f'    """{about(option)}"""']
    for alias in aliases:
        members = [known[member] for member in alias["members"] if member in known]
        if members and not keyword.iskeyword(alias["name"]):
            lines += [f"    {alias['name']}: {python_type(members[0])}",
                      f'    """{alias["help"]}"""']
    return lines


def main():
    options, aliases = every_setting()
    environment = [option for option in options
                   if option["environment"] and option["name"] != "envs"]
    # `train` has separate arguments for these settings.
    training = [option for option in options if option["name"] not in ("agent", "seed")]
    plant = {"name": "plant", "type": "str", "choices": [], "unit": "", "low": None, "high": None,
             "help": "plant file (TOML with a table [plant]) or shipped plant, changed by settings"}
    environment.append(plant)
    training.append(plant)
    start = [{"name": name, "type": "float", "choices": [], "help": help_text, "unit": unit,
              "low": None, "high": None}
             for name, help_text, unit in (
                 ("q1", "start angle of link 1; 0: hanging", "°"),
                 ("q2", "start angle of link 2 relative to link 1", "°"),
                 ("w1", "start velocity of q1", "rad/s"), ("w2", "start velocity of q2", "rad/s"))]
    trial = _upswing.trial_settings()
    on_map = [option for option in trial[0] if option["section"] in ("plant", "disturbance")]
    lines = ['"""Settings as keyword arguments; written by write_types.py from the C++ code."""', "",
             "from __future__ import annotations", "", "import os",
             "from collections.abc import Sequence",
             "from typing import Literal, TypedDict, Union"]
    lines += typed_dict("TrainingSettings", "Settings of trainings, of all algorithms.", training,
                        aliases)
    lines += typed_dict("EnvironmentSettings", "Settings of environments.", environment, aliases)
    lines += typed_dict("TrialSettings", "Settings of evaluations.", *trial)
    lines += typed_dict("MapSettings", "Settings of maps.", on_map + start,
                        [alias for alias in trial[1] if alias["section"] == "plant"])
    folder = Path(sys.argv[1])
    (folder / "_types.py").write_text("\n".join(lines) + "\n", encoding="utf-8")
    module = folder / "_upswing.pyi"
    text = module.read_text(encoding="utf-8")
    for name, arguments in GENERIC.items():
        text = re.sub(rf"(->|[:\[,|]) ?((?:\w+\.)*{name})\b(?![\[(])", rf"\1 \2[{arguments}]", text)
    module.write_text(text.replace("\nimport os\n", "\nimport os\nimport typing\n"),
                      encoding="utf-8")


if __name__ == "__main__":
    main()
