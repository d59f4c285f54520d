# shellcheck shell=sh
# Sets up the page's tools: Node, its packages, its core in WebAssembly, a Chromium for the tests.
# Read by ./upswing and tools/web_test, which have the repository's folder in $root.
: "${root:?}"

# Downloaded if no suitable Node is installed.
own_node=$root/build/deps/node-$(sed -n 's/.*==\([0-9.]*\).*/\1/p' "$root/tools/node-requirements.txt")

# Whether Vite runs on this version of Node: 20.19, 22.12 or later ones.
node_is_suitable() {
  minor=${1#*.}
  minor=${minor%%.*}
  case $1 in
    v20.*) [ "$minor" -ge 19 ] ;;
    v22.*) [ "$minor" -ge 12 ] ;;
    v2[3-9].* | v[3-9][0-9].*) ;;
    *) false ;;
  esac
}

# Puts Node and npm on the PATH unless they are there; fails without suitable ones.
find_node() {
  ! { node_is_suitable "$(node --version 2>/dev/null)" && command -v npm >/dev/null; } || return 0
  [ -x "$own_node/bin/npm" ] || return 1
  PATH=$own_node/bin:$PATH
}

lock_hash() { sha256sum <"$root/web/package-lock.json"; }

# Whether web/node_modules matches the lock file.
modules_are_current() {
  stamp=$root/web/node_modules/.upswing-lock
  [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$(lock_hash)" ]
}

# Prints the Chromium that tests run: UPSWING_CHROMIUM or one on the PATH. The headless shell, which
# has no windows, takes two thirds of the time. Each candidate has to start: Ubuntu's
# chromium-browser may only point to a snap.
find_chromium() {
  for chromium in ${UPSWING_CHROMIUM:+"$UPSWING_CHROMIUM"} chromium-headless-shell \
    chromium chromium-browser google-chrome; do
    "$chromium" --version >/dev/null 2>&1 </dev/null || continue
    command -v "$chromium"
    return
  done
  return 1
}

# The folder for Playwright's own Chromium, for systems without a package, such as Ubuntu.
export PLAYWRIGHT_BROWSERS_PATH="$root/build/deps/playwright"
has_own_chromium() { [ -n "$(find "$PLAYWRIGHT_BROWSERS_PATH" -name INSTALLATION_COMPLETE 2>/dev/null)" ]; }

# The functions below install. Only ./upswing uses them, with its own functions.

# Puts Node on the PATH and its packages into web/node_modules, unless they are there.
set_up_node() {
  if ! find_node; then
    (install_packages python3 python3-pip ca-certificates && lock &&
      "$root/tools/fetch_wheel" node "$own_node") </dev/null || exit 1
    find_node || fail "Node was fetched but does not run: $own_node/bin/node"
  fi
  ! modules_are_current || return 0
  (
    lock
    ! modules_are_current || exit 0 # another process did it
    say "installing the page's packages (npm ci)"
    cd web
    npm ci --loglevel=error >../build/npm.log 2>&1 ||
      fail "npm could not install the page's packages (no network?), see build/npm.log:" \
        "$(grep -m 1 'npm error' ../build/npm.log)"
  ) </dev/null || exit 1
}

# The package with a Chromium that works without snap, if one is wanted and exists.
chromium_package() {
  ! find_chromium >/dev/null || return 0
  case $(system_name) in debian*) echo chromium-headless-shell ;; esac
}

# On other systems: Playwright's own Chromium, with the libraries that it needs.
set_up_chromium() {
  ! { find_chromium >/dev/null || has_own_chromium; } || return 0
  say "installing Chromium (playwright install)"
  (cd "$root/web" && npx playwright install --with-deps chromium-headless-shell) </dev/null >&2 ||
    fail "no Chromium could be installed (see above); set UPSWING_CHROMIUM to one"
}

# Compiles the page's core, build/wasm/core.wasm, unless its sources are unchanged. The compiler is
# fetched first.
set_up_core() {
  ! "$python" -B "$root/web/wasm/build.py" --check 2>/dev/null || return 0
  (
    lock
    for name in zig highway muparser; do
      version=$(sed -n 's/^[a-z]*\(==\| @ .*_\)\([0-9.]*[0-9]\).*/\2/p' "$root/tools/$name-requirements.txt")
      "$root/tools/fetch_wheel" $name "$root/build/deps/$name-$version" ||
        fail "the page's core, a part in WebAssembly, is compiled with it. Without a network: copy" \
          "build/deps and build/wasm from another machine with the same sources"
    done
    say "compiling the page's core (about 2 minutes the first time)"
    "$python" -B web/wasm/build.py >&2 || fail "the page's core could not be compiled (see above)"
  ) </dev/null || exit 1
}
