#!/usr/bin/env python3
"""Compiles base, nn, pendulum, rl, control and agents to WebAssembly, for the page.

    build.py [MODULE]     writes MODULE, by default core.wasm next to this file, and a record of its
                          sources and versions, by default core.txt
    build.py --versions   prints the versions of compiler and libraries
    build.py --check      compares core.wasm and the sources with the hashes of the record

The compiler is Zig's clang. Its C++ library is compiled here with exceptions, which refuse invalid
files. ./upswing test installs both in build/deps. The same versions give the same bytes on any
machine.
"""

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


def pinned(name):
    """The version in tools/NAME-requirements.txt."""
    text = (ROOT / f"tools/{name}-requirements.txt").read_text(encoding="utf-8")
    return re.search(r"(?:==| @ .*_)(\d[\d.]*\d)", text)[1]


ZIG = DEPS / f"zig-{pinned('zig')}"
HIGHWAY = DEPS / f"highway-{pinned('highway')}"  # the version of NumPy that it comes with
MUPARSER = DEPS / f"muparser-{pinned('muparser')}"

# Vectors of 128 bits, exceptions, and features of all browsers with those.
TARGET = ["-target", "wasm32-wasi", "-mcpu=generic+simd128+exception_handling+bulk_memory"
          "+nontrapping_fptoint+sign_ext", "-fwasm-exceptions", "-fvisibility=hidden", "-DNDEBUG"]
MEMORY = 512 << 20  # bytes at most; see learner.cc
STACK = 1 << 20

LAYERS = ["base", "nn", "pendulum", "rl", "control", "agents"]
# Sources compiled for speed, because trainings spend their time there. All others are compiled for
# size.
FAST = ["nn/linear", "nn/product", "pendulum/closed_form", "control/trajectory", "control/pendulum_model", "rl/replay/replay", "rl/replay/sum_tree",
        "rl/replay/n_step", "rl/sac/sac_update"]

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
               if not path.stem.endswith(("_test", "_bench")) and path.name != "thread_pool.cc"]
    return sources + sorted(HERE.glob("*.cc"))


CONFIGS = {"AGENT_ENTRIES": ROOT / "configs", "GYMNASIUM_ENTRIES": ROOT / "configs/gymnasium"}


