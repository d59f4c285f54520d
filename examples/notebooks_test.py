#!/usr/bin/env python3
"""Runs the notebooks from top to bottom with the built package, as a reader would, and two examples in
Python.

  notebooks_test.py                  runs them all
  notebooks_test.py --keep NAME...   runs notebooks and keeps their new outputs in the files

It enters the virtual environment build/python-test-venv. Start it with the Python of the package:
build/python-venv/bin/python.
"""

import base64
import importlib.util
import io
import os
import subprocess
import sys
import sysconfig
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(ROOT / "src/cli"))
import test_environment  # noqa: E402

# The kernels find the package, its libraries and the program where the first Python has them.
if not test_environment.inside("python-test"):
    PATHS = [os.environ.get("PYTHONPATH", str(ROOT / "build/release/python")),
             sysconfig.get_path("purelib")]
    PROGRAM = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))
    os.environ |= {"PYTHONPATH": os.pathsep.join(PATHS),
                   "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"}
test_environment.enter(__file__, "python-test")

import nbclient  # noqa: E402
import nbformat  # noqa: E402
from PIL import Image  # noqa: E402

NOTEBOOKS = sorted((ROOT / "examples/notebooks").glob("*.ipynb"))
LARGEST = 600_000  # bytes, all notebooks together
NEEDS = {"7-stable-baselines3": "stable_baselines3"}
# Texts of cells and their replacements in tests: one training of each variant runs all cells.
SHORTER = {"3-the-posts-comparison": ("SEEDS, STEPS = (1, 2, 3)", "SEEDS, STEPS = (1,)")}


def client(notebook, folder):
    """Runs a notebook in `folder`, without the user's settings of Jupyter."""
    os.environ |= {"JUPYTER_PLATFORM_DIRS": "1"} | {
        name: folder for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR",
                                  "JUPYTER_RUNTIME_DIR", "MPLCONFIGDIR")}
    return nbclient.NotebookClient(
        notebook, timeout=1200, startup_timeout=1200, kernel_name="python3", record_timing=False, coalesce_streams=True,
        resources={"metadata": {"path": str(ROOT / "examples/notebooks")}})


def run(path, shorter=None):
    """A notebook with new outputs. `shorter`: a text in one of its cells, and its replacement."""
    notebook = nbformat.read(path, 4)
    if shorter:
        cell, = (cell for cell in notebook.cells if shorter[0] in cell.source)
        cell.source = cell.source.replace(*shorter)
    with tempfile.TemporaryDirectory() as folder:
        client(notebook, folder).execute()
    return notebook


def keep(path):
    """Writes a notebook with new outputs, its pictures with 32 colours."""
    notebook = run(path)
    for output in outputs(notebook):
        picture = output.get("data", {}).get("image/png")
        if picture:
            small = io.BytesIO()
            Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB").quantize(32).save(
                small, "PNG", optimize=True)
            output.data["image/png"] = base64.b64encode(small.getvalue()).decode()
    notebook.metadata.language_info = {"name": "python"}
    path.write_text(nbformat.writes(notebook, indent=1) + "\n", encoding="utf-8")


def outputs(notebook):
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


class Notebooks(unittest.TestCase):
    def test_files_are_small_and_keep_their_outputs(self):
        self.assertEqual(len(NOTEBOOKS), 8)
        self.assertLess(sum(path.stat().st_size for path in NOTEBOOKS), LARGEST)
        for path in NOTEBOOKS:
            with self.subTest(path.name):
                notebook = nbformat.read(path, 4)
                nbformat.validate(notebook)
                kinds = [output.output_type for output in outputs(notebook)]
                self.assertIn("display_data", kinds)
                self.assertNotIn("error", kinds)
                self.assertNotIn("/tmp", str(outputs(notebook)))
                self.assertIn("\n## Try\n", "\n" + notebook.cells[-1].source)

    def test_notebook_7_keeps_the_installed_pytorch(self):
        """Without a version, pip replaces a PyTorch that is too old, or missing, by 3 GB with CUDA."""
        cells = nbformat.read(ROOT / "examples/notebooks/7-stable-baselines3.ipynb", 4).cells
        source = "\n".join(cell.source for cell in cells)
        commands = [line for line in source.splitlines() if "%pip" in line and "stable-baselines3" in line]
        self.assertEqual(len(commands), 1)
        self.assertIn(" torch=={torch.__version__}", commands[0])
        self.assertLess(source.index("import torch "), source.index(commands[0]))

    def test_an_interrupted_training_returns_and_resumes(self):
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code) for code in (
            "import os, signal, tempfile, upswing\n"
            "run = tempfile.mkdtemp() + '/run'",
            # The signal is the one that Jupyter's stop button sends.
            "training = upswing.train('fast', out=run, steps=10**9, threads=1, eval_every=10**9,\n"
            "                         on_metrics=lambda row: os.kill(os.getpid(), signal.SIGINT))",
            "assert not training.finished and training.steps > 0\n"
            "more = upswing.train(resume=run, steps=training.steps + 3200, progress=False)\n"
            "assert more.finished and more.steps > training.steps")])
        with tempfile.TemporaryDirectory() as folder:
            client(notebook, folder).execute()
        shown = str(notebook.cells[1].outputs)
        self.assertRegex(shown, "<progress value=[1-9]")
        self.assertRegex(shown, r"interrupted at step [\d,]+; train\(resume='.*run'\) continues")


class Loggers(unittest.TestCase):
    """The examples for Weights & Biases and MLflow, without a network."""

    def run_offline(self, name, pattern):
        package = name.removeprefix("log_")
        if not importlib.util.find_spec(package):
            self.skipTest(f"needs {package}")
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, ROOT / f"examples/python/{name}.py"], check=True, cwd=folder,
                           env=os.environ | {"WANDB_MODE": "offline", "WANDB_SILENT": "true",
                                             "MLFLOW_TRACKING_URI": "sqlite:///mlflow.db"})
            self.assertTrue(list(Path(folder).glob(pattern)))

    def test_wandb(self):
        self.run_offline("log_wandb", "wandb/offline-run-*/run-*.wandb")

    def test_mlflow(self):
        self.run_offline("log_mlflow", "mlruns/*/*/artifacts/policy.safetensors")


def add(path):
    name = path.stem
    package = NEEDS.get(name)

    @unittest.skipIf(package and not importlib.util.find_spec(package), f"needs {package}")
    def test(_):
        run(path, SHORTER.get(name))

    setattr(Notebooks, f"test_{name.replace('-', '_')}", test)


for each in NOTEBOOKS:
    add(each)

if __name__ == "__main__":
    if sys.argv[1:2] == ["--keep"]:
        for each in NOTEBOOKS:
            if each.stem in sys.argv[2:]:
                keep(each)
    else:
        unittest.main()
