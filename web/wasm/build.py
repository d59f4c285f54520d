#!/usr/bin/env python3
"""Compiles base, nn, pendulum, rl, control and agents to WebAssembly, for the page.

    build.py           writes build/wasm/core.wasm, unless it is there and its sources are unchanged
    build.py --check   fails if the module is missing or out of date; compiles nothing
    build.py --key     prints the hash of the sources and of all versions

The compiler is Zig's clang. Its C++ library is compiled here with exceptions, which refuse invalid
files. ./upswing demo and ./upswing test install both in build/deps; without them this program exits
with 77. The same versions give the same bytes on any machine.
"""

import fcntl
import hashlib
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SOURCE = ROOT / "src"
DEPS = ROOT / "build/deps"
WORK = ROOT / "build/wasm"
MODULE = WORK / "core.wasm"
KEY = WORK / "core.key"  # the key of MODULE
NO_COMPILER = 77  # exit status, as of a skipped test


def pinned(name):
    """The version in tools/NAME-requirements.txt."""
    text = (ROOT / f"tools/{name}-requirements.txt").read_text(encoding="utf-8")
    return re.search(r"(?:==| @ .*_)(\d[\d.]*\d)", text)[1]


ZIG = DEPS / f"zig-{pinned('zig')}"
HIGHWAY = DEPS / f"highway-{pinned('highway')}"  # the version of NumPy that it comes with
MUPARSER = DEPS / f"muparser-{pinned('muparser')}"

# Vectors of 128 bits, exceptions, and features of all browsers with those.
MACHINE = ["-target", "wasm32-wasi", "-mcpu=generic+simd128+exception_handling+bulk_memory"
           "+nontrapping_fptoint+sign_ext"]
TARGET = [*MACHINE, "-fwasm-exceptions", "-fvisibility=hidden", "-DNDEBUG"]
MEMORY = 512 << 20  # bytes at most; see learner.cc
STACK = 1 << 20

# Threads, which web/wasm/thread_pool.cc replaces.
NOT_HERE = {"thread_pool.cc", "wait.cc", "wait_windows.cc"}
LAYERS = ["base", "nn", "pendulum", "rl", "control", "agents"]
# Sources compiled for speed, because trainings spend their time there. All others are compiled for
# size.
FAST = ["nn/linear", "nn/product", "pendulum/closed_form", "control/trajectory", "control/pendulum_model", "rl/replay/replay", "rl/replay/sum_tree",
        "rl/sac/sac_update"]

# The needed sources of muParser.
PARSER = ["", "Base", "Bytecode", "Callback", "Error", "TokenReader"]
STREAMS = HERE / "muparser_streams.h"  # included first in each

# The needed sources of LLVM's libraries.
CXXABI = ["abort_message", "cxa_aux_runtime", "cxa_default_handlers", "cxa_exception",
          "cxa_exception_storage", "cxa_guard", "cxa_handlers", "cxa_personality", "cxa_virtual",
          "fallback_malloc", "private_typeinfo", "stdlib_exception", "stdlib_new_delete",
          "stdlib_stdexcept", "stdlib_typeinfo"]
CXX = ["algorithm", "call_once", "chrono", "error_category", "exception", "functional",
       "hash", "memory", "new", "new_handler", "new_helpers",
       "stdexcept", "string", "system_error", "variant", "vector", "verbose_abort",
       "filesystem/path"]

# The tag by which throw and catch find each other. Clang expects it in the run-time library.
EXCEPTION_TAG = ".globl __cpp_exception\n.tagtype __cpp_exception i32\n__cpp_exception:\n"


def include(*folders):
    return [f"-I{folder}" for folder in folders]


def own_sources():
    sources = [path for layer in LAYERS for path in sorted((SOURCE / layer).rglob("*.cc"))
               if not path.stem.endswith(("_test", "_bench")) and path.name not in NOT_HERE]
    return sources + sorted(HERE.glob("*.cc"))


CONFIGS = {"AGENT_ENTRIES": ROOT / "configs", "GYMNASIUM_ENTRIES": ROOT / "configs/gymnasium"}