def named_agents():
    """What CMake makes of the settings in CONFIGS."""
    text = (ROOT / "src/agents/named_agents.cc.in").read_text(encoding="utf-8")
    for name, folder in CONFIGS.items():
        entries = "".join(f'    {{"{path.stem}", R"toml({path.read_text(encoding="utf-8")})toml"}},\n'
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
    abi = Path("/usr/include/nlohmann/detail/abi_macros.hpp")
    found = {"zig": pinned("zig"), "highway of numpy": pinned("highway"), "muparser": pinned("muparser"),
             "nlohmann-json": of("nlohmann/detail/abi_macros.hpp" if abi.exists()
                                 else "nlohmann/json.hpp", *json),
             "toml++": of("toml++/impl/version.h", *toml)}
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


def sources_hash():
    """SHA-256 of the sources, headers, named agents, pinned versions, and this file with its flags."""
    text = hashlib.sha256()
    for path in [*included([*own_sources(), STREAMS, ROOT / "src/agents/named_agents.cc.in"]),
                 *(path for folder in CONFIGS.values() for path in sorted(folder.glob("*.toml"))),
                 Path(__file__).resolve()]:
        data = path.read_bytes()
        text.update(f"{path.relative_to(ROOT)} {len(data)}\n".encode() + data)
    text.update(" ".join(map(str, (project_version(), ZIG.name, HIGHWAY.name, MUPARSER.name))).encode())
    return text.hexdigest()


def record(module):
    """The lines of a module's record: versions, hash of the sources, hash of the module."""
    return [versions(), f"sources {sources_hash()}",
            f"module {hashlib.sha256(module.read_bytes()).hexdigest()}"]


def recorded(module):
    """The lines of the record next to a module."""
    return module.with_suffix(".txt").read_text(encoding="utf-8").splitlines()


def is_recorded(module):
    """Whether a module and the sources have the hashes of the module's record."""
    return recorded(module)[1:] == record(module)[1:]


def run(program, *arguments):
    """Runs Zig with a cache, so that repeated compilations are short. Returns its command line of the
    linker, if -v asks for it."""
    cache = str((WORK / "cache").relative_to(ROOT))
    environment = os.environ | {"ZIG_LOCAL_CACHE_DIR": cache, "ZIG_GLOBAL_CACHE_DIR": cache}
    done = subprocess.run([ZIG / "zig", program, *map(str, arguments)], check=False, cwd=ROOT,
                          env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          encoding="utf-8")
    if done.returncode != 0 or (done.stdout and not done.stdout.startswith("wasm-ld ")):
        sys.exit(f"build.py: {done.stdout}")
    return done.stdout.split()


def compile_one(source, flags):
    """Compiles to an object file and returns its path."""
    relative = source.relative_to(ROOT) if source.is_relative_to(ROOT) else source
    name = str(relative).replace("/", "_")
    target = WORK / f"{name}.o"
    program = "c++" if source.suffix in (".cc", ".cpp") else "cc"
    if source.suffix == ".s":
        run(program, *TARGET[:3], "-c", relative, "-o", target)
        return target
    # The same paths in the module on any machine, such as in failed assertions.
    maps = [f"-ffile-prefix-map={folder}={name}" for folder, name in
            ((ROOT, "."), (DEPS.resolve(), "deps"))]
    run(program, *TARGET, *maps, *flags, "-c", relative, "-o", target)
    return target


def jobs():
    """Each source with its flags."""
    headers = WORK / "include"
    headers.mkdir(parents=True, exist_ok=True)
    for name in ("nlohmann", "toml++", "eigen3/Eigen", "eigen3/unsupported"):
        link = headers / Path(name).name
        if not link.is_symlink():
            link.symlink_to(Path("/usr/include") / name)
    agents = WORK / "named_agents.cc"
    agents.write_text(named_agents(), encoding="utf-8")
    tag = WORK / "exception_tag.s"
    tag.write_text(EXCEPTION_TAG, encoding="utf-8")
    # Zig leaves some headers out of the C++ library. Sources that mention them still compile, but
    # are not linked.
    own = ["-std=c++20", "-Wall", "-Wextra", "-Wpedantic", "-ffp-contract=off",
           "-DTOML_FLOAT_CHARCONV=1", f'-DUPSWING_VERSION="{project_version()}"',
           "-U_LIBCPP_HAS_FILESYSTEM", "-D_LIBCPP_HAS_FILESYSTEM=1", *include(SOURCE, ROOT),
           *(f"-isystem{folder}" for folder in (headers, HIGHWAY, MUPARSER / "include"))]
    fast = {SOURCE / f"{name}.cc" for name in FAST}
    for source in [*own_sources(), agents]:
        yield source, [*own, "-O3" if source in fast else "-Oz"]
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


def make(module):
    """Writes the module and its record."""
    for folder in (ZIG, HIGHWAY, MUPARSER):
        if not folder.exists():
            sys.exit(f"build.py: {folder} is missing: ./upswing test installs it")
    WORK.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(lambda job: compile_one(*job), jobs()))
    linked = WORK / "core.wasm"
    linker = run("cc", "-v", *TARGET, "-mexec-model=reactor", "-s", f"-Wl,--max-memory={MEMORY}",
                 f"-Wl,-z,stack-size={STACK}", "-o", linked.relative_to(ROOT),
                 *(path.relative_to(ROOT) for path in objects))
    # Shortens the addresses in the code: 8 kB less to load. Zig's cc does not know this option.
    run(*linker, "--compress-relocations")
    module.write_bytes(linked.read_bytes())
    module.with_suffix(".txt").write_text("\n".join(record(module)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:] == ["--versions"]:
        print(versions())
    elif sys.argv[1:] == ["--check"]:
        if not is_recorded(HERE / "core.wasm"):
            sys.exit("build.py: core.txt records other sources or another module: run web/wasm/build.py")
    else:
        make(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "core.wasm")