def settings_of(path):
    """A TOML file without its lines of comments, which are texts for a terminal."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("#"))


def named_agents():
    """What CMake makes of the settings in CONFIGS."""
    text = (ROOT / "src/agents/named_agents.cc.in").read_text(encoding="utf-8")
    for name, folder in CONFIGS.items():
        entries = "".join(f'    {{"{path.stem}", R"toml({settings_of(path)})toml"}},\n'
                          for path in sorted(folder.glob("*.toml")))
        text = text.replace(f"@{name}@", entries)
    return text


def project_version():
    return re.search(r"project\(upswing VERSION ([0-9.]+)",
                     (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]


def versions():
    """Names and versions of compiler and libraries."""
    def of(header, *names):
        path = Path("/usr/include") / header
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        found = [re.search(rf"#\s*define {name}\s+(\d+)", text) for name in names]
        return ".".join(match[1] for match in found if match)
    json = [f"NLOHMANN_JSON_VERSION_{part}" for part in ("MAJOR", "MINOR", "PATCH")]
    toml = [f"TOML_LIB_{part}" for part in ("MAJOR", "MINOR", "PATCH")]
    eigen = [f"EIGEN_{part}_VERSION" for part in ("WORLD", "MAJOR", "MINOR")]
    abi = Path("/usr/include/nlohmann/detail/abi_macros.hpp")
    found = {"zig": pinned("zig"), "highway of numpy": pinned("highway"), "muparser": pinned("muparser"),
             "nlohmann-json": of("nlohmann/detail/abi_macros.hpp" if abi.exists()
                                 else "nlohmann/json.hpp", *json),
             "toml++": of("toml++/impl/version.h", *toml),
             "eigen": of("eigen3/Eigen/src/Core/util/Macros.h", *eigen)}
    return ", ".join(f"{name} {version}" for name, version in found.items())


def included(sources):
    """The sources and all headers of ours that they include."""
    found, left = set(), list(sources)
    while left:
        path = left.pop()
        if path in found:
            continue
        found.add(path)
        for name in re.findall(r'^\s*#\s*include "([^"]+)"', path.read_text(encoding="utf-8"), re.M):
            left += [header for header in (SOURCE / name, ROOT / name, path.parent / name) if header.is_file()][:1]
    return sorted(found)


def key():
    """SHA-256 of the sources, headers, named agents, versions, and this file with its flags. The same
    key means the same module."""
    text = hashlib.sha256()
    for path in [*included([*own_sources(), STREAMS, ROOT / "src/agents/named_agents.cc.in"]),
                 *(path for folder in CONFIGS.values() for path in sorted(folder.glob("*.toml"))),
                 Path(__file__).resolve()]:
        data = path.read_bytes()
        text.update(f"{path.relative_to(ROOT)} {len(data)}\n".encode() + data)
    text.update(f"{project_version()} {versions()}".encode())
    return text.hexdigest()


def is_current():
    """Whether the module is there and its sources and versions are unchanged."""
    return MODULE.exists() and KEY.exists() and KEY.read_text(encoding="utf-8") == key()


def run(program, *arguments):
    """Runs Zig with a cache, so that repeated compilations are short. Returns its output. Exits if it
    fails."""
    cache = str((WORK / "cache").relative_to(ROOT))
    environment = os.environ | {"ZIG_LOCAL_CACHE_DIR": cache, "ZIG_GLOBAL_CACHE_DIR": cache}
    done = subprocess.run([ZIG / "zig", program, *map(str, arguments)], check=False, cwd=ROOT,
                          env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          encoding="utf-8")
    if done.returncode != 0:
        sys.exit(f"build.py: {done.stdout}")
    return done.stdout


def compile_one(source, flags):
    """Compiles to an object file and returns its path."""
    relative = source.relative_to(ROOT) if source.is_relative_to(ROOT) else source
    name = str(relative).replace("/", "_")
    target = WORK / f"{name}.o"
    program = "c++" if source.suffix in (".cc", ".cpp") else "cc"
    if source.suffix == ".s":
        run(program, *MACHINE, "-c", relative, "-o", target)
        return target
    # The same paths in the module on any machine, such as in failed assertions.
    maps = [f"-ffile-prefix-map={folder}={name}" for folder, name in
            ((ROOT, "."), (DEPS.resolve(), "deps"))]
    warnings = run(program, *TARGET, *maps, *flags, "-c", relative, "-o", target)
    if warnings:
        sys.exit(f"build.py: {warnings}")
    return target


def generated(name, text):
    """Writes a source, unless it is there with this text: Zig compiles a new file again."""
    path = WORK / name
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
    return path


def joined(sources):
    """One source for each layer that includes those of the layer, which halves the time: most of it
    goes into headers."""
    for layer in LAYERS:
        names = [path.relative_to(ROOT) for path in sources if path.is_relative_to(SOURCE / layer)]
        yield generated(f"{layer}.cc", "".join(f'#include "{name}"\n' for name in names))


def jobs():
    """Each source with its flags."""
    headers = WORK / "include"
    headers.mkdir(parents=True, exist_ok=True)
    for name in ("nlohmann", "toml++", "eigen3/Eigen", "eigen3/unsupported"):
        folder = headers / Path(name).name
        if not folder.is_symlink():
            folder.symlink_to(Path("/usr/include") / name)
    agents = generated("named_agents.cc", named_agents())
    tag = generated("exception_tag.s", EXCEPTION_TAG)
    # Zig leaves some headers out of the C++ library. Sources that mention them still compile, but
    # are not linked.
    own = ["-std=c++20", "-Wall", "-Wextra", "-Wpedantic", "-ffp-contract=off",
           "-DTOML_FLOAT_CHARCONV=1", f'-DUPSWING_VERSION="{project_version()}"',
           "-U_LIBCPP_HAS_FILESYSTEM", "-D_LIBCPP_HAS_FILESYSTEM=1", *include(SOURCE, ROOT),
           *(f"-isystem{folder}" for folder in (headers, HIGHWAY, MUPARSER / "include"))]
    fast = {SOURCE / f"{name}.cc" for name in FAST}
    small = [path for path in own_sources() if path not in fast and path.is_relative_to(SOURCE)]
    for source in [*joined(small), *sorted(HERE.glob("*.cc")), agents]:
        yield source, [*own, "-Oz"]
    for source in sorted(fast):
        yield source, [*own, "-O3"]
    for name in PARSER:
        yield (MUPARSER / f"src/muParser{name}.cpp",
               ["-std=c++20", "-Oz", "-w", "-ffp-contract=off", f"-I{MUPARSER / 'include'}",
                "-include", STREAMS])
    cxx = ["-std=c++23", "-Oz", "-w", "-D_LIBCPP_BUILDING_LIBRARY", "-D_LIBCXXABI_BUILDING_LIBRARY",
           "-DLIBCXX_BUILDING_LIBCXXABI", "-DLIBCXXABI_SILENT_TERMINATE",
           "-D_LIBCXXABI_HAS_NO_THREADS",
           *include(*(ZIG / f"lib/{folder}" for folder in
                      ("libcxxabi/include", "libcxx/src", "libcxx/libc", "libunwind/include")))]
    for library, names in (("libcxxabi", CXXABI), ("libcxx", CXX)):
        for name in names:
            yield ZIG / f"lib/{library}/src/{name}.cpp", cxx
    unwind = ZIG / "lib/libunwind"
    yield unwind / "src/Unwind-wasm.c", ["-Oz", "-w", "-D_LIBUNWIND_HAS_NO_THREADS",
                                         "-D_LIBUNWIND_HIDE_SYMBOLS", *include(unwind / "include")]
    yield tag, []


def link(objects):
    """Links the module and returns its path."""
    linked = WORK / "linked.wasm"
    # -O2: without it, Zig adds its run-time library for undefined behaviour.
    output = run("cc", "-v", *TARGET, "-O2", "-mexec-model=reactor", "-s",
                 f"-Wl,--max-memory={MEMORY}", f"-Wl,-z,stack-size={STACK}",
                 "-o", linked.relative_to(ROOT), *(path.relative_to(ROOT) for path in objects))
    # The last line is the linker's. Lines before it made C's library.
    linker = output.splitlines()[-1].split()
    # Shortens the addresses in the code: 8 kB less to load. Zig's cc does not know this option.
    run(*linker, "--compress-relocations")
    return linked


def compile_module():
    """Writes the module and its key."""
    made_from = key()
    KEY.unlink(missing_ok=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(lambda job: compile_one(*job), jobs()))
    link(objects).replace(MODULE)
    KEY.write_text(made_from, encoding="utf-8")


def make():
    """Compiles the module unless it is current. Another process that makes it is waited for."""
    if is_current():
        return
    for folder in (ZIG, HIGHWAY, MUPARSER):
        if not folder.exists():
            print(f"build.py: {folder} is missing: ./upswing demo or ./upswing test installs it",
                  file=sys.stderr)
            sys.exit(NO_COMPILER)
    WORK.mkdir(parents=True, exist_ok=True)
    with open(WORK / ".lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not is_current():
            compile_module()


if __name__ == "__main__":
    match sys.argv[1:]:
        case []:
            make()
        case ["--check"]:
            if not is_current():
                sys.exit(f"build.py: {MODULE} is missing or out of date: run web/wasm/build.py")
        case ["--key"]:
            print(key())
        case _:
            sys.exit("build.py: expected --check, --key or nothing")
